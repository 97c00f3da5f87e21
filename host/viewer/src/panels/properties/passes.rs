//! The panel of the passes of the focused view, with their times.

use crate::window::Window;
use eframe::egui::{self, Ui};
use surfelshop_render::PassState;

/// Shows the panel.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    let Some(pane) = window.views.panes.get(&window.views.focused) else { return };
    let n_sides = window.settings.pane(window.views.focused).map_or(1, |pane| pane.mode.sides());
    for (i, side) in pane.sides.iter().take(n_sides).enumerate() {
        let Some(shown) = &side.shown else { continue };
        let (ms, n_frames) = side.timings.whole().unwrap_or((shown.rendered.milliseconds, 1));
        let refined = match shown.rendered.n_frames {
            1 => String::new(),
            n => format!(", {n} frames"),
        };
        ui.strong(format!("{}: {ms:.1} ms{refined}", shown.renderer)).on_hover_text(format!(
            "from order to picture, of one frame: medians of the last {n_frames} shown in this detail"
        ));
        egui::Grid::new(("passes", i)).num_columns(2).striped(true).show(ui, |ui| {
            for pass in &shown.rendered.passes {
                ui.label(&pass.name);
                match (pass.state, side.timings.pass(&pass.name)) {
                    (PassState::Ran, Some(ms)) => ui.label(format!("{ms:.2} ms")),
                    (PassState::Ran, None) => ui.label("ran"),
                    (PassState::Culled, _) => ui.weak("left out: nobody reads it"),
                    (PassState::Reused, _) => ui.weak("kept from before"),
                };
                ui.end_row();
            }
        });
    }
    ui.weak(format!(
        "on the device: {:.1} MB of columns, those shown lately included; {} uploads, {} pipelines made",
        window.render.counters.column_bytes as f64 * 1e-6,
        window.render.counters.uploads,
        window.render.counters.compiled.pipelines
    ));
}
