//! Edits that survive a crash: kept on disk while no file of the user's has them, and offered by the next
//! start.
//!
//! Kept are the clouds as they are now, with all columns and who made them, and the scene around them;
//! not the steps to undo.

mod journal;
mod session;

use super::loading::{Loading, Read};
use super::scene_file;
use super::stock::Stock;
use super::window::Window;
use eframe::egui::{Context, Id, Modal, Ui};
pub(crate) use journal::End;
use journal::{Edited, Journal, Wish};
pub(crate) use session::Row;
use session::{Left, Manifest};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};
use surfelshop_cloud::scene::{self, SceneCloud, SceneFile};
use surfelshop_engine::plugins::state_folder;

/// The scene that is read when edits are opened again.
const READ: &str = "recovered.scene.toml";
/// The question's width, points.
const WIDTH: f32 = 460.0;

/// The edits of this window, and those that others left.
pub(crate) struct Recovery {
    pub(crate) journal: Journal,
    /// What was kept last, and with which scene.
    last: Option<(Stock, Option<PathBuf>)>,
    /// Edits about which the user has not decided yet.
    offered: Vec<Left>,
    /// Whether the user wants them gone, once that was asked again.
    deletes: bool,
    /// Those that are being read.
    pub(crate) reading: Option<Left>,
}

impl Recovery {
    /// Of this user; none where the system names no folder for it.
    pub(crate) fn of_user() -> Option<Self> {
        state_folder().map(|folder| Self::in_folder(&folder))
    }

    /// In a folder for the program's state.
    pub(crate) fn in_folder(folder: &Path) -> Self {
        let folder = folder.join("recovery");
        let offered = session::left(&folder);
        Self { journal: Journal::new(folder), last: None, offered, deletes: false, reading: None }
    }

    /// Whether there is something to decide about.
    pub(crate) fn asks(&self) -> bool {
        !self.offered.is_empty() && self.reading.is_none()
    }
}

/// Has the edits that are in no file kept, where they changed since the last call.
pub(crate) fn keep(window: &mut Window, ctx: &Context) {
    let Some(recovery) = &mut window.recovery else { return };
    for fault in recovery.journal.faults() {
        window.messages.warn(fault);
    }
    let Some(shown) = &window.shown else { return };
    let is_same = |(stock, scene): &(Stock, Option<PathBuf>)| {
        stock.is(&shown.stock) && *scene == window.scene_path
    };
    if recovery.last.as_ref().is_some_and(is_same) {
        return;
    }
    recovery.last = Some((shown.stock.clone(), window.scene_path.clone()));
    let stock = shown.stock.clone();
    let wish = wish(window, &stock);
    let wake = ctx.clone();
    if let Some(recovery) = &mut window.recovery {
        recovery.journal.want(wish, move || wake.request_repaint());
    }
}

/// What is to be on disk of these clouds.
fn wish(window: &Window, stock: &Stock) -> Wish {
    let is_edited = stock.items().iter().any(super::stock::Item::is_unsaved);
    if !is_edited {
        return Wish::default();
    }
    // Where no file of the user's lies, so that their paths stay whole.
    let folder = window.recovery.as_ref().map(|recovery| recovery.journal.folder.clone());
    let folder = folder.unwrap_or_default();
    let mut shown = scene_file::of(window, &folder.join(READ));
    let clouds = scene_file::opened_clouds(window, &folder);
    let opened = SceneFile { clouds: clouds.clone(), ..shown.clone() };
    shown.clouds = clouds;
    // What has no row is not read again.
    shown.clouds.iter_mut().for_each(|cloud| cloud.visible = false);
    let (mut rows, mut edited) = (Vec::new(), Vec::new());
    for item in stock.items() {
        let at = match item.entry.filter(|entry| *entry < shown.clouds.len()) {
            Some(entry) => entry,
            None => {
                shown
                    .clouds
                    .push(SceneCloud::new(item.saved_as.clone().unwrap_or_default()).into());
                shown.clouds.len() - 1
            }
        };
        if let Some(cloud) = shown.clouds.get_mut(at) {
            // Hidden ones are read, too: they can be shown again.
            cloud.visible = true;
            if let Some(path) = &item.saved_as {
                (cloud.path, cloud.transform) = (path.clone(), None);
            }
        }
        if item.is_unsaved() {
            let (cloud, comments) =
                (item.loaded.cloud.clone(), item.loaded.summary.comments.clone());
            edited.push(Edited { row: rows.len(), cloud, comments });
        }
        rows.push(Row {
            at,
            was_opened: item.entry.is_some(),
            visible: item.visible,
            name: item.loaded.summary.file.clone(),
            saved_as: item.saved_as.clone(),
            file: None,
        });
    }
    Wish { scene: window.scene_path.clone(), rows, edited, shown, opened }
}

/// Ends the keeping when the window closes.
pub(crate) fn end(window: &mut Window, end: End) {
    if let Some(recovery) = &mut window.recovery {
        recovery.journal.finish(end);
    }
}

/// Asks about edits that were left, one window's at a time.
pub(crate) fn ask(window: &mut Window, ctx: &Context) {
    let Some(recovery) = window.recovery.as_mut().filter(|recovery| recovery.asks()) else {
        return;
    };
    let Some(left) = recovery.offered.first() else { return };
    let (manifest, deletes) = (left.manifest.clone(), recovery.deletes);
    let shown = Modal::new(Id::unique("recovery")).show(ctx, |ui| question(ui, &manifest, deletes));
    let answer = if shown.should_close() { Some(Answer::Later) } else { shown.inner };
    let Some(answer) = answer else { return };
    match answer {
        Answer::Delete if !deletes => recovery.deletes = true,
        Answer::Back => recovery.deletes = false,
        Answer::Delete | Answer::Recover | Answer::Later => {
            recovery.deletes = false;
            let left = recovery.offered.remove(0);
            match answer {
                Answer::Delete => left.session.remove(),
                Answer::Recover => recover(window, ctx, left),
                _ => window.messages.tell("the edits are kept; the next start offers them again"),
            }
        }
    }
}

/// What a person says to edits that were left.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Answer {
    Recover,
    Delete,
    Back,
    Later,
}

fn question(ui: &mut Ui, manifest: &Manifest, deletes: bool) -> Option<Answer> {
    ui.set_max_width(WIDTH);
    ui.heading(if deletes { "Delete these edits for good?" } else { "Recover edits?" });
    if !deletes {
        ui.label("The program ended with edits that were in no file yet. They are of");
    }
    ui.add_space(4.0);
    for name in manifest.names() {
        ui.strong(name);
    }
    ui.weak(format!("as they were {}", ago(manifest.time)));
    ui.add_space(6.0);
    let answers: &[(&str, &str, Answer)] = match deletes {
        true => &[
            ("delete", "nothing brings them back", Answer::Delete),
            ("back", "nothing is deleted", Answer::Back),
        ],
        false => &[
            ("recover", "opens the scene they belong to, with these edits", Answer::Recover),
            ("delete", "asks once more", Answer::Delete),
            ("later", "the next start asks again", Answer::Later),
        ],
    };
    let mut answer = None;
    ui.horizontal(|ui| {
        for (text, tip, is) in answers {
            if ui.button(*text).on_hover_text(*tip).clicked() {
                answer = Some(*is);
            }
        }
    });
    answer
}

/// How long ago a time was, in words.
fn ago(time: u64) -> String {
    let then = SystemTime::UNIX_EPOCH + Duration::from_secs(time);
    let seconds = then.elapsed().map_or(0, |since| since.as_secs());
    let (n, unit) = match seconds {
        0..120 => return "moments ago".to_owned(),
        120..7_200 => (seconds / 60, "minutes"),
        7_200..172_800 => (seconds / 3_600, "hours"),
        _ => (seconds / 86_400, "days"),
    };
    format!("{n} {unit} ago")
}

/// Begins to read edits that were left.
fn recover(window: &mut Window, ctx: &Context, left: Left) {
    let later = "; the edits are kept, and the next start offers them again";
    let path = match prepare(window, &left) {
        Ok(path) => path,
        Err(error) => return window.messages.warn(format!("{error:#}{later}")),
    };
    let wake = ctx.clone();
    match Loading::start(vec![path], move || wake.request_repaint()) {
        Ok(loading) => {
            window.loading = Some(loading);
            if let Some(recovery) = &mut window.recovery {
                recovery.reading = Some(left);
            }
        }
        Err(error) => window.messages.warn(format!("nothing can be read: {error}{later}")),
    }
}

/// Writes the scene to be read: the kept one, without clouds that are not there any more.
fn prepare(window: &mut Window, left: &Left) -> anyhow::Result<PathBuf> {
    let mut file = scene::read(left.session.folder.join(&left.manifest.shown))?.scene;
    for i in 0..file.clouds.len() {
        let path = file.path_of(&file.clouds[i]);
        if file.clouds[i].visible && !path.exists() {
            file.clouds[i].visible = false;
            window.messages.warn(format!("{}: left out, there is no such file", path.display()));
        }
    }
    let path = left.session.folder.join(READ);
    file.write(&path)?;
    Ok(path)
}

/// The clouds that were read again, the scene that they belong to and where that is; what it was is kept
/// until they are on disk anew.
pub(crate) fn recovered(
    window: &mut Window,
    left: Left,
    read: Read,
) -> Option<(Stock, SceneFile, Option<PathBuf>)> {
    let Read { clouds, scene, entries } = read;
    let mut file = scene?.scene;
    match scene::read(left.session.folder.join(&left.manifest.opened)) {
        Ok(opened) => {
            // The folder of the session goes, and with it what leads out of it.
            let whole = |path: PathBuf| std::path::absolute(&path).unwrap_or(path);
            let clouds = opened.scene.clouds.iter().map(|cloud| {
                let mut cloud = cloud.clone();
                cloud.path = whole(opened.scene.path_of(&cloud));
                cloud
            });
            (file.clouds, file.folder) = (clouds.collect(), PathBuf::new());
        }
        Err(error) => {
            window.messages.warn(error.to_string());
            return None;
        }
    }
    let stock = Stock::recovered(clouds, &entries, &left.manifest.clouds);
    let names = left.manifest.names().join(", ");
    window.messages.tell(format!("recovered {names}, not saved yet"));
    let scene = left.manifest.scene.clone();
    if let Some(recovery) = &window.recovery {
        recovery.journal.adopt(left);
    }
    Some((stock, file, scene))
}
