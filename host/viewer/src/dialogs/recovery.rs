//! The question about edits of an earlier session.

use crate::document::recovery::{self, Manifest};
use crate::window::Window;
use eframe::egui::{Context, Id, Modal, Ui};
use std::time::{Duration, SystemTime};

/// The question's width, points.
const WIDTH: f32 = 460.0;

/// The user's answer.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Answer {
    Recover,
    Delete,
    Back,
    Later,
}

/// Asks about one session after the other.
pub(crate) fn show(window: &mut Window, ctx: &Context) {
    let Some(state) = window.document.recovery.as_mut().filter(|state| state.asks()) else {
        return;
    };
    let Some(session) = state.offered.first() else { return };
    let (manifest, deletes) = (session.manifest.clone(), state.deletes);
    let shown = Modal::new(Id::unique("recovery")).show(ctx, |ui| question(ui, &manifest, deletes));
    let answer = if shown.should_close() { Some(Answer::Later) } else { shown.inner };
    let Some(answer) = answer else { return };
    match answer {
        Answer::Delete if !deletes => state.deletes = true,
        Answer::Back => state.deletes = false,
        Answer::Delete | Answer::Recover | Answer::Later => {
            state.deletes = false;
            let session = state.offered.remove(0);
            match answer {
                Answer::Delete => session.session.remove(),
                Answer::Recover => recovery::restore(window, ctx, session),
                _ => window.messages.report("the edits are kept; the next start offers them again"),
            }
        }
    }
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
            ("later", "the next start asks again", Answer::Later),
            ("delete", "asks once more", Answer::Delete),
        ],
    };
    let mut answer = None;
    ui.horizontal(|ui| {
        for (text, tip, is) in answers {
            let button = ui.button(*text).on_hover_text(*tip);
            // Enter takes what loses nothing.
            let is_safe = matches!(is, Answer::Recover | Answer::Back);
            if is_safe && ui.memory(|memory| memory.focused().is_none()) {
                button.request_focus();
            }
            if button.clicked() {
                answer = Some(*is);
            }
        }
    });
    answer
}

/// The time since a moment, in words.
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
