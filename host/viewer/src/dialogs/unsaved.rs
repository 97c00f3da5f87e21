//! The question before unsaved edits are lost: when the window is closed, and when other files replace
//! edited clouds.

use super::files;
use super::state::DialogPurpose;
use crate::document::OpenCloud;
use crate::document::unsaved_prompt::{PromptCause, UnsavedPrompt, is_terminating};
use crate::window::Window;
use eframe::egui::{Context, Id, Modal, Ui, ViewportCommand};
use std::path::Path;

/// What is saved last, in place of a cloud's index.
const SCENE: usize = usize::MAX;

/// The question's width, points.
const WIDTH: f32 = 460.0;

impl Window {
    /// Whether there are unsaved edits of clouds or of a scene.
    pub(crate) fn has_unsaved(&self) -> bool {
        let mut all = self.document.clouds.iter().flat_map(|shown| shown.open_clouds.all());
        all.any(OpenCloud::is_unsaved) || self.changed_scene().is_some()
    }

    /// The scene's file, where the scene is no more what is in it. Moves of the camera do not count, as for undo, nor
    /// does a scene that was never saved: the next start can open the last session.
    fn changed_scene(&self) -> Option<&Path> {
        // A preview in its place is no change; it came because there was none.
        if self.document.preview.is_some() {
            return None;
        }
        let path = self.document.scene_path.as_deref()?;
        let now = self.snapshot();
        let is_changed = match &self.document.written {
            Some(written) => *written != now,
            None => self.document.history.has_undo(&now),
        };
        is_changed.then_some(path)
    }

    /// Whether other files would take the place of a scene that was put together here and is in no file: clouds that were
    /// added, names, bookmarks, measurements. Closing loses none of it: the next start can open the last session.
    fn loses_scene(&self) -> bool {
        let Some(shown) = self.document.complete_clouds() else { return false };
        let all = shown.open_clouds.all();
        let is_made = all.len() > 1
            || all.iter().any(|cloud| cloud.title().is_some())
            || !(self.settings.measures.is_empty() && self.settings.bookmarks.is_empty());
        self.document.scene_path.is_none()
            && is_made
            && self.document.history.has_undo(&self.snapshot())
    }

    /// Whether other files would take the place of edits or of a scene that are in no file.
    pub(crate) fn replacing_loses(&self) -> bool {
        self.has_unsaved() || self.loses_scene()
    }

    /// Keeps the window open where closing it would lose edits, and asks. Called first in a frame, and
    /// also where no frame is shown.
    pub(crate) fn check_close(&mut self, ctx: &Context) {
        if !ctx.input(|input| input.viewport().close_requested()) {
            return;
        }
        if is_terminating() || self.document.close_confirmed || !self.has_unsaved() {
            self.document.close_confirmed = true;
            return;
        }
        ctx.send_viewport_cmd(ViewportCommand::CancelClose);
        // The window may be hidden.
        ctx.send_viewport_cmd(ViewportCommand::Minimized(false));
        ctx.send_viewport_cmd(ViewportCommand::Focus);
        if self.document.unsaved_prompt.is_none_or(|prompt| prompt.cause == PromptCause::Open) {
            self.document.unsaved_prompt =
                Some(UnsavedPrompt { cause: PromptCause::Close, saves: None });
        }
    }

    /// Whether clouds that were read may replace the open ones; asks where edits would be lost.
    pub(crate) fn may_replace_clouds(&mut self) -> bool {
        if self.document.replace_confirmed || !self.replacing_loses() {
            return true;
        }
        self.document
            .unsaved_prompt
            .get_or_insert(UnsavedPrompt { cause: PromptCause::Open, saves: None });
        false
    }
}

/// The user's answer.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Answer {
    Save,
    Discard,
    Cancel,
}

/// Asks, and follows the answer.
pub(crate) fn show(window: &mut Window, ctx: &Context) {
    let Some(prompt) = window.document.unsaved_prompt else { return };
    if let Some(last) = prompt.saves {
        return save(window, ctx, prompt, last);
    }
    let all = window.document.clouds.iter().flat_map(|shown| shown.open_clouds.all());
    let names: Vec<String> =
        all.filter(|open_cloud| open_cloud.is_unsaved()).map(OpenCloud::name).collect();
    let scene = match window.changed_scene() {
        Some(path) => UnsavedScene::Changed(path.display().to_string()),
        None if prompt.cause == PromptCause::Open && window.loses_scene() => UnsavedScene::New,
        None => UnsavedScene::None,
    };
    let shown = Modal::new(Id::unique("unsaved edits"))
        .show(ctx, |ui| question(ui, prompt.cause, &names, &scene));
    let answer = if shown.should_close() { Some(Answer::Cancel) } else { shown.inner };
    match answer {
        None => {}
        Some(Answer::Cancel) => cancel(window),
        Some(Answer::Discard) => proceed(window, ctx, prompt.cause),
        Some(Answer::Save) => {
            window.document.unsaved_prompt = Some(UnsavedPrompt { saves: Some(None), ..prompt })
        }
    }
}

/// What of the scene would be lost.
enum UnsavedScene {
    None,
    /// What is not in its file.
    Changed(String),
    /// All of it: it has no file.
    New,
}

fn question(
    ui: &mut Ui,
    cause: PromptCause,
    names: &[String],
    scene: &UnsavedScene,
) -> Option<Answer> {
    ui.set_max_width(WIDTH);
    ui.heading(match cause {
        PromptCause::Close => "Save edits before closing?",
        PromptCause::Open => "Save edits before opening other files?",
    });
    if !names.is_empty() {
        ui.label("Edits of these clouds are in no file yet, and are lost otherwise:");
        ui.add_space(4.0);
        for name in names {
            ui.strong(name);
        }
        ui.add_space(6.0);
    }
    match scene {
        UnsavedScene::None => {}
        UnsavedScene::Changed(scene) => {
            ui.label("Changes of this scene are not in its file:");
            ui.add_space(4.0);
            ui.strong(scene);
            ui.add_space(6.0);
        }
        UnsavedScene::New => {
            ui.label("The scene as you put it together is in no file yet, and is lost otherwise.");
            ui.add_space(6.0);
        }
    }
    let save = match (names.is_empty(), scene) {
        (true, UnsavedScene::New) => ("save …", "asks for a file for the scene"),
        (true, _) => ("save", "writes the scene's file again"),
        (false, UnsavedScene::Changed(_)) => {
            ("save …", "asks for a file for each cloud, and writes the scene's again")
        }
        (false, UnsavedScene::New) => {
            ("save …", "asks for a file for each cloud and for the scene")
        }
        (false, UnsavedScene::None) => ("save …", "asks for a file for each of them"),
    };
    let mut answer = None;
    ui.horizontal(|ui| {
        for (text, tip, is) in [
            (save.0, save.1, Answer::Save),
            ("discard", "the edits are lost", Answer::Discard),
            ("cancel", "everything stays as it is", Answer::Cancel),
        ] {
            let button = ui.button(text).on_hover_text(tip);
            // Enter takes what loses nothing.
            if is == Answer::Save && ui.memory(|memory| memory.focused().is_none()) {
                button.request_focus();
            }
            if button.clicked() {
                answer = Some(is);
            }
        }
    });
    answer
}

/// Cancels: everything stays as it is.
fn cancel(window: &mut Window) {
    if window.document.unsaved_prompt.take().is_some_and(|prompt| prompt.cause == PromptCause::Open)
    {
        window.document.loader = None;
        window.end_preview();
    }
}

/// Closes the window, or lets the files replace the clouds.
fn proceed(window: &mut Window, ctx: &Context, cause: PromptCause) {
    window.document.unsaved_prompt = None;
    match cause {
        PromptCause::Open => window.document.replace_confirmed = true,
        PromptCause::Close => {
            window.document.close_confirmed = true;
            ctx.send_viewport_cmd(ViewportCommand::Close);
        }
    }
}

/// Saves one edited cloud after the other, and the scene that names them; ends with the first one that is not saved.
fn save(window: &mut Window, ctx: &Context, prompt: UnsavedPrompt, last: Option<usize>) {
    if window.panels.dialogs.are_open() || window.document.cloud_writer.is_some() {
        waiting(window, ctx);
        return;
    }
    let all = window.document.clouds.iter().flat_map(|shown| shown.open_clouds.all());
    // Edits of pyramids are saved with the scene that names them.
    let is_next =
        |open_cloud: &OpenCloud| open_cloud.is_unsaved() && open_cloud.pyramid().is_none();
    let wants_scene = |window: &Window| {
        let is_lost = prompt.cause == PromptCause::Open && window.loses_scene();
        is_lost || window.document.scene_path.is_none() && window.has_unsaved()
    };
    match all.enumerate().find(|(_, open_cloud)| is_next(open_cloud)).map(|(i, _)| i) {
        None if wants_scene(window) => {
            // The dialog was cancelled, or the file could not be written, which is reported.
            if last == Some(SCENE) {
                return cancel(window);
            }
            files::open(window, ctx, DialogPurpose::SaveScene);
            window.document.unsaved_prompt =
                Some(UnsavedPrompt { saves: Some(Some(SCENE)), ..prompt });
        }
        None => {
            if let Some(path) = window.changed_scene().map(Path::to_owned) {
                window.save_scene(&path);
            }
            match window.changed_scene() {
                None => proceed(window, ctx, prompt.cause),
                // It could not be written, which is reported.
                Some(_) => cancel(window),
            }
        }
        // The dialog was cancelled, or the file could not be written, which is reported.
        Some(next) if last == Some(next) => cancel(window),
        Some(next) => {
            files::open(window, ctx, DialogPurpose::SaveCloud(next));
            window.document.unsaved_prompt =
                Some(UnsavedPrompt { saves: Some(Some(next)), ..prompt });
        }
    }
}

/// Shown while edits are saved; the program's own dialog is modal itself.
fn waiting(window: &mut Window, ctx: &Context) {
    if window.panels.dialogs.own_is_open() {
        return;
    }
    let cancelled = Modal::new(Id::unique("unsaved edits")).show(ctx, |ui| {
        ui.horizontal(|ui| {
            ui.spinner();
            ui.label("saving edits");
            ui.button("cancel").on_hover_text("everything stays as it is").clicked()
        })
        .inner
    });
    if cancelled.inner {
        cancel(window);
    }
}
