//! Checks plugins, also third parties': against scenes whose pictures are known, at the ends of their
//! parameters, on clouds that are hard, and for what must not change anything.
//!
//! Every case is generated, is the same on every run, and has an oracle (rays cast in f64, a known
//! answer) or a symmetry (a scene that is moved looks as before). What a unit cannot do it declares with
//! its reason ([`surfelshop_api::Limit`]); that is shown and is no failure.
//!
//! Invariants: a case takes seconds; a unit that does not answer is not asked again; nothing here knows
//! any plugin.

pub mod cast;
pub mod clouds;
mod hard;
mod renderers;
mod tools;
mod tracers;
mod verdict;

pub use verdict::{Case, Outcome, Verdict};

use surfelshop_api::UnitKind;
use surfelshop_render::{Engine, EngineOptions, GpuOptions};
use surfelshop_runtime::plugins::{LoadedUnit, Timeouts};

/// What units are checked with.
pub struct Setup<'a> {
    /// Makes an engine of these options, or says in a line why there is none.
    pub engine: &'a dyn Fn(&EngineOptions) -> Result<Engine, String>,
    /// The device for tools' own graphs.
    pub device: GpuOptions,
    /// How long units are waited for.
    pub patience: Timeouts,
}

/// All cases of a kind of unit, in the order in which they run.
#[must_use]
pub fn cases(kind: UnitKind) -> Vec<Case> {
    match kind {
        UnitKind::Renderer => renderers::cases(),
        UnitKind::Tracer => tracers::cases(),
        UnitKind::Tool => tools::cases(),
        UnitKind::Format => Vec::new(),
    }
}

/// Runs the cases of a unit that are wanted; `tell` hears of each as it ends and says whether to go on.
///
/// # Errors
/// Where a renderer is to be checked and there is no engine.
pub fn check(
    unit: &LoadedUnit,
    setup: &Setup<'_>,
    wanted: &dyn Fn(&Case) -> bool,
    tell: &mut dyn FnMut(&Outcome) -> bool,
) -> Result<Vec<Outcome>, String> {
    match unit.unit.kind {
        UnitKind::Renderer => renderers::check(unit, setup, wanted, tell),
        UnitKind::Tracer => Ok(tracers::check(unit, setup, wanted, tell)),
        UnitKind::Tool => Ok(tools::check(unit, setup, wanted, tell)),
        UnitKind::Format => Ok(Vec::new()),
    }
}
