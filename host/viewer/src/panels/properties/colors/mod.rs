//! The panel of colours: what colours surfels, and which are shown.

mod categories;
mod filters;
mod ramp;

use super::{check_row, row, row_of};
use crate::window::Window;
use eframe::egui::{self, Ui};
use surfelshop_api::columns::{
    CLIP, COLOR, NORMAL, NORMAL_FIELD, POSITION, ROUND, TANGENT_U, TANGENT_V,
};
use surfelshop_cloud::display::{Attribute, ColorBy, ColorSource, Colors, MapChoice};
use surfelshop_cloud::in_groups;
use surfelshop_session::input::clouds::Clouds;

/// Columns that are no numbers of their own.
const LEFT_OUT: [&str; 7] = [POSITION, COLOR, TANGENT_U, TANGENT_V, NORMAL_FIELD, CLIP, ROUND];

/// The colour that is chosen first where one colours all.
const FIRST: [u8; 3] = [196, 160, 120];

/// Shows the panel.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    let Some(shown) = &window.document.clouds else {
        ui.weak("nothing to colour yet");
        return;
    };
    let whole = shown.open_clouds.clouds.clone();
    source(ui, &mut window.settings.color, &whole);
    let by = window.settings.color.by.clone();
    match by {
        ColorBy::Uniform(mut color) => {
            row(ui, "colour", "", |ui| ui.color_edit_button_srgb(&mut color));
            window.settings.color.by = ColorBy::Uniform(color);
        }
        ColorBy::Attribute(attribute) => numbers(window, ui, &attribute, &whole),
        ColorBy::File | ColorBy::Normal => {}
    }
    filters::show(window, ui);
    let n_hidden = window.document.clouds.as_ref().map_or(0, |shown| shown.displayed.n_hidden());
    if n_hidden > 0 {
        let n = in_groups(n_hidden);
        ui.weak(format!("{n} surfels are hidden"));
    }
    if window.document.display_job.is_some() {
        ui.horizontal(|ui| {
            ui.spinner();
            ui.weak("colouring");
        });
    }
    if window.legend().is_some() {
        let about = "What the colours mean, in a corner of each view.";
        check_row(ui, "legend", about, &mut window.settings.shows_legend);
    }
}

/// What can colour surfels, of what the clouds have, and what it is called.
pub(crate) fn choices(clouds: &Clouds) -> Vec<(String, ColorBy)> {
    let columns = &clouds.facts.columns;
    let has = |name: &str| columns.iter().any(|column| column == name);
    let own = if has(COLOR) { "their own colours" } else { "none" };
    let mut choices = vec![
        (own.to_owned(), ColorBy::File),
        ("one colour".to_owned(), ColorBy::Uniform(FIRST)),
        ("height".to_owned(), ColorBy::Attribute(Attribute::Height)),
    ];
    if has(NORMAL) {
        choices.push(("direction of the normal".to_owned(), ColorBy::Normal));
    }
    let numbers = columns.iter().filter(|name| !LEFT_OUT.contains(&name.as_str()));
    choices.extend(numbers.map(|name| {
        let attribute = Attribute::column(name.as_str());
        let label = if name == NORMAL { format!("{name} (component)") } else { name.clone() };
        (label, ColorBy::Attribute(attribute))
    }));
    choices
}

/// The choice of what colours surfels.
fn source(ui: &mut Ui, color: &mut ColorSource, clouds: &Clouds) {
    let choices = choices(clouds);
    let is_same = |a: &ColorBy, b: &ColorBy| match (a, b) {
        (ColorBy::Uniform(_), ColorBy::Uniform(_)) => true,
        (ColorBy::Attribute(a), ColorBy::Attribute(b)) => a.name() == b.name(),
        (a, b) => a == b,
    };
    let known = choices.iter().find(|(_, by)| is_same(by, &color.by));
    let name = match (known, &color.by) {
        (Some((name, _)), _) => name.clone(),
        // A column that none of the visible clouds has.
        (None, ColorBy::Attribute(attribute)) => attribute.title(),
        (None, _) => String::new(),
    };
    let mut chosen = None;
    row_of(ui, "colour by", "What colours surfels.", |ui, _label| {
        let combo = egui::ComboBox::from_id_salt("colour by").selected_text(name).truncate();
        let shown = combo.show_ui(ui, |ui| {
            for (name, by) in choices {
                if ui.selectable_label(is_same(&by, &color.by), name).clicked() {
                    chosen = Some(by);
                }
            }
        });
        shown.response.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::ComboBox, true, "what colours surfels")
        });
        shown.response
    });
    if let Some(by) = chosen.filter(|by| !is_same(by, &color.by)) {
        *color = ColorSource::new(by);
    }
}

/// How numbers become colours.
fn numbers(window: &mut Window, ui: &mut Ui, attribute: &Attribute, whole: &Clouds) {
    let Some(shown) = &window.document.clouds else { return };
    let colors = shown.displayed.display().colors().clone();
    component(ui, &mut window.settings.color, attribute, whole);
    map(ui, &mut window.settings.color, &colors);
    // While a large cloud is coloured anew, the colours are still those of before.
    if colors.attribute() != Some(attribute) {
        return;
    }
    match &colors {
        Colors::Ramp(shown) => ramp::show(window, ui, shown, whole),
        Colors::Categories(categories) => categories::show(window, ui, categories),
        Colors::File | Colors::Uniform(_) | Colors::Normal(_) => {}
    }
}

/// The choice of a component, where a column has several.
fn component(ui: &mut Ui, color: &mut ColorSource, attribute: &Attribute, clouds: &Clouds) {
    let Attribute::Column { name, component } = attribute else { return };
    let columns = clouds.loaded.iter().filter_map(|loaded| loaded.cloud.column(name));
    let n = columns.map(|column| column.components()).min().unwrap_or(1);
    if n < 2 {
        return;
    }
    row_of(ui, "component", "Which of the numbers of this column.", |ui, _label| {
        let shown = ui.horizontal_wrapped(|ui| {
            for i in 0..n.min(16) {
                let letter = ["x", "y", "z"].get(i as usize).filter(|_| n == 3);
                let label = letter.map_or_else(|| i.to_string(), |letter| (*letter).to_owned());
                if ui.selectable_label(*component == i, label).clicked() {
                    color.by = ColorBy::Attribute(attribute.clone().with_component(i));
                }
            }
        });
        shown.response
    });
}

/// The choice of a map; `shown` is what the colours are now.
fn map(ui: &mut Ui, color: &mut ColorSource, shown: &Colors) {
    let automatic = match shown {
        Colors::Ramp(ramp) => format!("auto: {}", ramp.map.name()),
        Colors::Categories(_) => "auto: categories".to_owned(),
        Colors::File | Colors::Uniform(_) | Colors::Normal(_) => "automatic".to_owned(),
    };
    let name = |choice: MapChoice| match choice {
        MapChoice::Automatic => automatic.clone(),
        choice => choice.name().to_owned(),
    };
    row_of(ui, "colour map", "How numbers become colours.", |ui, _label| {
        let combo = egui::ComboBox::from_id_salt("map").selected_text(name(color.map)).truncate();
        let shown = combo.show_ui(ui, |ui| {
            for choice in [MapChoice::Automatic].into_iter().chain(MapChoice::ALL) {
                let label = match choice {
                    MapChoice::Automatic => "automatic",
                    choice => choice.name(),
                };
                ui.selectable_value(&mut color.map, choice, label);
            }
        });
        shown
            .response
            .widget_info(|| egui::WidgetInfo::labeled(egui::Role::ComboBox, true, "colour map"));
        shown.response
    });
}
