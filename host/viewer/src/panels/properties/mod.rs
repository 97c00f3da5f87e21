//! The properties of what is selected.

mod background;
mod bookmark;
mod breakdown;
mod camera;
mod cloud;
mod colors;
mod comparison;
mod environment;
mod light;
mod measure;
mod passes;
mod picture;
mod placement;
mod renderer;
mod surface;

pub(super) use cloud::facts;
pub(crate) use colors::choices as color_choices;
pub(super) use light::light_name;

use super::Selection;
use super::row::{Scale, axes, check_row, row, row_of, slider_row};
use crate::commands::{self, find};
use crate::theme::{Icon, icon_text, iconed, space, tokens};
use crate::views::measuring::icon;
use crate::window::Window;
use eframe::egui::{Button, CollapsingHeader, Response, RichText, Role, Ui, WidgetInfo};

/// Shows the properties of what is selected.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    let selection = window.selection();
    heading(window, ui, selection);
    match selection {
        Selection::Cloud(i) => {
            section(ui, "This cloud", true, |ui| cloud::show(window, ui, i));
            section(ui, "Placement", false, |ui| placement::show(window, ui, i));
            section(ui, "Colours of all clouds", true, |ui| colors::show(window, ui));
            section(ui, "Surface of all clouds", true, |ui| surface::show(window, ui));
        }
        Selection::Light(_) | Selection::LightOff(_) => light::show(window, ui, selection),
        Selection::Environment => environment::show(window, ui),
        Selection::Camera => camera::show(window, ui),
        Selection::Bookmark(i) => bookmark::show(window, ui, i),
        Selection::Measure(i) => measure::show(window, ui, i),
        Selection::View => {
            section(ui, "Renderer", true, |ui| {
                environment::offer(window, ui);
                renderer::show(window, ui);
            });
            section(ui, "Compare", true, |ui| comparison::show(window, ui));
            section(ui, "Picture", true, |ui| picture::show(window, ui));
            section(ui, "Camera", true, |ui| camera::show(window, ui));
            section(ui, "Passes", true, |ui| passes::show(window, ui));
            section(ui, "What it is made of", false, |ui| breakdown::show(window, ui));
        }
    }
}

/// What is selected, and of which kind it is.
fn heading(window: &Window, ui: &mut Ui, selection: Selection) {
    let (icon, kind) = match selection {
        Selection::View => (Icon::PictureInPicture2, "view"),
        Selection::Cloud(_) => (Icon::Cloud, "cloud"),
        Selection::Light(_) => (Icon::Lightbulb, "light"),
        Selection::LightOff(_) => (Icon::LightbulbOff, "switched off"),
        Selection::Environment => (Icon::Globe, ""),
        Selection::Camera => (Icon::Video, "of the focused view"),
        Selection::Bookmark(_) => (Icon::Bookmark, "remembered camera"),
        Selection::Measure(i) => {
            let kind = window.settings.measures.get(i).map(|measure| measure.kind);
            let kind = kind.unwrap_or_default();
            (icon(kind), kind.name())
        }
    };
    let name = window.name_of(selection);
    ui.horizontal(|ui| {
        ui.set_min_height(26.0);
        ui.label(icon_text(icon).size(16.0).color(tokens(ui).link));
        let kind = if kind == name || name.starts_with(kind) { "" } else { kind };
        let width = (ui.available_width() - 7.0 * kind.len() as f32).max(60.0);
        ui.scope(|ui| {
            ui.set_max_width(width);
            ui.add(eframe::egui::Label::new(RichText::new(name).strong().size(15.0)).truncate());
        });
        ui.weak(kind);
    });
    ui.add_space(2.0);
}

fn section(ui: &mut Ui, title: &str, is_open: bool, contents: impl FnOnce(&mut Ui)) {
    let text = RichText::new(title).strong().size(14.0);
    CollapsingHeader::new(text).default_open(is_open).show_unindented(ui, |ui| {
        contents(ui);
        ui.add_space(space::SMALL);
    });
    ui.separator();
}

/// A button of a command, in words.
fn command_button(window: &mut Window, ui: &mut Ui, id: &str, words: &str) -> Option<Response> {
    let command = find(id)?;
    let refused = commands::why_not(window, command);
    let button = Button::new(iconed(ui, command.icon, words));
    let is_enabled = refused.is_none();
    let response = ui.add_enabled(is_enabled, button);
    response.widget_info(|| WidgetInfo::labeled(Role::Button, is_enabled, words));
    let about = match refused {
        None => command.about.to_owned(),
        Some(reason) => format!("Not now: {reason}."),
    };
    let response = response.on_hover_text(&about).on_disabled_hover_text(&about);
    if response.clicked() {
        commands::run(window, &ui.ctx().clone(), command);
    }
    Some(response)
}
