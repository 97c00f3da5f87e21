//! The state of measurements.

use super::form::Form;
use super::measurement::{Measurement, Pending};
use super::plan::{Basis, Kind};
use crate::plugins::UnitLoader;
use crate::render_thread::mark_abandoned;
use std::sync::Arc;
use surfelshop_api::UnitKind;
use surfelshop_evaluate::compare::Truth;
use surfelshop_runtime::plugins::Timeouts;
use surfelshop_session::options::PluginFiles;

/// The last measurement of each kind, of which at most one runs.
pub(crate) struct Measure {
    pub(crate) form: Form,
    pub(crate) current_view: Option<Measurement>,
    pub(crate) series: Option<Measurement>,
    /// The tracers.
    pub(crate) units: UnitLoader,
    /// How often a changed plugin or file had pictures redrawn.
    pub(crate) n_redrawn: u64,
    /// The last reference, with the basis that it depends on.
    pub(super) known: Option<(Basis, Arc<Truth>)>,
    pub(super) timeouts: Timeouts,
}

impl Measure {
    pub(crate) fn new(plugins: &PluginFiles) -> Self {
        let timeouts = plugins.patience();
        Self {
            form: Form::default(),
            current_view: None,
            series: None,
            units: UnitLoader::new(UnitKind::Tracer, timeouts),
            n_redrawn: 0,
            known: None,
            timeouts,
        }
    }

    /// The last measurement of a kind.
    pub(crate) fn of(&self, kind: Kind) -> Option<&Measurement> {
        match kind {
            Kind::CurrentView => self.current_view.as_ref(),
            Kind::Series => self.series.as_ref(),
        }
    }

    /// The running one.
    pub(super) fn running(&mut self) -> Option<&mut Measurement> {
        [&mut self.current_view, &mut self.series]
            .into_iter()
            .flatten()
            .find(|one| one.is_running())
    }

    /// Whether one runs.
    pub(crate) fn is_busy(&self) -> bool {
        [&self.current_view, &self.series].into_iter().flatten().any(Measurement::is_running)
    }

    fn is_tracing(&self) -> bool {
        let all = [&self.current_view, &self.series].into_iter().flatten();
        all.filter_map(|one| one.pending()).any(|what| matches!(what, Pending::Tracer(_)))
    }
}

impl Drop for Measure {
    /// The end of the program must not wait for a running tracer.
    fn drop(&mut self) {
        if self.is_tracing() {
            mark_abandoned();
        }
    }
}
