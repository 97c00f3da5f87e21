//! One question before edits that are in no file are lost: when the window is closed, and when other files
//! take the place of edited clouds.

use super::dialogs::{self, Asked};
use super::stock::Item;
use super::window::Window;
use eframe::egui::{Context, Id, Modal, Ui, ViewportCommand};
use std::sync::atomic::{AtomicBool, Ordering};

/// The question's width, points.
const WIDTH: f32 = 460.0;

/// Whether the system asked the program to end, which it does without a question.
static ENDS: AtomicBool = AtomicBool::new(false);

/// Notes that the system asked the program to end.
pub(crate) fn end() {
    ENDS.store(true, Ordering::Relaxed);
}

/// Whether the system asked the program to end.
pub(crate) fn ends() -> bool {
    ENDS.load(Ordering::Relaxed)
}

/// What would lose the edits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Why {
    Close,
    /// Files that were opened.
    Open,
}

/// A question, or what follows from its answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Leaving {
    why: Why,
    /// Whether the edits are being saved, and of which cloud the user was asked last.
    saves: Option<Option<usize>>,
}

impl Window {
    /// Whether edits are in no file.
    pub(crate) fn has_unsaved(&self) -> bool {
        self.shown.iter().flat_map(|shown| shown.stock.items()).any(Item::is_unsaved)
    }

    /// Keeps the window open where closing it would lose edits, and asks. Comes before everything else of
    /// a frame, and where no frame is shown.
    pub(crate) fn check_close(&mut self, ctx: &Context) {
        if !ctx.input(|input| input.viewport().close_requested()) {
            return;
        }
        if ends() || self.closes || !self.has_unsaved() {
            self.closes = true;
            return;
        }
        ctx.send_viewport_cmd(ViewportCommand::CancelClose);
        // It may be hidden.
        ctx.send_viewport_cmd(ViewportCommand::Minimized(false));
        ctx.send_viewport_cmd(ViewportCommand::Focus);
        if self.leaving.is_none_or(|leaving| leaving.why == Why::Open) {
            self.leaving = Some(Leaving { why: Why::Close, saves: None });
        }
    }

    /// Whether clouds that were read may take the place of those on show; asks where edits would be lost.
    pub(crate) fn may_replace(&mut self) -> bool {
        if self.replaces || !self.has_unsaved() {
            return true;
        }
        self.leaving.get_or_insert(Leaving { why: Why::Open, saves: None });
        false
    }
}

/// What a person says.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Answer {
    Save,
    Discard,
    Cancel,
}

/// Asks, and does what the answer was.
pub(crate) fn show(window: &mut Window, ctx: &Context) {
    let Some(leaving) = window.leaving else { return };
    if let Some(asked) = leaving.saves {
        return save(window, ctx, leaving, asked);
    }
    let items = window.shown.iter().flat_map(|shown| shown.stock.items());
    let names: Vec<String> = items.filter(|item| item.is_unsaved()).map(Item::name).collect();
    let shown = Modal::new(Id::unique("leaving")).show(ctx, |ui| question(ui, leaving.why, &names));
    let answer = if shown.should_close() { Some(Answer::Cancel) } else { shown.inner };
    match answer {
        None => {}
        Some(Answer::Cancel) => stay(window),
        Some(Answer::Discard) => go(window, ctx, leaving.why),
        Some(Answer::Save) => window.leaving = Some(Leaving { saves: Some(None), ..leaving }),
    }
}

fn question(ui: &mut Ui, why: Why, names: &[String]) -> Option<Answer> {
    ui.set_max_width(WIDTH);
    ui.heading(match why {
        Why::Close => "Save edits before closing?",
        Why::Open => "Save edits before opening other files?",
    });
    ui.label("Edits of these clouds are in no file yet, and are lost otherwise:");
    ui.add_space(4.0);
    for name in names {
        ui.strong(name);
    }
    ui.add_space(6.0);
    let mut answer = None;
    ui.horizontal(|ui| {
        for (text, tip, is) in [
            ("save …", "asks for a file for each of them", Answer::Save),
            ("discard", "the edits are lost", Answer::Discard),
            ("cancel", "everything stays as it is", Answer::Cancel),
        ] {
            if ui.button(text).on_hover_text(tip).clicked() {
                answer = Some(is);
            }
        }
    });
    answer
}

/// Everything stays as it is.
fn stay(window: &mut Window) {
    if window.leaving.take().is_some_and(|leaving| leaving.why == Why::Open) {
        window.loading = None;
    }
}

/// Does what was asked about.
fn go(window: &mut Window, ctx: &Context, why: Why) {
    window.leaving = None;
    match why {
        Why::Open => window.replaces = true,
        Why::Close => {
            window.closes = true;
            ctx.send_viewport_cmd(ViewportCommand::Close);
        }
    }
}

/// Saves one edited cloud after the other; one that is not saved ends it.
fn save(window: &mut Window, ctx: &Context, leaving: Leaving, asked: Option<usize>) {
    if window.dialogs.are_open() || window.saving.is_some() {
        waiting(window, ctx);
        return;
    }
    let items = window.shown.iter().flat_map(|shown| shown.stock.items());
    match items.enumerate().find(|(_, item)| item.is_unsaved()).map(|(i, _)| i) {
        None => go(window, ctx, leaving.why),
        // The dialog was cancelled, or the file could not be written, which is told.
        Some(next) if asked == Some(next) => stay(window),
        Some(next) => {
            dialogs::dialog(window, ctx, Asked::SaveCloud(next));
            window.leaving = Some(Leaving { saves: Some(Some(next)), ..leaving });
        }
    }
}

/// What is seen meanwhile; the program's own dialog stands for itself.
fn waiting(window: &mut Window, ctx: &Context) {
    if window.dialogs.own_is_open() {
        return;
    }
    let cancelled = Modal::new(Id::unique("leaving")).show(ctx, |ui| {
        ui.horizontal(|ui| {
            ui.spinner();
            ui.label("saving edits");
            ui.button("cancel").on_hover_text("everything stays as it is").clicked()
        })
        .inner
    });
    if cancelled.inner {
        stay(window);
    }
}
