//! The question before the code of an untrusted plugin runs.

use crate::render_thread::RenderCommand;
use crate::window::Window;
use eframe::egui::{Context, Grid, Id, Label, Modal, RichText, Ui};
use surfelshop_api::manifest::UnitEntry;
use surfelshop_runtime::plugins::Entry;
use surfelshop_session::plugin_facts::api_range;
use surfelshop_session::plugin_facts::author;
use surfelshop_session::plugin_facts::licence;
use surfelshop_session::trust_file::TrustFile;

/// Most width of the question, points.
const WIDTH: f32 = 620.0;
/// Most units that are named.
const MOST_NAMED: usize = 5;

/// The user's answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Answer {
    Build,
    Place,
    Once,
    NotNow,
}

/// Asks about the first undecided plugin.
pub(crate) fn show(window: &mut Window, ctx: &Context) {
    if window.plugins.crash.is_some() {
        return; // One question at a time.
    }
    let undecided = |entry: &&Entry| {
        entry.asks_for_trust() && !window.plugins.undecided.contains(&entry.contents())
    };
    let Some(entry) = window.plugins.registry.entries().iter().find(undecided).cloned() else {
        return;
    };
    let shown = Modal::new(Id::unique("trust")).show(ctx, |ui| question(ui, &entry));
    // A click beside it means "not now".
    let answer = if shown.should_close() { Some(Answer::NotNow) } else { shown.inner };
    let Some(answer) = answer else { return };
    // Not asked again before the new list of plugins arrives.
    window.plugins.undecided.insert(entry.contents());
    match answer {
        Answer::NotNow => window
            .messages
            .report(format!("{} stays unused; Help > Plugins asks again", entry.path.display())),
        Answer::Once => window.render.thread.add(RenderCommand::Trust(Some(entry.contents()))),
        Answer::Build | Answer::Place => {
            match add_to_trust_list(window, &entry, answer == Answer::Place) {
                Ok(()) => window.render.thread.add(RenderCommand::Trust(None)),
                Err(error) => window.messages.warn(format!("{error:#}")),
            }
        }
    }
}

fn question(ui: &mut Ui, entry: &Entry) -> Option<Answer> {
    let manifest = entry.manifest()?;
    ui.set_max_width(WIDTH);
    ui.heading("Use this plugin?");
    ui.label(
        "It comes from a place that is new here. A plugin is a program that can do all that you can: \
         read, change and send your files. Nothing of it has run yet.",
    );
    ui.add_space(6.0);
    Grid::new("question").num_columns(2).max_col_width(WIDTH - 100.0).show(ui, |ui| {
        let mut row = |what: &str, is: String| {
            ui.label(what);
            ui.add(Label::new(RichText::new(is).strong()).wrap());
            ui.end_row();
        };
        row("package", format!("{} {}", manifest.id, manifest.version));
        row("offers", offers(&manifest.units));
        row("by", author(manifest));
        row("licence", licence(manifest).to_owned());
        row("API", api_range(manifest));
        row("file", entry.path.display().to_string());
        let is_link = std::path::absolute(&entry.path).is_ok_and(|path| path != entry.file);
        if is_link {
            row("leads to", entry.file.display().to_string());
        }
        let sha256 = entry.contents().to_string();
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

/// The units of a plugin, the first ones by their titles.
fn offers(units: &[UnitEntry]) -> String {
    let title = |unit: &UnitEntry| format!("{} {}", unit.kind.word(), unit.title);
    let titles = units.iter().take(MOST_NAMED).map(title).collect::<Vec<_>>().join(", ");
    match units.len().saturating_sub(MOST_NAMED) {
        0 => titles,
        others => format!("{titles}, and {others} others"),
    }
}

/// Adds a plugin to the trust list.
fn add_to_trust_list(window: &Window, entry: &Entry, place: bool) -> anyhow::Result<()> {
    let Some(manifest) = entry.manifest() else { return Ok(()) };
    let path = TrustFile::path(window.plugins.trust_file.as_deref())?;
    TrustFile::change(&path, |list| list.add(&entry.file, manifest, entry.contents(), place))
}
