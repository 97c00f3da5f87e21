//! What is being opened, over the pictures: from the first frame on, with its time and a way to stop it.

use crate::theme::space;
use crate::window::Window;
use eframe::egui::{Align2, Area, Context, Frame, Id, ProgressBar, Rect, vec2};
use std::time::Duration;

const WIDTH: f32 = 380.0;

/// Shows what is being read over `pictures`: in the middle where nothing else is there, else at the upper edge.
pub(crate) fn show(window: &Window, ctx: &Context, pictures: Rect) {
    let Some(loader) = &window.document.loader else { return };
    let is_empty = window.document.clouds.is_none();
    let (pivot, place) = match is_empty {
        true => (Align2::CENTER_CENTER, pictures.center()),
        false => (Align2::CENTER_TOP, pictures.center_top() + vec2(0.0, 44.0)),
    };
    let files: Vec<_> = loader.files.iter().map(|file| file.file_name()).collect();
    let names: Vec<_> = files.iter().flatten().map(|name| name.to_string_lossy()).collect();
    let names = match names.len() {
        0..=2 => names.join(" and "),
        n => format!("{n} files"),
    };
    let seconds = loader.elapsed().as_secs_f32();
    Area::new(Id::unique("reading")).pivot(pivot).fixed_pos(place).show(ctx, |ui| {
        Frame::window(ui.style()).show(ui, |ui| {
            ui.set_width(WIDTH.min(pictures.width() - 4.0 * space::LARGE).max(160.0));
            let verb = if loader.adds { "Adding" } else { "Reading" };
            ui.strong(format!("{verb} {names}"));
            let bar = ProgressBar::new(loader.fraction()).desired_height(8.0);
            ui.add(bar);
            ui.horizontal(|ui| {
                let percent = 100.0 * loader.fraction();
                let shows = match window.document.preview.is_some() {
                    true => "; some of the points are shown",
                    false => "",
                };
                ui.weak(format!("{percent:.0} %, {seconds:.0} s{shows}"));
                ui.with_layout(
                    eframe::egui::Layout::right_to_left(eframe::egui::Align::Min),
                    |ui| {
                        if ui
                            .button("cancel")
                            .on_hover_text("Goes back to what was open.")
                            .clicked()
                        {
                            loader.cancel();
                        }
                    },
                );
            });
        });
    });
    // The seconds go on where the fraction does not.
    ctx.request_repaint_after(Duration::from_millis(500));
}
