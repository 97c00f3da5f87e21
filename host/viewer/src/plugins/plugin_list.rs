//! The list of plugins with their state, trust and failures.

use crate::render_thread::{RenderCommand, UnitHealth};
use crate::window::Window;
use eframe::egui::{Grid, Label, ScrollArea, Ui};
use surfelshop_api::manifest::Manifest;
use surfelshop_runtime::plugins::{Entry, State, TrustState};
use surfelshop_session::plugin_facts::{author, licence, trusted};

/// Digits of a SHA-256 that a row shows; the tooltip has all.
const DIGITS: usize = 12;

const TITLES: [&str; 9] = [
    "package",
    "what it adds",
    "version",
    "state",
    "trusted",
    "ABI",
    "by",
    "licence",
    "SHA-256 and file",
];

/// Every plugin, and the units that failed.
pub(crate) fn show(window: &mut Window, ui: &mut Ui) {
    ScrollArea::both().max_height(420.0).show(ui, |ui| {
        Grid::new("plugins").num_columns(TITLES.len()).striped(true).show(ui, |ui| {
            for title in TITLES {
                ui.strong(title);
            }
            ui.end_row();
            for entry in window.plugins.registry.entries() {
                if row(ui, entry) {
                    window.plugins.undecided.remove(&entry.contents());
                }
                ui.end_row();
            }
        });
    });
    failures(window, ui);
}

/// The row of a file; returns whether the user wants to decide about its trust.
fn row(ui: &mut Ui, entry: &Entry) -> bool {
    let manifest = entry.manifest().cloned().unwrap_or_default();
    ui.label(&manifest.id);
    units(ui, &manifest);
    ui.label(&manifest.version);
    ui.label(match &entry.state {
        State::Available(_) => "available".to_owned(),
        State::Shadowed { by, .. } => format!("{} is used instead", by.display()),
        State::Waiting { meanwhile, .. } => format!("{} is used meanwhile", meanwhile.display()),
        State::Refused(reason) => reason.clone(),
    });
    let mut asks = false;
    let known = entry.manifest().is_some();
    if entry.asks_for_trust() {
        asks = ui.button("decide …").clicked();
    } else {
        ui.label(if known { trusted(entry.trust) } else { "" });
    }
    ui.label(if known {
        format!("{}.{}", manifest.abi_major, manifest.abi_minor)
    } else {
        String::new()
    });
    // The program's own name nobody.
    let is_own = manifest.authors.is_empty() && matches!(entry.trust, TrustState::OfProgram);
    ui.label(match (known, is_own) {
        (true, true) => "Surfelshop".to_owned(),
        (true, false) => author(&manifest),
        (false, _) => String::new(),
    });
    ui.label(if known { licence(&manifest) } else { "" });
    let sha256 = entry.contents().to_string();
    let file = format!("{}…  {}", &sha256[..DIGITS], entry.path.display());
    ui.label(file).on_hover_text(sha256);
    asks
}

/// What a package adds, a line for each unit; the pointer over a line tells what that does.
fn units(ui: &mut Ui, manifest: &Manifest) {
    ui.vertical(|ui| {
        for unit in &manifest.units {
            let line = Label::new(format!("{} {}", unit.kind.word(), unit.id)).extend();
            ui.add(line).on_hover_text(format!("{}: {}", unit.title, unit.summary));
        }
    });
}

/// The units that failed, with a button that switches them on.
fn failures(window: &mut Window, ui: &mut Ui) {
    let row = |ui: &mut Ui, unit: &UnitHealth| {
        let row = ui.horizontal(|ui| {
            ui.strong(&unit.renderer);
            ui.label(&unit.text);
            unit.off && ui.button("switch on").clicked()
        });
        row.inner
    };
    for unit in &window.plugins.unit_health {
        if row(ui, unit) {
            window.render.thread.add(RenderCommand::SwitchOn(unit.renderer.clone()));
        }
    }
    for units in [&mut window.plugins.tools.units, &mut window.measure.units] {
        for unit in units.failures() {
            if row(ui, &unit) {
                units.switch_on(&window.plugins.registry, &unit.renderer);
            }
        }
    }
}
