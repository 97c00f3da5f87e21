//! Pictures written to files: the view at any size, a turn around the object, a path of cameras.

use super::darkroom::{Darkroom, Order, Place, Shot};
use super::detail::Detail;
use super::window::Window;
use crate::values::{Format, OutputFile};
use crate::{arguments::Bits, camera, exr_file, files, pictures};
use anyhow::Context as _;
use eframe::egui::{self, Context, Ui};
use glam::{DQuat, DVec3};
use std::path::{Path, PathBuf};
use surfelshop_api::graph::Output;
use surfelshop_api::{Camera, Projection, View};

/// The place that exported pictures are made for; no pane has it.
pub(crate) const PLACE: Place = Place { pane: u32::MAX, side: 0 };

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    View,
    Turntable,
    Path,
}

/// What the window for saving is set to.
pub(crate) struct ExportWindow {
    pub(crate) open: bool,
    kind: Kind,
    path: String,
    size: [u32; 2],
    n_frames: usize,
    /// Cameras of a path, in order.
    keys: Vec<Camera>,
}

impl Default for ExportWindow {
    fn default() -> Self {
        Self {
            open: false,
            kind: Kind::View,
            path: "surfelshop.png".to_owned(),
            size: [1920, 1080],
            n_frames: 120,
            keys: Vec::new(),
        }
    }
}

#[cfg(test)]
impl ExportWindow {
    /// Sets what is typed into the form.
    pub(super) fn aim(&mut self, path: &str, size: [u32; 2], n_frames: usize) {
        path.clone_into(&mut self.path);
        (self.size, self.n_frames) = (size, n_frames);
    }
}

/// Pictures being made.
pub(crate) struct Export {
    order: Order,
    /// One for each picture, with the file it goes to.
    frames: Vec<(View, PathBuf)>,
    format: Format,
    next: usize,
    /// Number of the order that is being made.
    serial: u64,
}

impl Export {
    /// Orders the next picture, with a number that no other order has.
    fn order_next(&mut self, darkroom: &Darkroom, serial: u64) {
        self.serial = serial;
        if let Some((view, _)) = self.frames.get(self.next) {
            darkroom.order(PLACE, Order { view: *view, serial, ..self.order.clone() });
        }
    }

    fn fraction(&self) -> f32 {
        self.next as f32 / self.frames.len().max(1) as f32
    }
}

/// Takes a picture that was made for a file; says what happened in one line once all are written
/// or one failed.
///
/// A picture of an export that was cancelled comes late and is let go.
pub(crate) fn take(window: &mut Window, serial: u64, outcome: Result<Shot, String>) {
    let Some(export) = window.export.as_mut().filter(|export| export.serial == serial) else {
        return;
    };
    let Some((_, path)) = export.frames.get(export.next) else { return };
    let written = outcome
        .map_err(|reason| anyhow::anyhow!("{}: {reason}", path.display()))
        .and_then(|shot| write(path, export.format, shot));
    if let Err(error) = written {
        window.message = Some(format!("{error:#}"));
        window.export = None;
        return;
    }
    export.next += 1;
    if export.next < export.frames.len() {
        let serial = window.next_serial();
        if let Some(export) = &mut window.export {
            export.order_next(&window.darkroom, serial);
        }
        return;
    }
    let (n_files, last) = (export.frames.len(), path.display().to_string());
    window.message = Some(match n_files {
        1 => format!("wrote {last}"),
        n => format!("wrote {n} pictures, the last is {last}"),
    });
    window.export = None;
}

fn write(path: &Path, format: Format, shot: Shot) -> anyhow::Result<()> {
    let bytes = match format {
        Format::Png => pictures::png(&shot.visible(), Bits::Eight),
        Format::Exr => {
            let depth = shot.depth.map(|depth| (Output::Depth, depth));
            let layers: Vec<_> = [(Output::Color, shot.color)].into_iter().chain(depth).collect();
            exr_file::exr(&layers.iter().collect::<Vec<_>>())
        }
    };
    let bytes = bytes.with_context(|| format!("{}: cannot be encoded", path.display()))?;
    files::write_whole(path, &bytes)
}

/// The window for saving, and how far it is.
pub(crate) fn show(window: &mut Window, ctx: &Context) {
    let mut open = window.export_window.open;
    egui::Window::new("Save pictures").open(&mut open).resizable(false).show(ctx, |ui| {
        if let Some(export) = &window.export {
            let text = format!("{} of {}", export.next, export.frames.len());
            ui.add(egui::ProgressBar::new(export.fraction()).text(text));
            if ui.button("cancel").clicked() {
                let text = format!("cancelled; {} pictures are written", export.next);
                window.message = Some(text);
                window.export = None;
            }
            return;
        }
        form(window, ui);
    });
    window.export_window.open = open;
}

fn form(window: &mut Window, ui: &mut Ui) {
    let camera = window.camera_of(window.focused);
    let state = &mut window.export_window;
    ui.horizontal(|ui| {
        ui.selectable_value(&mut state.kind, Kind::View, "this view");
        ui.selectable_value(&mut state.kind, Kind::Turntable, "a turn around");
        ui.selectable_value(&mut state.kind, Kind::Path, "a path of cameras");
    });
    egui::Grid::new("export").num_columns(2).show(ui, |ui| {
        let label = ui.label("file (.png or .exr)");
        ui.text_edit_singleline(&mut state.path).labelled_by(label.id);
        ui.end_row();
        let label = ui.label("width x height, pixels");
        ui.horizontal(|ui| {
            for side in &mut state.size {
                ui.add(egui::DragValue::new(side).range(1..=16384)).labelled_by(label.id);
            }
        });
        ui.end_row();
        if state.kind != Kind::View {
            let label = ui.label("pictures");
            let number = egui::DragValue::new(&mut state.n_frames).range(2..=100_000);
            ui.add(number).labelled_by(label.id);
            ui.end_row();
        }
        if state.kind == Kind::Path {
            ui.label(format!("{} cameras", state.keys.len()));
            ui.horizontal(|ui| {
                if ui.button("add this one").clicked() {
                    state.keys.push(camera);
                }
                if ui.button("forget all").clicked() {
                    state.keys.clear();
                }
            });
            ui.end_row();
        }
    });
    if ui.button("save").clicked() {
        start(window, camera);
    }
}

fn start(window: &mut Window, camera: Camera) {
    let state = &window.export_window;
    let OutputFile { path, format } = match OutputFile::parse(state.path.trim()) {
        Ok(file) => file,
        Err(reason) => {
            window.message = Some(format!("`{}`: {reason}", state.path));
            return;
        }
    };
    let cameras = match state.kind {
        Kind::View => vec![camera],
        Kind::Turntable => turntable(camera, state.n_frames),
        Kind::Path if state.keys.len() < 2 => {
            window.message = Some("a path needs two cameras or more".to_owned());
            return;
        }
        Kind::Path => path_of(&state.keys, state.n_frames),
    };
    let Some(shown) = &window.shown else {
        window.message = Some("there is nothing to draw yet".to_owned());
        return;
    };
    let Some(settings) = window.settings.pane(window.focused) else { return };
    let size = state.size;
    let n = cameras.len();
    let frames: Vec<(View, PathBuf)> = cameras
        .into_iter()
        .enumerate()
        .map(|(i, camera)| {
            let file = if n == 1 { path.clone() } else { numbered(&path, i + 1) };
            (camera::framed_view(camera, &shown.extent, size), file)
        })
        .collect();
    let order = Order {
        renderer: settings.renderers[0].clone(),
        values: settings.values_of(0),
        clouds: shown.clouds.clone(),
        scene: window.settings.scene.clone(),
        development: window.settings.development(),
        view: frames[0].0,
        detail: Detail::FULL,
        serial: 0,
    };
    let mut export = Export { order, frames, format, next: 0, serial: 0 };
    let serial = window.next_serial();
    export.order_next(&window.darkroom, serial);
    window.export = Some(export);
}

/// `pictures/snail.png` with 7 becomes `pictures/snail-0007.png`.
fn numbered(path: &Path, number: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}-{number:04}.{ending}"))
}

/// Cameras evenly around the target; the last one stands a step before the first.
fn turntable(camera: Camera, n_frames: usize) -> Vec<Camera> {
    let up = camera.up.normalize_or(DVec3::Y);
    let turned = |i: usize| {
        let turn = DQuat::from_axis_angle(up, std::f64::consts::TAU * i as f64 / n_frames as f64);
        Camera { eye: camera.target + turn * (camera.eye - camera.target), ..camera }
    };
    (0..n_frames).map(turned).collect()
}

/// Cameras along a smooth curve through the given ones, which are reached at equal intervals.
///
/// Source: Catmull & Rom 1974, the uniform spline; ends are repeated.
fn path_of(keys: &[Camera], n_frames: usize) -> Vec<Camera> {
    let n_parts = keys.len() - 1;
    let at = |i: isize| &keys[i.clamp(0, n_parts as isize) as usize];
    let frame = |i: usize| {
        let place = n_parts as f64 * i as f64 / (n_frames - 1) as f64;
        let part = (place.floor() as usize).min(n_parts - 1);
        let t = place - part as f64;
        let key = |k: isize| at(part as isize + k);
        let spline = |value: fn(&Camera) -> DVec3| {
            let [a, b, c, d] = [-1, 0, 1, 2].map(|k| value(key(k)));
            let (t2, t3) = (t * t, t * t * t);
            0.5 * (2.0 * b
                + (c - a) * t
                + (2.0 * a - 5.0 * b + 4.0 * c - d) * t2
                + (3.0 * b - a - 3.0 * c + d) * t3)
        };
        let mix = |a: f64, b: f64| a + (b - a) * t;
        let projection = match (key(0).projection, key(1).projection) {
            (Projection::Perspective { fov_y: a }, Projection::Perspective { fov_y: b }) => {
                Projection::Perspective { fov_y: mix(a, b) }
            }
            (Projection::Orthographic { height: a }, Projection::Orthographic { height: b }) => {
                Projection::Orthographic { height: mix(a, b) }
            }
            (kept, _) => kept,
        };
        Camera {
            eye: spline(|camera| camera.eye),
            target: spline(|camera| camera.target),
            up: spline(|camera| camera.up),
            projection,
        }
    };
    (0..n_frames).map(frame).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(eye: DVec3) -> Camera {
        let projection = Projection::Perspective { fov_y: 0.6 };
        Camera { eye, target: DVec3::new(1.0, 0.0, 0.0), up: DVec3::Y, projection }
    }

    #[test]
    fn a_turn_goes_once_around_and_keeps_its_distance() {
        let around = turntable(camera(DVec3::new(1.0, 2.0, 4.0)), 8);
        assert_eq!(around.len(), 8);
        for pair in around.windows(2) {
            let step = pair[0].eye.distance(pair[1].eye);
            assert!((step - 8.0 * (std::f64::consts::PI / 8.0).sin()).abs() < 1e-9);
            assert!((pair[0].eye.distance(pair[0].target) - 20f64.sqrt()).abs() < 1e-9);
        }
        let half = around[4].eye;
        assert!((half - DVec3::new(1.0, 2.0, -4.0)).length() < 1e-9, "{half}");
    }

    #[test]
    fn a_path_passes_its_cameras_at_equal_intervals() {
        let keys = [DVec3::Z, DVec3::X * 3.0, DVec3::new(2.0, 5.0, 1.0)].map(camera);
        let path = path_of(&keys, 21);
        for (frame, key) in [(0, 0), (10, 1), (20, 2)] {
            assert!((path[frame].eye - keys[key].eye).length() < 1e-12);
        }
        let longest = path.windows(2).map(|pair| pair[0].eye.distance(pair[1].eye));
        assert!(longest.fold(0.0, f64::max) < 1.0);
    }

    #[test]
    fn numbers_stand_before_the_ending() {
        let path = numbered(Path::new("pictures/snail.exr"), 7);
        assert_eq!(path, Path::new("pictures/snail-0007.exr"));
    }
}
