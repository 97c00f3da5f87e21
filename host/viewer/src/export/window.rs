//! The export window: its form, a question before files are overwritten, and the progress.

use super::form::{ExportForm, ExportKind, RendererChoice};
use super::plan::{plan, size_of};
use super::run::{end, start};
use crate::dialogs::{DialogPurpose, files};
use crate::document::PaneSettings;
use crate::window::Window;
use eframe::egui::{self, Context, Ui};
use surfelshop_api::Camera;
use surfelshop_image::display_transform::Background;

/// Widest and highest pictures, pixels: what most devices can draw.
const MOST_PX: u32 = 16384;

/// Shows the window.
pub(crate) fn show(window: &mut Window, ctx: &Context) {
    let mut open = window.panels.export_form.open;
    let form_window = egui::Window::new("Save pictures").open(&mut open).resizable(false);
    let middle = ctx.content_rect().center();
    form_window.pivot(egui::Align2::CENTER_CENTER).default_pos(middle).show(ctx, |ui| {
        if let Some(job) = &window.panels.export_job {
            let text = format!("{} of {}", job.n_written, job.pictures.len());
            ui.add(egui::ProgressBar::new(job.fraction()).text(text));
            if ui.button("cancel").clicked() {
                let n = job.n_drawn;
                window.messages.report(format!("cancelled; {n} pictures are written"));
                end(window);
            }
        } else if window.panels.export_form.overwrite.is_some() {
            ask(window, ui);
        } else {
            form(window, ui);
        }
    });
    window.panels.export_form.open = open;
}

/// Asks whether files may be overwritten.
fn ask(window: &mut Window, ui: &mut Ui) {
    let Some((pictures, n_existing)) = &window.panels.export_form.overwrite else { return };
    ui.label(match (n_existing, pictures.as_slice()) {
        (1, [picture]) => format!("{} is there already.", picture.path.display()),
        (n, pictures) => format!("{n} of the {} files are there already.", pictures.len()),
    });
    ui.horizontal(|ui| {
        let (replace, keep) = (ui.button("replace").clicked(), ui.button("back").clicked());
        if replace || keep {
            let overwrite = window.panels.export_form.overwrite.take();
            if let Some((pictures, _)) = overwrite.filter(|_| replace) {
                start(window, pictures, ui.ctx());
            }
        }
    });
}

fn form(window: &mut Window, ui: &mut Ui) {
    let camera = window.camera_of(window.views.focused);
    let settings = window.settings.pane(window.views.focused).cloned();
    let has_legend = window.legend().is_some();
    let size = size_of(window);
    let remembered: Vec<Camera> = window.settings.bookmarks.iter().map(|one| one.camera).collect();
    let form = &mut window.panels.export_form;
    ui.horizontal(|ui| {
        ui.selectable_value(&mut form.kind, ExportKind::View, "this view");
        ui.selectable_value(&mut form.kind, ExportKind::Turntable, "a turn around");
        ui.selectable_value(&mut form.kind, ExportKind::Path, "a path of cameras");
    });
    if fields(ui, form, settings, (camera, size, &remembered)) {
        files::open(window, ui.ctx(), DialogPurpose::Pictures);
    }
    if window.settings.background != Background::Transparent {
        let transparent = &mut window.panels.export_form.transparent;
        ui.checkbox(transparent, "leave the background out of PNG files");
    }
    if has_legend {
        ui.checkbox(&mut window.panels.export_form.legend, "draw the legend into PNG files");
    }
    if window.settings.measures.iter().any(|measure| !measure.hidden) {
        let draws = &mut window.panels.export_form.measures;
        ui.checkbox(draws, "draw the measures into PNG files");
    }
    if ui.button("save").clicked() {
        match plan(window, camera) {
            Err(reason) => window.messages.warn(reason),
            Ok(pictures) => {
                let n_existing = pictures.iter().filter(|picture| picture.path.exists()).count();
                if n_existing > 0 {
                    window.panels.export_form.overwrite = Some((pictures, n_existing));
                } else {
                    start(window, pictures, ui.ctx());
                }
            }
        }
    }
}

/// The grid of the form; returns whether the file is to be chosen in a dialog.
fn fields(
    ui: &mut Ui,
    form: &mut ExportForm,
    settings: Option<PaneSettings>,
    (camera, size, remembered): (Camera, [u32; 2], &[Camera]),
) -> bool {
    let mut chooses_file = false;
    egui::Grid::new("export").num_columns(2).show(ui, |ui| {
        let label = ui.label("file (.png or .exr)");
        ui.horizontal(|ui| {
            let line = egui::TextEdit::singleline(&mut form.path).desired_width(320.0);
            ui.add(line).labelled_by(label.id);
            chooses_file = ui.button("choose …").clicked();
        });
        ui.end_row();
        match settings.filter(|settings| settings.mode.sides() == 2) {
            Some(PaneSettings { renderers: [first, second], .. }) => {
                ui.label("renderer");
                ui.horizontal(|ui| {
                    ui.selectable_value(&mut form.renderers, RendererChoice::First, first);
                    ui.selectable_value(&mut form.renderers, RendererChoice::Second, second);
                    ui.selectable_value(&mut form.renderers, RendererChoice::Both, "both");
                });
                ui.end_row();
            }
            None => form.renderers = RendererChoice::First,
        }
        size_row(ui, form, size);
        if form.kind != ExportKind::View {
            let label = ui.label("pictures");
            let number = egui::DragValue::new(&mut form.n_frames).range(2..=100_000);
            ui.add(number).labelled_by(label.id);
            ui.end_row();
        }
        if form.kind == ExportKind::Path {
            ui.label(format!("{} cameras", form.keys.len()));
            ui.horizontal(|ui| {
                if ui.button("add this one").clicked() {
                    form.keys.push(camera);
                }
                let all = egui::Button::new("the remembered ones");
                if ui.add_enabled(remembered.len() > 1, all).clicked() {
                    form.keys = remembered.to_vec();
                }
                if ui.button("forget all").clicked() {
                    form.keys.clear();
                }
            });
            ui.end_row();
        }
    });
    chooses_file
}

/// The row of the pictures' size, where a view has this one.
fn size_row(ui: &mut Ui, form: &mut ExportForm, view: [u32; 2]) {
    let label = ui.label("width x height, pixels");
    ui.horizontal(|ui| {
        if ui.checkbox(&mut form.as_view, "as the view").changed() && !form.as_view {
            form.resize(view);
        }
        if form.as_view {
            ui.weak(format!("{} x {}", view[0], view[1]));
        } else {
            for side in 0..2 {
                let value = egui::DragValue::new(&mut form.size[side]).range(1..=MOST_PX);
                let changed = ui.add(value).labelled_by(label.id).changed();
                if changed && form.keeps_proportions {
                    form.size = in_proportion(form.size, form.proportions, side);
                }
            }
            if ui.checkbox(&mut form.keeps_proportions, "keep proportions").changed() {
                form.resize(form.size);
            }
        }
        for factor in [2, 4] {
            let about = format!("As the view, {factor} times as wide and as high.");
            if ui.button(format!("{factor}x")).on_hover_text(about).clicked() {
                form.as_view = false;
                form.resize(view.map(|side| (side * factor).min(MOST_PX)));
            }
        }
    });
    ui.end_row();
}

/// A size of which one side was changed, with the other one in proportion: width by height.
fn in_proportion(mut size: [u32; 2], proportions: f64, changed: usize) -> [u32; 2] {
    let factor = if changed == 0 { 1.0 / proportions } else { proportions };
    let other = f64::from(size[changed]) * factor;
    size[1 - changed] = (other.round() as u32).clamp(1, MOST_PX);
    size
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn proportions_are_kept_within_what_pictures_may_be() {
        assert_eq!(in_proportion([1920, 900], 1280.0 / 900.0, 0), [1920, 1350]);
        assert_eq!(in_proportion([1280, 450], 1280.0 / 900.0, 1), [640, 450]);
        assert_eq!(in_proportion([MOST_PX, 900], 1.0 / 900.0, 0), [MOST_PX, MOST_PX]);
        // Typed digit by digit.
        let mut size = [1448, 1156];
        for width in [1, 10, 100, 1000] {
            size = in_proportion([width, size[1]], 1448.0 / 1156.0, 0);
        }
        assert_eq!(size, [1000, 798]);
    }
}
