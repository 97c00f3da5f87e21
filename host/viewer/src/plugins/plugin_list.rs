//! The list of plugins with their state, trust and failures.

use super::previews::Previews;
use super::state::Plugins;
use crate::render_thread::{RenderCommand, UnitHealth};
use crate::window::Window;
use eframe::egui::{Grid, Image, Label, Role, ScrollArea, Ui, WidgetInfo, vec2};
use surfelshop_api::manifest::Manifest;
use surfelshop_runtime::plugins::{Entry, State, TrustState};
use surfelshop_session::plugin_facts::{ISOLATED, author_of, licence, trusted};
use surfelshop_session::trust_file::TrustFile;

/// Digits of a SHA-256 that a row shows; the tooltip has all.
const DIGITS: usize = 12;

/// Points of the window that the longer side of a plugin's picture takes in its row, and under the pointer.
const PICTURE_SIDES: [f32; 2] = [64.0, 256.0];

const TITLES: [&str; 10] = [
    "package",
    "what it adds",
    "version",
    "state",
    "trusted",
    "isolated",
    "ABI",
    "by",
    "licence",
    "SHA-256 and file",
];

/// Every plugin, and the units that failed.
pub(crate) fn show(window: &mut Window, ui: &mut Ui) {
    let mut isolates = None;
    ScrollArea::both().max_height(420.0).show(ui, |ui| {
        Grid::new("plugins").num_columns(TITLES.len()).striped(true).show(ui, |ui| {
            for title in TITLES {
                ui.strong(title);
            }
            ui.end_row();
            let Plugins { registry, previews, undecided, .. } = &mut window.plugins;
            for entry in registry.entries() {
                let wanted = row(ui, entry, previews);
                if wanted.decides {
                    undecided.remove(&entry.contents());
                }
                if let (Some(is_isolated), Some(manifest)) = (wanted.isolates, entry.manifest()) {
                    isolates = Some((manifest.id.clone(), is_isolated));
                }
                ui.end_row();
            }
        });
    });
    if let Some((package, is_isolated)) = isolates {
        isolate(window, &package, is_isolated);
    }
    failures(window, ui);
}

/// What the user wants of a plugin.
struct RowChoice {
    /// To decide about its trust.
    decides: bool,
    /// That it runs in processes of its own, or does so no more.
    isolates: Option<bool>,
}

/// Remembers whether a package runs in processes of its own.
fn isolate(window: &mut Window, package: &str, is_isolated: bool) {
    let changed = TrustFile::path(window.plugins.trust_file.as_deref()).and_then(|path| {
        TrustFile::change(&path, |list| {
            list.isolate(package, is_isolated);
            Ok(())
        })
    });
    match changed {
        Ok(()) => {
            let how = if is_isolated { ISOLATED } else { "in this program" };
            window.messages.report(format!("{package} runs {how} from its next start on"));
            window.render.thread.add(RenderCommand::Trust(None));
        }
        Err(error) => window.messages.warn(format!("{error:#}")),
    }
}

/// The row of a file.
fn row(ui: &mut Ui, entry: &Entry, previews: &mut Previews) -> RowChoice {
    let manifest = entry.manifest().cloned().unwrap_or_default();
    ui.vertical(|ui| {
        ui.add(Label::new(&manifest.id).extend());
        picture(ui, entry, previews);
    });
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
    let isolates = isolation(ui, entry);
    ui.label(if known {
        format!("{}.{}", manifest.abi_major, manifest.abi_minor)
    } else {
        String::new()
    });
    ui.label(if known { author_of(&manifest, entry.trust) } else { String::new() });
    ui.label(if known { licence(&manifest) } else { "" });
    let sha256 = entry.contents().to_string();
    let file = format!("{}…  {}", &sha256[..DIGITS], entry.path.display());
    ui.label(file).on_hover_text(sha256);
    RowChoice { decides: asks, isolates }
}

/// The picture that it was packed with, if there is one; larger under the pointer.
fn picture(ui: &mut Ui, entry: &Entry, previews: &mut Previews) {
    let Some(texture) = previews.of(ui.ctx(), entry) else { return };
    let [small, large] = PICTURE_SIDES.map(|side| Image::new(&texture).max_size(vec2(side, side)));
    let shown = ui.add(small);
    shown.widget_info(|| WidgetInfo::labeled(Role::Image, true, "preview"));
    shown.on_hover_ui(|ui| {
        ui.add(large);
    });
}

/// Whether it runs in processes of its own; returns what the user chose.
fn isolation(ui: &mut Ui, entry: &Entry) -> Option<bool> {
    if entry.manifest().is_none() || entry.trust == TrustState::Sandboxed || !cfg!(unix) {
        ui.label("");
        return None;
    }
    let mut is_isolated = entry.is_isolated();
    let mark = ui.checkbox(&mut is_isolated, "own process").on_hover_text(
        "run it in a process of its own from its next start on: if its code crashes, the program does not",
    );
    mark.changed().then_some(is_isolated)
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
