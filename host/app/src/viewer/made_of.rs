//! What the shown picture is made of, and what was left out of it.

use super::window::Window;
use crate::explain::{Told, sections};
use eframe::egui::{self, Ui};

/// The panel: of each side that is shown, what `explain` says of it.
pub(crate) fn show(window: &mut Window, ui: &mut Ui) {
    let Some(pane) = window.panes.get(&window.focused) else { return };
    let n_sides = window.settings.pane(window.focused).map_or(1, |pane| pane.mode.sides());
    for (i, side) in pane.sides.iter().take(n_sides).enumerate() {
        let Some(shown) = &side.shown else { continue };
        let Some(explained) = &shown.shot.explained else { continue };
        ui.strong(&shown.renderer);
        for (title, all) in sections(explained) {
            let (used, left_out): (Vec<_>, Vec<_>) = all.into_iter().partition(|told| told.used);
            let counts = match left_out.len() {
                0 => title.to_owned(),
                n if title == "adapter" => format!("{title}, {n} lacking"),
                n => format!("{title}, {n} left out"),
            };
            egui::CollapsingHeader::new(counts).id_salt((title, i)).show(ui, |ui| {
                for told in used.into_iter().chain(left_out) {
                    line(ui, &told);
                }
            });
        }
    }
}

fn line(ui: &mut Ui, told: &Told) {
    let Told { used, word, name, about } = told;
    let text = match (name.as_str(), about.as_str()) {
        ("", about) => about.to_owned(),
        (name, _) => format!("{word} {name}"),
    };
    let label = if *used { ui.label(text) } else { ui.weak(text) };
    if !about.is_empty() {
        label.on_hover_text(about);
    }
}
