//! File dialogs: the system's, which it shows on threads of their own, or where it has none, the program's.

use super::file_dialog::{FileDialog, Outcome, Purpose, Request};
use super::window::Window;
use super::{portal, surroundings};
use eframe::egui::{Context, Ui};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use surfelshop_api::params::{ParamDecl, ParamKind, Value};

/// What a file dialog is for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Asked {
    /// Clouds or a scene to look at.
    Open,
    /// A scene to write.
    SaveScene,
    /// One of the clouds to write.
    SaveCloud(usize),
    /// Pictures to write.
    Pictures,
    /// A light probe.
    Probe,
    /// A picture to measure against.
    Reference,
    /// The file of a parameter.
    Value { whose: Whose, id: String, endings: Vec<String> },
}

/// Whose parameter a file is for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Whose {
    /// A renderer's in a view.
    Renderer { pane: u32, renderer: String },
    /// A tool's.
    Tool(String),
    /// That of a tracer that is measured against.
    Tracer(String),
}

/// Asks for the file of a parameter.
pub(crate) fn value_dialog(
    window: &mut Window,
    ctx: &Context,
    whose: Whose,
    parameter: &ParamDecl,
) {
    let ParamKind::File { endings } = &parameter.kind else { return };
    let (id, endings) = (parameter.id.clone(), endings.clone());
    dialog(window, ctx, Asked::Value { whose, id, endings });
}

/// Sets a parameter to a path.
fn put_value(window: &mut Window, whose: &Whose, id: &str, path: &Path) {
    let values = match whose {
        Whose::Renderer { pane, renderer } => {
            let pane = window.settings.pane_mut(*pane);
            pane.map(|pane| pane.values.entry(renderer.clone()).or_default())
        }
        Whose::Tool(tool) => Some(window.tools.values.entry(tool.clone()).or_default()),
        Whose::Tracer(tracer) => {
            Some(window.measure.form.tracer_values.entry(tracer.clone()).or_default())
        }
    };
    if let Some(values) = values {
        values.insert(id.to_owned(), Value::Text(path.display().to_string()));
    }
}

/// What the system says to a question for files.
enum Answer {
    /// The files; none where the user cancelled.
    Files(Vec<PathBuf>),
    /// It has no dialogs, and why.
    NoDialogs(String),
}

/// A dialog that is open.
enum Open {
    System(Receiver<Answer>),
    Own(Box<FileDialog>),
}

/// The dialog that is open, and where dialogs come from.
pub(crate) struct Dialogs {
    open: Option<(Asked, Open)>,
    /// Whether the system lends dialogs, and else why not.
    pub(crate) lends: fn() -> Result<(), String>,
    /// Whether it was told that it does not.
    told: bool,
}

impl Default for Dialogs {
    fn default() -> Self {
        Self { open: None, lends: portal::lends_dialogs, told: false }
    }
}

impl Dialogs {
    /// Whether one is open.
    pub(crate) fn are_open(&self) -> bool {
        self.open.is_some()
    }

    /// Whether one of the program's own is open, which has the keyboard.
    pub(crate) fn own_is_open(&self) -> bool {
        matches!(self.open, Some((_, Open::Own(_))))
    }
}

/// The name that a file is given in the end: under another one it could not be opened again.
fn scene_name(path: &Path) -> PathBuf {
    match surfelshop_cloud::scene::is_scene(path) {
        true => path.to_owned(),
        false => path.with_added_extension("scene.toml"),
    }
}

pub(crate) fn cloud_name(path: &Path) -> PathBuf {
    let is_ply = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("ply"));
    if is_ply { path.to_owned() } else { path.with_added_extension("ply") }
}

/// What a dialog asks for.
fn request(window: &Window, asked: &Asked) -> Request {
    let endings = |endings: &[&str]| endings.iter().map(|ending| (*ending).to_owned()).collect();
    let request = |title: &str, filter: &str, of: &[&str], purpose: Purpose| Request {
        title: title.to_owned(),
        filter: filter.to_owned(),
        endings: endings(of),
        purpose,
    };
    let save = |name: &str, completed: fn(&Path) -> PathBuf| Purpose::Save {
        name: name.to_owned(),
        completed,
    };
    match asked {
        Asked::Open => {
            let known = ["ply", "obj", "off", "toml", "hdr", "exr"];
            request("Open clouds or a scene", "clouds and scenes", &known, Purpose::OpenSeveral)
        }
        Asked::SaveScene => {
            let purpose = save("surfelshop.scene.toml", scene_name);
            request("Save the scene", "scenes", &["toml"], purpose)
        }
        Asked::SaveCloud(item) => {
            let name = suggested_name(window, *item);
            request("Save the cloud", "clouds", &["ply"], save(&name, cloud_name))
        }
        Asked::Pictures => {
            let purpose = save("surfelshop.png", Path::to_owned);
            request("Save pictures", "pictures", &["png", "exr"], purpose)
        }
        Asked::Probe => {
            request("Open a light probe", "light probes", &["hdr", "exr"], Purpose::Open)
        }
        Asked::Reference => {
            let (title, filter) =
                ("Choose a picture to measure against", "pictures of linear radiance");
            request(title, filter, &["exr"], Purpose::Open)
        }
        Asked::Value { id, endings, .. } => Request {
            title: format!("Choose a file for {id}"),
            filter: endings.join(", "),
            endings: endings.clone(),
            purpose: Purpose::Open,
        },
    }
}

/// A name for an edited cloud that is not the one of the file it came from.
fn suggested_name(window: &Window, item: usize) -> String {
    let items = window.shown.as_ref().map(|shown| shown.stock.items());
    let Some(item) = items.and_then(|items| items.get(item)) else { return "cloud.ply".to_owned() };
    let name = item.name().replace(".ply", "");
    let plain = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' };
    let name: String = name.chars().map(plain).collect();
    let name = name.split('-').filter(|part| !part.is_empty()).collect::<Vec<_>>().join("-");
    format!("{name}-edited.ply")
}

/// Asks the system for files; waits for the user.
fn ask_system(request: Request) -> Vec<PathBuf> {
    let mut dialog = rfd::FileDialog::new().set_title(request.title);
    if !request.endings.is_empty()
        && !matches!(&request.purpose, Purpose::Save { name, .. } if name.ends_with(".toml"))
    {
        dialog = dialog.add_filter(request.filter, &request.endings);
    }
    match request.purpose {
        Purpose::Open => dialog.pick_file().into_iter().collect(),
        Purpose::OpenSeveral => dialog.pick_files().unwrap_or_default(),
        Purpose::Save { name, .. } => dialog.set_file_name(name).save_file().into_iter().collect(),
    }
}

/// Asks for files on a thread of its own, since the system's dialog waits.
pub(crate) fn dialog(window: &mut Window, ctx: &Context, asked: Asked) {
    if window.dialogs.are_open() {
        return;
    }
    let (send, receive) = channel();
    let (wake, lends) = (ctx.clone(), window.dialogs.lends);
    let request = request(window, &asked);
    let thread = std::thread::Builder::new().name("dialog".to_owned()).spawn(move || {
        let answer = match lends() {
            Err(reason) => Answer::NoDialogs(reason),
            Ok(()) => match (ask_system(request), portal::was_not_reached()) {
                (files, Some(reason)) if files.is_empty() => Answer::NoDialogs(reason),
                (files, _) => Answer::Files(files),
            },
        };
        // The window may be gone already.
        drop(send.send(answer));
        wake.request_repaint();
    });
    match thread {
        Ok(_) => window.dialogs.open = Some((asked, Open::System(receive))),
        Err(error) => window.messages.warn(format!("no dialog could be opened: {error}")),
    }
}

/// Opens the program's own dialog in the place of the system's.
fn open_own(window: &mut Window, asked: Asked, reason: &str) {
    tracing::debug!("a file dialog of the program's own: {reason}");
    let why = format!("Not the desktop's own dialog: {reason}.");
    if !std::mem::replace(&mut window.dialogs.told, true) {
        window.messages.tell(format!("the program shows file dialogs of its own: {reason}"));
    }
    let shown = window.scene_path.as_ref().or(window.files.first());
    let beside =
        shown.and_then(|file| std::path::absolute(file).ok()?.parent().map(Path::to_owned));
    let folder = beside.filter(|folder| folder.is_dir()).unwrap_or_else(|| PathBuf::from("."));
    let own = FileDialog::new(request(window, &asked), &folder, why);
    window.dialogs.open = Some((asked, Open::Own(Box::new(own))));
}

pub(crate) fn open_dialog(window: &mut Window, ctx: &Context) {
    dialog(window, ctx, Asked::Open);
}

pub(crate) fn scene_dialog(window: &mut Window, ctx: &Context) {
    dialog(window, ctx, Asked::SaveScene);
}

/// Saves the scene where it came from, or asks where to.
pub(crate) fn save_scene(window: &mut Window, ctx: &Context) {
    match window.scene_path.clone() {
        Some(path) => window.save_scene(&path),
        None => scene_dialog(window, ctx),
    }
}

/// Takes the files chosen in a dialog; shows one of the program's own.
pub(crate) fn take_dialog(window: &mut Window, ctx: &Context) {
    let Some((asked, mut open)) = window.dialogs.open.take() else { return };
    let chosen = match &mut open {
        Open::System(answer) => match answer.try_recv() {
            Ok(Answer::Files(files)) => Some(files),
            Ok(Answer::NoDialogs(reason)) => return open_own(window, asked, &reason),
            Err(TryRecvError::Disconnected) => Some(Vec::new()),
            Err(TryRecvError::Empty) => None,
        },
        Open::Own(dialog) => match dialog.show(ctx) {
            Some(Outcome::Chosen(files)) => Some(files),
            Some(Outcome::Cancelled) => Some(Vec::new()),
            None => None,
        },
    };
    match chosen {
        None => window.dialogs.open = Some((asked, open)),
        Some(files) => take_files(window, ctx, asked, files),
    }
}

fn take_files(window: &mut Window, ctx: &Context, asked: Asked, files: Vec<PathBuf>) {
    let Some(path) = files.first() else { return };
    match asked {
        Asked::Open => window.open(ctx, files),
        Asked::SaveScene => window.save_scene(&scene_name(path)),
        Asked::SaveCloud(item) => window.save_cloud(ctx, item, path),
        Asked::Probe => surroundings::put(window, path),
        Asked::Reference => window.measure.form.path = path.display().to_string(),
        Asked::Value { whose, id, .. } => put_value(window, &whose, &id, path),
        Asked::Pictures => window.export_window.path = path.display().to_string(),
    }
}

/// Asks where to write one of the clouds: which, where there are several.
pub(crate) fn save_cloud(window: &mut Window, ui: &mut Ui, ctx: &Context) {
    let items = window.shown.iter().flat_map(|shown| shown.stock.items());
    let names: Vec<String> = items.map(|item| item.name()).collect();
    let mut chosen = None;
    match names.len() {
        0 => {}
        1 => chosen = ui.button("Save cloud as …").clicked().then_some(0),
        _ => drop(ui.menu_button("Save cloud as …", |ui| {
            for (i, name) in names.iter().enumerate() {
                if ui.button(name).clicked() {
                    chosen = Some(i);
                }
            }
        })),
    }
    if let Some(item) = chosen {
        ui.close();
        dialog(window, ctx, Asked::SaveCloud(item));
    }
}
