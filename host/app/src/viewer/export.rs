//! Pictures written to files: the view at any size, a turn around the object, a path of cameras.
//!
//! The engine's thread makes them one after another; another thread encodes and writes those that
//! are made, so that the window never waits.

use super::darkroom::{Order, Place, Shot};
use super::detail::Detail;
use super::dialogs;
use super::film;
use super::settings::PaneSettings;
use super::window::Window;
use crate::values::{Format, OutputFile};
use crate::{arguments::Bits, camera, exr_file, files, pictures};
use anyhow::Context as _;
use eframe::egui::{self, Context, Ui};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use surfelshop_api::Camera;
use surfelshop_api::graph::Output;

/// The place that exported pictures are made for; no pane has it.
pub(crate) const PLACE: Place = Place { pane: u32::MAX, side: 0 };

/// Pictures that may be made before those ordered first are written: a slow disk must not fill the
/// memory.
const MOST_AHEAD: usize = 3;

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    View,
    Turntable,
    Path,
}

/// Of which of the two renderers of the focused view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sides {
    First,
    Second,
    Both,
}

impl Sides {
    fn indices(self) -> &'static [usize] {
        match self {
            Self::First => &[0],
            Self::Second => &[1],
            Self::Both => &[0, 1],
        }
    }
}

/// What the window for saving is set to.
pub(crate) struct ExportWindow {
    pub(crate) open: bool,
    kind: Kind,
    sides: Sides,
    pub(crate) path: String,
    size: [u32; 2],
    n_frames: usize,
    /// Cameras of a path, in order.
    keys: Vec<Camera>,
    /// Pictures that would take the place of files, until the user has decided.
    in_question: Option<(Vec<Picture>, usize)>,
}

impl Default for ExportWindow {
    fn default() -> Self {
        Self {
            open: false,
            kind: Kind::View,
            sides: Sides::First,
            path: "surfelshop.png".to_owned(),
            size: [1920, 1080],
            n_frames: 120,
            keys: Vec::new(),
            in_question: None,
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

/// One picture to be made, and the file it goes to.
#[derive(Clone)]
struct Picture {
    order: Order,
    path: PathBuf,
    format: Format,
}

/// Pictures being made and written.
pub(crate) struct Export {
    pictures: Vec<Picture>,
    n_ordered: usize,
    n_made: usize,
    n_written: usize,
    /// Number of the order that is being made, if one is.
    making: Option<u64>,
    made: Sender<(Picture, Shot)>,
    written: Receiver<anyhow::Result<()>>,
}

impl Export {
    fn start(pictures: Vec<Picture>, ctx: &Context) -> std::io::Result<Self> {
        let (made, to_write) = channel::<(Picture, Shot)>();
        let (tell, written) = channel();
        let ctx = ctx.clone();
        std::thread::Builder::new().name("pictures".to_owned()).spawn(move || {
            // Ends when the export is over or cancelled; what is at hand is written first.
            for (picture, shot) in to_write {
                drop(tell.send(write(&picture, shot)));
                ctx.request_repaint();
            }
        })?;
        let (n_ordered, n_made, n_written) = (0, 0, 0);
        Ok(Self { pictures, n_ordered, n_made, n_written, making: None, made, written })
    }

    fn fraction(&self) -> f32 {
        self.n_written as f32 / self.pictures.len().max(1) as f32
    }
}

/// Takes a picture that was made for a file. One of an export that was cancelled comes late and is
/// let go.
pub(crate) fn take(window: &mut Window, serial: u64, outcome: Result<Shot, String>) {
    let Some(export) = window.export.as_mut().filter(|e| e.making == Some(serial)) else { return };
    export.making = None;
    let Some(picture) = export.pictures.get(export.n_made) else { return };
    match outcome {
        Ok(shot) => {
            // The other end is there for as long as the export is.
            drop(export.made.send((picture.clone(), shot)));
            export.n_made += 1;
        }
        Err(reason) => {
            let (n, path) = (export.n_made, picture.path.display());
            window.messages.warn(format!("{path}: {reason}; {n} pictures were made"));
            end(window);
        }
    }
}

/// Ends it, and lets go of the renderer.
fn end(window: &mut Window) {
    window.export = None;
    window.darkroom.let_go(PLACE);
}

/// Orders the next picture, and says what happened once all are written or one failed.
pub(crate) fn go_on(window: &mut Window) {
    let Some(export) = &mut window.export else { return };
    for result in export.written.try_iter().collect::<Vec<_>>() {
        if let Err(error) = result {
            let n = export.n_written;
            window.messages.warn(format!("{error:#}; {n} pictures are written"));
            end(window);
            return;
        }
        export.n_written += 1;
    }
    if export.n_written == export.pictures.len() {
        let last = export.pictures.last().map(|picture| picture.path.display().to_string());
        let last = last.unwrap_or_default();
        window.messages.tell(match export.n_written {
            1 => format!("wrote {last}"),
            n => format!("wrote {n} pictures, the last is {last}"),
        });
        end(window);
        return;
    }
    let ahead = export.n_ordered - export.n_written;
    if export.making.is_none()
        && ahead < MOST_AHEAD
        && let Some(picture) = export.pictures.get(export.n_ordered)
    {
        let order = picture.order.clone();
        export.n_ordered += 1;
        let serial = window.next_serial();
        window.darkroom.order(PLACE, Order { serial, ..order });
        if let Some(export) = &mut window.export {
            export.making = Some(serial);
        }
    }
}

fn write(picture: &Picture, shot: Shot) -> anyhow::Result<()> {
    let path = &picture.path;
    let bytes = match picture.format {
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
    let form_window = egui::Window::new("Save pictures").open(&mut open).resizable(false);
    form_window.default_pos([380.0, 90.0]).show(ctx, |ui| {
        if let Some(export) = &window.export {
            let text = format!("{} of {}", export.n_written, export.pictures.len());
            ui.add(egui::ProgressBar::new(export.fraction()).text(text));
            if ui.button("cancel").clicked() {
                let n = export.n_made;
                window.messages.tell(format!("cancelled; {n} pictures are written"));
                end(window);
            }
        } else if window.export_window.in_question.is_some() {
            ask(window, ui);
        } else {
            form(window, ui);
        }
    });
    window.export_window.open = open;
}

/// Asks whether files may be replaced.
fn ask(window: &mut Window, ui: &mut Ui) {
    let Some((pictures, n_there)) = &window.export_window.in_question else { return };
    ui.label(match (n_there, pictures.as_slice()) {
        (1, [picture]) => format!("{} is there already.", picture.path.display()),
        (n, pictures) => format!("{n} of the {} files are there already.", pictures.len()),
    });
    ui.horizontal(|ui| {
        let (replace, keep) = (ui.button("replace").clicked(), ui.button("back").clicked());
        if replace || keep {
            let asked = window.export_window.in_question.take();
            if let Some((pictures, _)) = asked.filter(|_| replace) {
                begin(window, pictures, ui.ctx());
            }
        }
    });
}

fn form(window: &mut Window, ui: &mut Ui) {
    let camera = window.camera_of(window.focused);
    let settings = window.settings.pane(window.focused).cloned();
    let state = &mut window.export_window;
    ui.horizontal(|ui| {
        ui.selectable_value(&mut state.kind, Kind::View, "this view");
        ui.selectable_value(&mut state.kind, Kind::Turntable, "a turn around");
        ui.selectable_value(&mut state.kind, Kind::Path, "a path of cameras");
    });
    let mut choose = false;
    egui::Grid::new("export").num_columns(2).show(ui, |ui| {
        let label = ui.label("file (.png or .exr)");
        ui.horizontal(|ui| {
            ui.text_edit_singleline(&mut state.path).labelled_by(label.id);
            choose = ui.button("choose …").clicked();
        });
        ui.end_row();
        match settings.filter(|settings| settings.mode.sides() == 2) {
            Some(PaneSettings { renderers: [first, second], .. }) => {
                ui.label("renderer");
                ui.horizontal(|ui| {
                    ui.selectable_value(&mut state.sides, Sides::First, first);
                    ui.selectable_value(&mut state.sides, Sides::Second, second);
                    ui.selectable_value(&mut state.sides, Sides::Both, "both");
                });
                ui.end_row();
            }
            None => state.sides = Sides::First,
        }
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
    if choose {
        dialogs::dialog(window, ui.ctx(), dialogs::Asked::Pictures);
    }
    if ui.button("save").clicked() {
        match planned(window, camera) {
            Err(reason) => window.messages.warn(reason),
            Ok(pictures) => {
                let n_there = pictures.iter().filter(|picture| picture.path.exists()).count();
                if n_there > 0 {
                    window.export_window.in_question = Some((pictures, n_there));
                } else {
                    begin(window, pictures, ui.ctx());
                }
            }
        }
    }
}

/// The pictures that the form asks for.
fn planned(window: &Window, camera: Camera) -> Result<Vec<Picture>, String> {
    let state = &window.export_window;
    let file = OutputFile::parse(state.path.trim());
    let OutputFile { path, format } =
        file.map_err(|reason| format!("`{}`: {reason}", state.path))?;
    files::check_folder(&path).map_err(|error| format!("{error:#}"))?;
    // Relative to where the program was started, which a message must not leave open.
    let path = std::path::absolute(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let cameras = match state.kind {
        Kind::View => vec![camera],
        Kind::Turntable => film::turntable(camera, state.n_frames),
        Kind::Path if state.keys.len() < 2 => {
            return Err("a path needs two cameras or more".to_owned());
        }
        Kind::Path => film::path_of(&state.keys, state.n_frames),
    };
    let shown = window.shown.as_ref().ok_or("there is nothing to draw yet")?;
    let settings = window.settings.pane(window.focused).ok_or("no view is chosen")?;
    let sides = state.sides.indices();
    let order = |side: usize, camera: Camera| Order {
        renderer: settings.renderers[side].clone(),
        values: settings.values_of(side),
        clouds: shown.clouds.clone(),
        scene: window.settings.scene.clone(),
        environment: window.settings.environment.clone(),
        development: window.settings.development(),
        view: camera::framed_view(camera, &shown.extent, state.size),
        detail: Detail::FULL,
        moves: false,
        is_measured: false,
        serial: 0,
    };
    let mut pictures = Vec::new();
    // One renderer after the other: each keeps what it has made ready.
    for &side in sides {
        let mut own = path.clone();
        if sides.len() > 1 {
            own = with_suffix(&own, &format!("{}-{}", side + 1, settings.renderers[side]));
        }
        for (i, &camera) in cameras.iter().enumerate() {
            let path = match cameras.len() {
                1 => own.clone(),
                _ => with_suffix(&own, &format!("{:04}", i + 1)),
            };
            pictures.push(Picture { order: order(side, camera), path, format });
        }
    }
    Ok(pictures)
}

fn begin(window: &mut Window, pictures: Vec<Picture>, ctx: &Context) {
    match Export::start(pictures, ctx) {
        Ok(export) => window.export = Some(export),
        Err(error) => window.messages.warn(format!("no picture can be written: {error}")),
    }
}

/// `pictures/snail.png` with `0007` becomes `pictures/snail-0007.png`.
fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    // A renderer's full name has a slash.
    path.with_file_name(format!("{stem}-{}.{ending}", suffix.replace('/', "-")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suffixes_stand_before_the_ending() {
        let path = with_suffix(Path::new("pictures/snail.exr"), "0007");
        assert_eq!(path, Path::new("pictures/snail-0007.exr"));
        let path = with_suffix(Path::new("snail.exr"), "1-org.example/flat");
        assert_eq!(path, Path::new("snail-1-org.example-flat.exr"));
    }
}
