//! Units that the window itself loads, tools and tracers: each on a thread of its own, with how they
//! behave and which are not used for it.

use super::darkroom::UnitConduct;
use eframe::egui::Context;
use std::collections::HashMap;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use surfelshop_api::UnitKind;
use surfelshop_engine::plugins::{
    Conduct, Contents, LoadError, LoadedUnit, Mark, Marks, Patience, Registry, Standing, UnitRef,
};

/// Units of one kind by the names that [`Registry::names`] gives them.
pub(crate) struct Shelf {
    kind: UnitKind,
    patience: Patience,
    units: HashMap<String, Unit>,
    pub(crate) conduct: Conduct,
    /// Units that the user does not want since the program crashed.
    avoided: Vec<String>,
}

/// A unit's code.
enum Unit {
    Coming(Receiver<Result<LoadedUnit, LoadError>>),
    Here(Box<LoadedUnit>),
    Refused(String),
}

/// How far a unit is from being used.
pub(crate) enum Readiness<'a> {
    Loading,
    Ready(&'a LoadedUnit),
    Refused(&'a str),
}

/// Without the mark a crash is not noticed, which is no reason not to use the unit.
pub(crate) fn mark(unit: &UnitRef) -> Option<Mark> {
    Marks::of_user().and_then(|marks| marks.leave(unit).ok())
}

impl Shelf {
    pub(crate) fn new(kind: UnitKind, patience: Patience) -> Self {
        let (units, conduct, avoided) = Default::default();
        Self { kind, patience, units, conduct, avoided }
    }

    /// Loads a unit's code unless it is there.
    pub(crate) fn prepare(&mut self, ctx: &Context, registry: &Registry, name: &str) {
        if !self.units.contains_key(name) {
            let unit = match self.load(ctx, registry, name) {
                Ok(coming) => coming,
                Err(reason) => Unit::Refused(reason),
            };
            self.units.insert(name.to_owned(), unit);
        }
        let Some(unit) = self.units.get_mut(name) else { return };
        let Unit::Coming(coming) = unit else { return };
        let arrived = match coming.try_recv() {
            Err(TryRecvError::Empty) => return,
            Err(TryRecvError::Disconnected) => Unit::Refused("loading ended without a word".into()),
            Ok(Ok(loaded)) => Unit::Here(Box::new(loaded)),
            Ok(Err(error)) => {
                if let (Some(fault), Ok(unit)) = (error.fault(), registry.find(self.kind, name)) {
                    self.conduct.failed(&unit, Contents::of_file(&unit.path), fault);
                }
                Unit::Refused(error.to_string())
            }
        };
        *unit = arrived;
    }

    fn load(&self, ctx: &Context, registry: &Registry, name: &str) -> Result<Unit, String> {
        let reference = registry.find(self.kind, name).map_err(|error| error.to_string())?;
        if self.avoided.contains(&reference.id) {
            return Err(format!(
                "{reference} was at work when the program crashed; the plugin list switches it on"
            ));
        }
        self.conduct.check(&reference).map_err(|barred| barred.to_string())?;
        let mark = mark(&reference);
        let (send, coming) = channel();
        let (wake, patience) = (ctx.clone(), self.patience);
        let name = self.kind.word().to_owned();
        let thread = std::thread::Builder::new().name(name).spawn(move || {
            // The window may be gone already.
            drop(send.send(reference.load(&patience)));
            drop(mark);
            wake.request_repaint();
        });
        match thread {
            Ok(_) => Ok(Unit::Coming(coming)),
            Err(error) => Err(format!("nothing can be loaded: {error}")),
        }
    }

    /// How far a unit is from being used.
    pub(crate) fn readiness(&self, name: &str) -> Readiness<'_> {
        match self.units.get(name) {
            Some(Unit::Here(unit)) => Readiness::Ready(unit),
            Some(Unit::Refused(reason)) => Readiness::Refused(reason),
            Some(Unit::Coming(_)) | None => Readiness::Loading,
        }
    }

    /// Has all units loaded again: their files may have changed.
    pub(crate) fn forget(&mut self) {
        self.units.clear();
    }

    /// Has one unit loaded again before it is used.
    pub(crate) fn put_away(&mut self, name: &str) {
        self.units.remove(name);
    }

    /// Does not use a unit until it is switched on.
    pub(crate) fn avoid(&mut self, id: String) {
        self.avoided.push(id);
    }

    /// Uses a unit again that was switched off.
    pub(crate) fn switch_on(&mut self, registry: &Registry, id: &str) {
        self.avoided.retain(|avoided| avoided != id);
        if let Ok(unit) = registry.find(self.kind, id) {
            self.conduct.switch_on(&unit);
        }
        self.units.clear();
    }

    /// How units that failed behave.
    pub(crate) fn failures(&self) -> Vec<UnitConduct> {
        let of = |record: &surfelshop_engine::plugins::Record| UnitConduct {
            renderer: record.unit.id.clone(),
            text: record.to_string(),
            off: record.standing == Standing::Off,
        };
        let avoided = self.avoided.iter().map(|id| UnitConduct {
            renderer: id.clone(),
            text: "not used, since it was at work when the program crashed".to_owned(),
            off: true,
        });
        self.conduct.records().iter().map(of).chain(avoided).collect()
    }
}
