//! The question about the plugin that was in use when the program crashed.

use crate::render_thread::RenderCommand;
use crate::window::Window;
use eframe::egui::{self, Context};
use surfelshop_api::UnitKind;

/// Offers to continue without the plugin.
pub(crate) fn show(window: &mut Window, ctx: &Context) {
    let Some(crash) = window.plugins.crash.clone() else { return };
    let modal = egui::Modal::new(egui::Id::unique("crash"));
    modal.show(ctx, |ui| {
        ui.heading("The program ended unexpectedly the last time");
        ui.label(format!(
            "{} was being tried, from {}. That may or may not be the cause.",
            crash.unit, crash.file
        ));
        ui.horizontal(|ui| {
            if ui.button("start without it").clicked() {
                let unit = crash.unit.rsplit('/').next().unwrap_or_default().to_owned();
                let is = |kind: UnitKind| crash.unit.starts_with(kind.word());
                match (is(UnitKind::Tool), is(UnitKind::Tracer)) {
                    (true, _) => window.plugins.tools.units.avoid(unit),
                    (_, true) => window.measure.units.avoid(unit),
                    _ => avoid(window, unit),
                }
                (window.plugins.crash, window.plugins.crash_mark) = (None, None);
            }
            if ui.button("use it all the same").clicked() {
                (window.plugins.crash, window.plugins.crash_mark) = (None, None);
            }
        });
    });
}

/// Replaces a renderer in all views.
fn avoid(window: &mut Window, renderer: String) {
    // By `flat`, the simplest one, where it is installed.
    let mut others = window.renderers();
    others.retain(|name| *name != renderer);
    let other = others.iter().find(|name| *name == "flat").or(others.first()).cloned();
    for pane in &mut window.settings.panes {
        for name in &mut pane.renderers {
            if *name == renderer
                && let Some(other) = &other
            {
                name.clone_from(other);
            }
        }
    }
    window.render.thread.add(RenderCommand::Avoid(renderer));
}
