//! Which version this is.

use crate::window::Window;
use eframe::egui::{self, Align2, Context};

/// Shows the window if it is open.
pub(super) fn show(window: &mut Window, ctx: &Context) {
    egui::Window::new("About Surfelshop")
        .open(&mut window.panels.about)
        .pivot(Align2::CENTER_CENTER)
        .default_pos(ctx.content_rect().center())
        .resizable(false)
        .show(ctx, |ui| {
            ui.heading(format!("Surfelshop {}", env!("CARGO_PKG_VERSION")));
            ui.label("A workbench for rendering point-sampled geometry.");
            let device = match (window.render.no_device, window.render.adapter.as_str()) {
                (true, _) => "no graphics device",
                (false, "") => "the graphics device is being opened",
                (false, adapter) => adapter,
            };
            ui.label(format!("Drawn by: {device}"));
            ui.weak("MIT or Apache 2.0. Icons: Lucide, ISC.");
        });
}
