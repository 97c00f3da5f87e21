//! The panel of what the pictures consist of, and what was left out.

use crate::window::Window;
use eframe::egui::{self, Ui};
use surfelshop_evaluate::explain::UseLine;
use surfelshop_evaluate::explain::sections;

/// Shows the panel: for each visible side the output of `explain`.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    let Some(pane) = window.views.panes.get(&window.views.focused) else { return };
    let n_sides = window.settings.pane(window.views.focused).map_or(1, |pane| pane.mode.sides());
    for (i, side) in pane.sides.iter().take(n_sides).enumerate() {
        let Some(shown) = &side.shown else { continue };
        let Some(explained) = &shown.rendered.explained else { continue };
        ui.strong(&shown.renderer);
        for (title, all) in sections(explained) {
            let (used, left_out): (Vec<_>, Vec<_>) = all.into_iter().partition(|part| part.used);
            let counts = match left_out.len() {
                0 => title.to_owned(),
                n if title == "adapter" => format!("{title}, {n} lacking"),
                n => format!("{title}, {n} left out"),
            };
            egui::CollapsingHeader::new(counts).id_salt((title, i)).show(ui, |ui| {
                for part in used.into_iter().chain(left_out) {
                    line(ui, &part);
                }
            });
        }
    }
}

fn line(ui: &mut Ui, part: &UseLine) {
    let UseLine { used, word, name, about } = part;
    let text = match (name.as_str(), about.as_str()) {
        ("", about) => about.to_owned(),
        (name, _) => format!("{word} {name}"),
    };
    let label = if *used { ui.label(text) } else { ui.weak(text) };
    if !about.is_empty() {
        label.on_hover_text(about);
    }
}
