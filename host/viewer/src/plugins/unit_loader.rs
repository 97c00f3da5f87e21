//! Loads tools and tracers, each on a thread of its own, and counts their failures.

use crate::render_thread::UnitHealth;
use eframe::egui::Context;
use std::collections::HashMap;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use surfelshop_api::UnitKind;
use surfelshop_runtime::plugins::{
    Contents, CrashGuard, CrashMark, LoadError, LoadedUnit, PluginHealth, Registry, Timeouts,
    UnitRef, UnitState,
};

/// Units of one kind by the names that [`Registry::names`] gives them.
pub(crate) struct UnitLoader {
    kind: UnitKind,
    timeouts: Timeouts,
    units: HashMap<String, UnitCode>,
    pub(crate) health: PluginHealth,
    /// Units that the user has switched off after a crash.
    avoided: Vec<String>,
}

/// The state of a unit's code.
enum UnitCode {
    Loading(Receiver<Result<LoadedUnit, LoadError>>),
    Loaded(Box<LoadedUnit>),
    Refused(String),
}

/// Whether a unit can be used.
pub(crate) enum Readiness<'a> {
    Loading,
    Ready(&'a LoadedUnit),
    Refused(&'a str),
}

/// Writes a mark that names a unit in use; without it a crash is not attributed to the unit.
pub(crate) fn mark_in_use(unit: &UnitRef) -> Option<CrashMark> {
    CrashGuard::of_user().and_then(|guard| guard.leave(unit).ok())
}

impl UnitLoader {
    pub(crate) fn new(kind: UnitKind, timeouts: Timeouts) -> Self {
        let (units, health, avoided) = Default::default();
        Self { kind, timeouts, units, health, avoided }
    }

    /// Starts to load a unit unless it is loaded, and takes in the result.
    pub(crate) fn prepare(&mut self, ctx: &Context, registry: &Registry, name: &str) {
        if !self.units.contains_key(name) {
            let unit = match self.load(ctx, registry, name) {
                Ok(result) => result,
                Err(reason) => UnitCode::Refused(reason),
            };
            self.units.insert(name.to_owned(), unit);
        }
        let Some(unit) = self.units.get_mut(name) else { return };
        let UnitCode::Loading(result) = unit else { return };
        let state = match result.try_recv() {
            Err(TryRecvError::Empty) => return,
            Err(TryRecvError::Disconnected) => {
                UnitCode::Refused("loading ended without a word".into())
            }
            Ok(Ok(loaded)) => UnitCode::Loaded(Box::new(loaded)),
            Ok(Err(error)) => {
                if let (Some(fault), Ok(unit)) = (error.fault(), registry.find(self.kind, name)) {
                    self.health.failed(&unit, Contents::of_file(&unit.path), fault);
                }
                UnitCode::Refused(error.to_string())
            }
        };
        *unit = state;
    }

    fn load(&self, ctx: &Context, registry: &Registry, name: &str) -> Result<UnitCode, String> {
        let reference = registry.find(self.kind, name).map_err(|error| error.to_string())?;
        if self.avoided.contains(&reference.id) {
            return Err(format!(
                "{reference} was at work when the program crashed; the plugin list switches it on"
            ));
        }
        self.health.check(&reference).map_err(|refusal| refusal.to_string())?;
        let mark = mark_in_use(&reference);
        let (send, result) = channel();
        let (wake, timeouts) = (ctx.clone(), self.timeouts);
        let name = self.kind.word().to_owned();
        let thread = std::thread::Builder::new().name(name).spawn(move || {
            // The window may be closed already.
            drop(send.send(reference.load(&timeouts)));
            drop(mark);
            wake.request_repaint();
        });
        match thread {
            Ok(_) => Ok(UnitCode::Loading(result)),
            Err(error) => Err(format!("nothing can be loaded: {error}")),
        }
    }

    /// Whether a unit can be used.
    pub(crate) fn readiness(&self, name: &str) -> Readiness<'_> {
        match self.units.get(name) {
            Some(UnitCode::Loaded(unit)) => Readiness::Ready(unit),
            Some(UnitCode::Refused(reason)) => Readiness::Refused(reason),
            Some(UnitCode::Loading(_)) | None => Readiness::Loading,
        }
    }

    /// Unloads all units: their files may have changed.
    pub(crate) fn unload_all(&mut self) {
        self.units.clear();
    }

    /// Unloads a unit, which is loaded again before its next use.
    pub(crate) fn unload(&mut self, name: &str) {
        self.units.remove(name);
    }

    /// Switches a unit off until the user switches it on.
    pub(crate) fn avoid(&mut self, id: String) {
        self.avoided.push(id);
    }

    /// Switches a unit on.
    pub(crate) fn switch_on(&mut self, registry: &Registry, id: &str) {
        self.avoided.retain(|avoided| avoided != id);
        if let Ok(unit) = registry.find(self.kind, id) {
            self.health.switch_on(&unit);
        }
        self.units.clear();
    }

    /// The units that failed or are switched off.
    pub(crate) fn failures(&self) -> Vec<UnitHealth> {
        let of = |record: &surfelshop_runtime::plugins::Record| UnitHealth {
            renderer: record.unit.id.clone(),
            text: record.to_string(),
            off: record.standing == UnitState::Off,
        };
        let avoided = self.avoided.iter().map(|id| UnitHealth {
            renderer: id.clone(),
            text: "not used, since it was at work when the program crashed".to_owned(),
            off: true,
        });
        self.health.records().iter().map(of).chain(avoided).collect()
    }
}
