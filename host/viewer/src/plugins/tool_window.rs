//! The menu of tools, and the window of a tool: its summary, parameters, cloud and progress.

use super::unit_loader::Readiness;
use crate::dialogs::{ParameterOwner, files};
use crate::panels::parameters;
use crate::theme::space;
use crate::views::hands::can_be_picked;
use crate::window::Window;
use eframe::egui::{self, Context, Ui};
use surfelshop_api::UnitKind;
use surfelshop_runtime::tools::Progress;
use surfelshop_session::output::terminal::in_words;

/// The title and summary of a tool, by its name in the registry.
pub(crate) fn title_and_summary(window: &Window, name: &str) -> Option<(String, String)> {
    let unit = window.plugins.registry.find(UnitKind::Tool, name).ok()?;
    let mut units = window.plugins.registry.units(UnitKind::Tool);
    let found = units.find(|(_, manifest, u)| manifest.id == unit.package && u.id == unit.id);
    found.map(|(_, _, unit)| (unit.title.clone(), unit.summary.clone()))
}

/// The entries of the menu: those that are led by hand below one of their own.
pub(crate) fn menu(window: &mut Window, ui: &mut Ui) {
    let names = window.plugins.registry.names(UnitKind::Tool);
    if names.is_empty() {
        ui.weak("no tool is installed");
    }
    let (by_hand, whole): (Vec<String>, Vec<String>) =
        names.into_iter().partition(|name| window.is_led_by_hand(name));
    if !by_hand.is_empty() {
        ui.menu_button("Interactive", |ui| entries(window, ui, &by_hand));
        ui.separator();
    }
    // There may be more than the window is high.
    let below = ui.ctx().content_rect().bottom() - ui.cursor().top();
    let height = (below - 3.0 * space::LARGE).max(120.0);
    egui::ScrollArea::vertical().max_height(height).show(ui, |ui| entries(window, ui, &whole));
}

fn entries(window: &mut Window, ui: &mut Ui, names: &[String]) {
    for name in names {
        let Some((title, summary)) = title_and_summary(window, name) else { continue };
        if ui.button(format!("{title} …")).on_hover_text(summary).clicked() {
            choose(window, name);
            ui.close();
        }
    }
}

/// Takes a tool that is led by hand into the hand, and opens the window of any other one.
pub(crate) fn choose(window: &mut Window, name: &str) {
    match window.is_led_by_hand(name) {
        true => window.take_tool(name.to_owned()),
        false => window.plugins.tools.open = Some(name.to_owned()),
    }
}

/// The window of the open tool.
pub(crate) fn show(window: &mut Window, ctx: &Context) {
    let Some(name) = window.plugins.tools.open.clone() else { return };
    if window.picks_pairs_for(&name) {
        // It would be in the way of clicks.
        return;
    }
    let (title, summary) = title_and_summary(window, &name)
        .unwrap_or_else(|| (name.clone(), "no longer installed".into()));
    let mut open = true;
    egui::Window::new(title)
        .id(egui::Id::unique("tool"))
        .open(&mut open)
        .default_width(380.0)
        .pivot(egui::Align2::CENTER_CENTER)
        .default_pos(ctx.content_rect().center())
        .show(ctx, |ui| {
            ui.label(summary);
            ui.separator();
            // After a crash no plugin runs until the user has decided.
            if window.plugins.crash.is_none() {
                form(window, ui, &name);
            }
        });
    if !open {
        window.plugins.tools.open = None;
    }
}

fn form(window: &mut Window, ui: &mut Ui, name: &str) {
    window.plugins.tools.units.prepare(ui.ctx(), &window.plugins.registry, name);
    let declared = match window.plugins.tools.units.readiness(name) {
        Readiness::Loading => {
            ui.horizontal(|ui| {
                ui.spinner();
                ui.label("loading");
            });
            return;
        }
        Readiness::Refused(reason) => {
            ui.colored_label(ui.visuals().error_fg_color, reason.to_owned());
            return;
        }
        Readiness::Ready(unit) => unit.description.params.clone(),
    };
    let running = window.plugins.tools.running().map(|(n, p, stops)| (n.to_owned(), p, stops));
    ui.add_enabled_ui(running.is_none(), |ui| {
        let values = window.plugins.tools.values.entry(name.to_owned()).or_default();
        match parameters::show_of_tool(ui, &declared, values) {
            Some(parameter) if can_be_picked(&parameter) => {
                window.pick_pairs(ui.ctx(), name, &parameter.id, &declared);
            }
            Some(parameter) => {
                let owner = ParameterOwner::Tool(name.to_owned());
                files::open_for_parameter(window, ui.ctx(), owner, &parameter);
            }
            None => {}
        }
        choose_cloud(window, ui);
    });
    match running {
        Some((other, progress, stops)) => {
            if other != name {
                ui.label(format!("{other} is at work"));
            }
            ui.horizontal(|ui| {
                let bar = egui::ProgressBar::new(progress.fraction as f32);
                let width = (ui.available_width() - 70.0).max(80.0);
                ui.add(bar.desired_width(width).show_percentage());
                if ui.add_enabled(!stops, egui::Button::new("cancel")).clicked() {
                    window.plugins.tools.cancel();
                }
            });
            let text = egui::RichText::new(describe(&progress)).weak();
            ui.add(egui::Label::new(text).wrap());
        }
        None => {
            let Some(shown) = window.document.complete_clouds() else {
                let why = match window.document.preview {
                    Some(_) => "files are still being read",
                    None => "open a cloud first",
                };
                ui.weak(why);
                return;
            };
            if ui.button("run").clicked()
                && let Err(reason) =
                    window.plugins.tools.run(&window.plugins.registry, &shown.open_clouds, name)
            {
                window.messages.warn(reason);
            }
        }
    }
}

/// The choice of the cloud, where there are several.
fn choose_cloud(window: &mut Window, ui: &mut Ui) {
    let Some(shown) = &window.document.clouds else { return };
    let all = shown.open_clouds.all();
    let index = &mut window.plugins.tools.cloud_index;
    // A hidden cloud is never the default.
    if all.get(*index).is_none_or(|open_cloud| !open_cloud.visible)
        && let Some(first) = all.iter().position(|open_cloud| open_cloud.visible)
    {
        *index = first;
    }
    if all.len() < 2 {
        return;
    }
    ui.horizontal(|ui| {
        let label = ui.label("cloud");
        let selected = all.get(*index).map(|open_cloud| open_cloud.name()).unwrap_or_default();
        let combo = egui::ComboBox::from_id_salt("tool cloud").selected_text(selected);
        let visible = all.iter().enumerate().filter(|(_, open_cloud)| open_cloud.visible);
        let response = combo.show_ui(ui, |ui| {
            for (i, cloud) in visible {
                ui.selectable_value(index, i, cloud.name());
            }
        });
        response.response.labelled_by(label.id);
    });
}

/// The progress of a tool in one line.
fn describe(progress: &Progress) -> String {
    let left = progress.left.map(|left| format!("{} left", in_words(left)));
    let parts = [(!progress.message.is_empty()).then(|| progress.message.clone()), left];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}
