//! Asks before the code of a plugin from a new place runs.

use super::darkroom::Task;
use super::window::Window;
use crate::plugins::{TrustFile, api_range, author, licence};
use eframe::egui::{Context, Grid, Id, Modal, RichText, Ui};
use surfelshop_engine::plugins::Entry;

/// What a person says to a plugin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Answer {
    Build,
    Place,
    Once,
    NotNow,
}

/// Asks about the first plugin that nobody has decided about yet.
pub(super) fn ask(window: &mut Window, ctx: &Context) {
    if window.crash.is_some() {
        return; // One question at a time.
    }
    let undecided =
        |entry: &&Entry| entry.asks_for_trust() && !window.undecided.contains(&entry.contents);
    let Some(entry) = window.registry.entries().iter().find(undecided).cloned() else { return };
    let shown = Modal::new(Id::unique("trust")).show(ctx, |ui| question(ui, &entry));
    // A click beside it decides nothing for good.
    let answer = if shown.should_close() { Some(Answer::NotNow) } else { shown.inner };
    let Some(answer) = answer else { return };
    // Until the list says so, it is not asked again.
    window.undecided.insert(entry.contents);
    match answer {
        Answer::NotNow => window
            .messages
            .tell(format!("{} stays unused; View > Plugins asks again", entry.path.display())),
        Answer::Once => window.darkroom.add(Task::Trust(Some(entry.contents))),
        Answer::Build | Answer::Place => match keep(window, &entry, answer == Answer::Place) {
            Ok(()) => window.darkroom.add(Task::Trust(None)),
            Err(error) => window.messages.warn(format!("{error:#}")),
        },
    }
}

fn question(ui: &mut Ui, entry: &Entry) -> Option<Answer> {
    let manifest = entry.available()?;
    ui.set_max_width(620.0);
    ui.heading("Use this plugin?");
    ui.label(
        "It comes from a place that is new here. A plugin is a program that can do all that you can: \
         read, change and send your files. Nothing of it has run yet.",
    );
    ui.add_space(6.0);
    Grid::new("question").num_columns(2).show(ui, |ui| {
        let mut row = |what: &str, is: String| {
            ui.label(what);
            ui.label(RichText::new(is).strong());
            ui.end_row();
        };
        row("package", format!("{} {}", manifest.id, manifest.version));
        let units = manifest.units.iter();
        let units = units.map(|unit| format!("{} {}", unit.kind.word(), unit.title));
        row("offers", units.collect::<Vec<_>>().join(", "));
        row("by", author(manifest));
        row("licence", licence(manifest).to_owned());
        row("API", api_range(manifest));
        row("file", entry.path.display().to_string());
        let sha256 = entry.contents.to_string();
        let (first, second) = sha256.split_at(32);
        row("SHA-256", format!("{first}\n{second}"));
    });
    ui.add_space(6.0);
    let mut answer = None;
    ui.horizontal_wrapped(|ui| {
        for (text, tip, is) in [
            ("trust this build", "until its file changes", Answer::Build),
            ("trust what is built there", "for a plugin that you work on yourself", Answer::Place),
            ("use it this once", "until this window is closed", Answer::Once),
            ("not now", "it stays in the list", Answer::NotNow),
        ] {
            if ui.button(text).on_hover_text(tip).clicked() {
                answer = Some(is);
            }
        }
    });
    answer
}

/// Writes a yes down.
fn keep(window: &Window, entry: &Entry, place: bool) -> anyhow::Result<()> {
    let Some(manifest) = entry.available() else { return Ok(()) };
    let path = window.trust_file.clone().map_or_else(TrustFile::path_of_user, Ok)?;
    let mut list = TrustFile::read_or_new(&path)?;
    list.add(&entry.path, manifest, entry.contents, place)?;
    list.write(&path)
}
