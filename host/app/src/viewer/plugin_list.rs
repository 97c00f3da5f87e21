//! The window that lists the plugins: what they are, whether they may run, and how they behave.

use super::darkroom::{Task, UnitConduct};
use super::window::Window;
use crate::plugins::{author, licence, trusted};
use eframe::egui::{Grid, ScrollArea, Ui};
use surfelshop_engine::plugins::{Entry, State};

/// Digits of a SHA-256 that a row shows; the others are in its tip.
const DIGITS: usize = 12;

const TITLES: [&str; 8] =
    ["package", "version", "state", "trusted", "ABI", "by", "licence", "SHA-256 and file"];

/// Every plugin with its state, and the units that failed.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    ScrollArea::both().max_height(420.0).show(ui, |ui| {
        Grid::new("plugins").num_columns(TITLES.len()).striped(true).show(ui, |ui| {
            for title in TITLES {
                ui.strong(title);
            }
            ui.end_row();
            for entry in window.registry.entries() {
                if row(ui, entry) {
                    window.undecided.remove(&entry.contents);
                }
                ui.end_row();
            }
        });
    });
    conduct(window, ui);
}

/// One file; says whether the user wants to be asked about it.
fn row(ui: &mut Ui, entry: &Entry) -> bool {
    let manifest = entry.manifest().cloned().unwrap_or_default();
    ui.label(&manifest.id);
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
    ui.label(if known { author(&manifest) } else { String::new() });
    ui.label(if known { licence(&manifest) } else { "" });
    let sha256 = entry.contents.to_string();
    let file = format!("{}…  {}", &sha256[..DIGITS], entry.path.display());
    ui.label(file).on_hover_text(sha256);
    asks
}

/// Units that failed, and what switches them on again.
fn conduct(window: &mut Window, ui: &mut Ui) {
    let row = |ui: &mut Ui, unit: &UnitConduct| {
        let row = ui.horizontal(|ui| {
            ui.strong(&unit.renderer);
            ui.label(&unit.text);
            unit.off && ui.button("switch on").clicked()
        });
        row.inner
    };
    for unit in &window.conduct {
        if row(ui, unit) {
            window.darkroom.add(Task::SwitchOn(unit.renderer.clone()));
        }
    }
    for shelf in [&mut window.tools.shelf, &mut window.measure.shelf] {
        for unit in shelf.failures() {
            if row(ui, &unit) {
                shelf.switch_on(&window.registry, &unit.renderer);
            }
        }
    }
}
