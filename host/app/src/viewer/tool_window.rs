//! The menu of tools and the window of one: what it does, its parameters, the cloud, how far it is.

use super::dialogs::{self, Whose};
use super::parameters;
use super::shelf::Readiness;
use super::window::Window;
use crate::terminal::in_words;
use eframe::egui::{self, Context, Ui};
use surfelshop_api::UnitKind;
use surfelshop_engine::tools::Progress;

/// Title and summary of a tool, by the name the registry gives it.
fn described(window: &Window, name: &str) -> Option<(String, String)> {
    let unit = window.registry.find(UnitKind::Tool, name).ok()?;
    let mut units = window.registry.units(UnitKind::Tool);
    let found = units.find(|(_, manifest, u)| manifest.id == unit.package && u.id == unit.id);
    found.map(|(_, _, unit)| (unit.title.clone(), unit.summary.clone()))
}

/// The entries of the menu.
pub(crate) fn menu(window: &mut Window, ui: &mut Ui) {
    let names = window.registry.names(UnitKind::Tool);
    if names.is_empty() {
        ui.weak("no tool is installed");
    }
    for name in names {
        let Some((title, summary)) = described(window, &name) else { continue };
        if ui.button(format!("{title} …")).on_hover_text(summary).clicked() {
            window.tools.open = Some(name);
            ui.close();
        }
    }
}

/// The window of the tool that is open.
pub(crate) fn show(window: &mut Window, ctx: &Context) {
    let Some(name) = window.tools.open.clone() else { return };
    let (title, summary) =
        described(window, &name).unwrap_or_else(|| (name.clone(), "no longer installed".into()));
    let mut open = true;
    egui::Window::new(title)
        .id(egui::Id::unique("tool"))
        .open(&mut open)
        .default_width(360.0)
        .default_pos([380.0, 90.0])
        .show(ctx, |ui| {
            ui.label(summary);
            ui.separator();
            // Until the user has decided about a crash, no plugin's code runs.
            if window.crash.is_none() {
                form(window, ui, &name);
            }
        });
    if !open {
        window.tools.open = None;
    }
}

fn form(window: &mut Window, ui: &mut Ui, name: &str) {
    window.tools.shelf.prepare(ui.ctx(), &window.registry, name);
    let declared = match window.tools.shelf.readiness(name) {
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
    let at_work = window.tools.at_work().map(|(n, p, stops)| (n.to_owned(), p, stops));
    ui.add_enabled_ui(at_work.is_none(), |ui| {
        let values = window.tools.values.entry(name.to_owned()).or_default();
        if let Some(parameter) = parameters::show(ui, &declared, values) {
            let whose = Whose::Tool(name.to_owned());
            dialogs::value_dialog(window, ui.ctx(), whose, &parameter);
        }
        choose_cloud(window, ui);
    });
    match at_work {
        Some((other, progress, stops)) => {
            if other != name {
                ui.label(format!("{other} is at work"));
            }
            ui.horizontal(|ui| {
                let bar = egui::ProgressBar::new(progress.fraction as f32);
                let width = (ui.available_width() - 70.0).max(80.0);
                ui.add(bar.desired_width(width).text(in_line(&progress)));
                if ui.add_enabled(!stops, egui::Button::new("cancel")).clicked() {
                    window.tools.cancel();
                }
            });
        }
        None => {
            let Some(shown) = &window.shown else {
                ui.weak("open a cloud first");
                return;
            };
            if ui.button("run").clicked()
                && let Err(reason) = window.tools.run(&window.registry, &shown.stock, name)
            {
                window.messages.warn(reason);
            }
        }
    }
}

/// Which cloud the tool works on, where there are several.
fn choose_cloud(window: &mut Window, ui: &mut Ui) {
    let Some(shown) = &window.shown else { return };
    let items = shown.stock.items();
    let item = &mut window.tools.item;
    // A hidden cloud is worked on only where it is chosen.
    if items.get(*item).is_none_or(|item| !item.visible)
        && let Some(first) = items.iter().position(|item| item.visible)
    {
        *item = first;
    }
    if items.len() < 2 {
        return;
    }
    ui.horizontal(|ui| {
        let label = ui.label("cloud");
        let selected = items.get(*item).map(|item| item.name()).unwrap_or_default();
        let combo = egui::ComboBox::from_id_salt("tool cloud").selected_text(selected);
        let visible = items.iter().enumerate().filter(|(_, item)| item.visible);
        let response = combo.show_ui(ui, |ui| {
            for (i, cloud) in visible {
                ui.selectable_value(item, i, cloud.name());
            }
        });
        response.response.labelled_by(label.id);
    });
}

/// How far a tool is, in one line.
fn in_line(progress: &Progress) -> String {
    let mut line = format!("{:.0} %", 100.0 * progress.fraction);
    if !progress.message.is_empty() {
        line += &format!(": {}", progress.message);
    }
    if let Some(left) = progress.left {
        line += &format!(", {} left", in_words(left));
    }
    line
}
