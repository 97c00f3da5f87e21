//! File dialogs are opened, and the chosen files are used.

use super::file_dialog::{FileDialog, Outcome, Purpose, Request};
use super::portal;
use super::request::request;
use super::state::{DialogPurpose, OpenDialog, ParameterOwner, SystemAnswer};
use crate::document::file_names::scene_file_name;
use crate::document::set_environment_file;
use crate::panels::Selection;
use crate::window::Window;
use eframe::egui::Context;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{TryRecvError, channel};
use surfelshop_api::params::{ParamDecl, ParamKind, Value};

/// Opens a file dialog, unless one is open: the desktop's, on a thread of its own since it blocks.
pub(crate) fn open(window: &mut Window, ctx: &Context, purpose: DialogPurpose) {
    if window.panels.dialogs.are_open() {
        return;
    }
    let (send, receive) = channel();
    let (wake, check_desktop) = (ctx.clone(), window.panels.dialogs.check_desktop);
    let request = request(window, &purpose);
    let thread = std::thread::Builder::new().name("dialog".to_owned()).spawn(move || {
        let answer = match check_desktop() {
            Err(reason) => SystemAnswer::NoDialogs(reason),
            Ok(()) => match (ask_system(request), portal::missing_library()) {
                (files, Some(reason)) if files.is_empty() => SystemAnswer::NoDialogs(reason),
                (files, _) => SystemAnswer::Files(files),
            },
        };
        // The window may be closed already.
        drop(send.send(answer));
        wake.request_repaint();
    });
    match thread {
        Ok(_) => window.panels.dialogs.open = Some((purpose, OpenDialog::System(receive))),
        Err(error) => window.messages.warn(format!("no dialog could be opened: {error}")),
    }
}

/// Opens a dialog for the file of a parameter.
pub(crate) fn open_for_parameter(
    window: &mut Window,
    ctx: &Context,
    owner: ParameterOwner,
    parameter: &ParamDecl,
) {
    let ParamKind::File { endings } = &parameter.kind else { return };
    let (id, endings) = (parameter.id.clone(), endings.clone());
    open(window, ctx, DialogPurpose::Value { owner, id, endings });
}

/// Saves the scene to its file, or opens a dialog where it has none.
pub(crate) fn save_scene(window: &mut Window, ctx: &Context) {
    match window.document.scene_path.clone() {
        Some(path) => window.save_scene(&path),
        None => open(window, ctx, DialogPurpose::SaveScene),
    }
}

/// Saves the selected cloud, or the only one; otherwise the palette asks which.
pub(crate) fn save_cloud(window: &mut Window, ctx: &Context) {
    if let Selection::Cloud(index) = window.selection() {
        return open(window, ctx, DialogPurpose::SaveCloud(index));
    }
    let clouds = window.document.clouds.as_ref();
    match clouds.map_or(0, |shown| shown.open_clouds.all().len()) {
        0 => {}
        1 => open(window, ctx, DialogPurpose::SaveCloud(0)),
        _ => window.panels.palette.open_with("save cloud "),
    }
}

/// Opens the desktop's dialog; blocks until the user has answered.
fn ask_system(request: Request) -> Vec<PathBuf> {
    let mut dialog = rfd::FileDialog::new().set_title(request.title);
    if !request.endings.is_empty()
        && !matches!(&request.purpose, Purpose::Save { name, .. } if name.ends_with(".toml"))
    {
        // What it knows of names is behind their last dot.
        let ending = |ending: &String| ending.rsplit('.').next().unwrap_or_default().to_owned();
        let endings: Vec<String> = request.endings.iter().map(ending).collect();
        dialog = dialog.add_filter(request.filter, &endings);
    }
    match request.purpose {
        Purpose::Open => dialog.pick_file().into_iter().collect(),
        Purpose::OpenSeveral => dialog.pick_files().unwrap_or_default(),
        Purpose::Save { name, .. } => dialog.set_file_name(name).save_file().into_iter().collect(),
    }
}

/// Opens the program's own dialog in place of the desktop's.
fn open_own(window: &mut Window, purpose: DialogPurpose, reason: &str) {
    tracing::debug!("a file dialog of the program's own: {reason}");
    let why = format!("Not the desktop's own dialog: {reason}.");
    if !std::mem::replace(&mut window.panels.dialogs.reported, true) {
        window.messages.report(format!("the program shows file dialogs of its own: {reason}"));
    }
    let shown = window.document.scene_path.as_ref().or(window.document.files.first());
    let beside =
        shown.and_then(|file| std::path::absolute(file).ok()?.parent().map(Path::to_owned));
    let folder = beside.filter(|folder| folder.is_dir()).unwrap_or_else(|| PathBuf::from("."));
    let own = FileDialog::new(request(window, &purpose), &folder, why);
    window.panels.dialogs.open = Some((purpose, OpenDialog::Own(Box::new(own))));
}

/// Shows the open dialog, and uses the files that were chosen.
pub(crate) fn show(window: &mut Window, ctx: &Context) {
    let Some((purpose, mut dialog)) = window.panels.dialogs.open.take() else { return };
    let chosen = match &mut dialog {
        OpenDialog::System(answer) => match answer.try_recv() {
            Ok(SystemAnswer::Files(files)) => Some(files),
            Ok(SystemAnswer::NoDialogs(reason)) => return open_own(window, purpose, &reason),
            Err(TryRecvError::Disconnected) => Some(Vec::new()),
            Err(TryRecvError::Empty) => None,
        },
        OpenDialog::Own(dialog) => match dialog.show(ctx) {
            Some(Outcome::Chosen(files)) => Some(files),
            Some(Outcome::Cancelled) => Some(Vec::new()),
            None => None,
        },
    };
    match chosen {
        None => window.panels.dialogs.open = Some((purpose, dialog)),
        Some(files) => use_files(window, ctx, purpose, files),
    }
}

fn use_files(window: &mut Window, ctx: &Context, purpose: DialogPurpose, files: Vec<PathBuf>) {
    let Some(path) = files.first() else { return };
    match purpose {
        DialogPurpose::Open => window.open(ctx, files),
        DialogPurpose::Add => window.add(ctx, files),
        DialogPurpose::SaveScene => window.save_scene(&scene_file_name(path)),
        DialogPurpose::SaveCloud(index) => window.save_cloud(ctx, index, path),
        DialogPurpose::Probe => set_environment_file(window, path),
        DialogPurpose::Reference => window.measure.form.path = path.display().to_string(),
        DialogPurpose::Value { owner, id, .. } => set_value(window, &owner, &id, path),
        DialogPurpose::Pictures => window.panels.export_form.path = path.display().to_string(),
    }
}

/// Sets a parameter to a path.
fn set_value(window: &mut Window, owner: &ParameterOwner, id: &str, path: &Path) {
    let values = match owner {
        ParameterOwner::Renderer { pane, renderer } => {
            let pane = window.settings.pane_mut(*pane);
            pane.map(|pane| pane.values.entry(renderer.clone()).or_default())
        }
        ParameterOwner::Tool(tool) => {
            Some(window.plugins.tools.values.entry(tool.clone()).or_default())
        }
        ParameterOwner::Tracer(tracer) => {
            Some(window.measure.form.tracer_values.entry(tracer.clone()).or_default())
        }
    };
    if let Some(values) = values {
        values.insert(id.to_owned(), Value::Text(path.display().to_string()));
    }
}
