//! What is measured, or measured against.

use super::{Stamp, stamp};
use crate::compare::random;
use surfelshop_api::params::{ParamDecl, Value, Values};
use surfelshop_runtime::plugins::{LoadedUnit, Timeouts, UnitRef};
use surfelshop_session::session;

/// A unit in memory: the same build of it from the first run to the last.
#[derive(Clone)]
pub(super) struct Subject {
    pub(super) reference: UnitRef,
    pub(super) unit: LoadedUnit,
}

impl Subject {
    pub(super) fn load(reference: &UnitRef, patience: &Timeouts) -> anyhow::Result<Self> {
        let unit = session::load(reference, patience)?;
        Ok(Self { reference: reference.clone(), unit })
    }

    pub(super) fn declared(&self) -> &[ParamDecl] {
        &self.unit.description.params
    }

    /// Where its random numbers begin, where it says.
    pub(super) fn seed(&self, values: &Values) -> Option<Value> {
        random::seed(self.declared(), values)
    }

    /// What tells it from the same one rebuilt.
    pub(super) fn stamp(&self) -> anyhow::Result<(String, Stamp)> {
        Ok((self.reference.to_string(), stamp(&self.reference.path)?))
    }
}
