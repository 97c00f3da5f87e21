//! How plugins have behaved, and which of them are not used for it.
//!
//! A unit that fails [`STRIKES`] times in a row is switched off, one that does not answer at once:
//! each missed deadline costs a thread and the user's time. It stays off until its file has other
//! contents or the user switches it on again.

use crate::boundary::Fault;
use crate::plugins::find::UnitRef;
use crate::plugins::inspect::Contents;
use std::fmt;

/// Failures in a row that switch a unit off.
pub const STRIKES: u32 = 3;

/// Whether a unit is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnitState {
    /// It did well the last time.
    Good,
    /// It failed this often in a row and is used on.
    Failing(u32),
    /// It is not used.
    Off,
}

/// What is known of a unit that failed at least once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// The unit.
    pub unit: UnitRef,
    /// Whether it is used.
    pub standing: UnitState,
    /// How it failed the last time.
    pub last: Fault,
    /// The file that failed.
    contents: Contents,
}

impl fmt::Display for Record {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let last = &self.last;
        match self.standing {
            UnitState::Good => write!(f, "works; earlier: {last}"),
            UnitState::Failing(1) => write!(f, "failed: {last}"),
            UnitState::Failing(n) => write!(f, "failed {n} times in a row: {last}"),
            UnitState::Off => write!(f, "switched off: {last}"),
        }
    }
}

/// Why a unit is not used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{unit} is switched off until its file changes or you switch it on again: {last}")]
pub struct Disabled {
    /// The unit.
    pub unit: Box<UnitRef>,
    /// How it failed the last time.
    pub last: Fault,
}

/// The conduct of all units of a program.
#[derive(Clone, Debug, Default)]
pub struct PluginHealth {
    records: Vec<Record>,
}

impl PluginHealth {
    /// Asks whether a unit may be loaded or used. Reads the file of a unit that is switched off,
    /// to see whether it has changed.
    ///
    /// # Errors
    /// Where the unit is switched off; says why.
    pub fn check(&self, unit: &UnitRef) -> Result<(), Disabled> {
        match self.record(unit) {
            Some(Record { standing: UnitState::Off, last, contents, .. })
                if *contents == Contents::of_file(&unit.path) =>
            {
                Err(Disabled { unit: Box::new(unit.clone()), last: last.clone() })
            }
            _ => Ok(()),
        }
    }

    /// Takes down a failure. `contents` are those of the loaded unit, or of its file as it is
    /// where it could not be loaded.
    pub fn failed(&mut self, unit: &UnitRef, contents: Contents, fault: &Fault) -> UnitState {
        let known = self.records.iter().position(|record| record.unit == *unit);
        // What was not asked did nothing wrong by that.
        if matches!(fault, Fault::NotAsked(_)) {
            return known.map_or(UnitState::Good, |i| self.records[i].standing);
        }
        let earlier = match known.map(|i| &self.records[i]) {
            Some(record) if record.contents == contents => record.standing,
            _ => UnitState::Good,
        };
        let standing = match (earlier, fault) {
            (UnitState::Off, _) | (_, Fault::TimedOut(_)) => UnitState::Off,
            (UnitState::Failing(n), _) if n + 1 >= STRIKES => UnitState::Off,
            (UnitState::Failing(n), _) => UnitState::Failing(n + 1),
            (UnitState::Good, _) => UnitState::Failing(1),
        };
        let record = Record { unit: unit.clone(), standing, last: fault.clone(), contents };
        match known {
            Some(i) => self.records[i] = record,
            None => self.records.push(record),
        }
        standing
    }

    /// Takes down that a unit did what it was asked for.
    ///
    /// An instance that was at work when another one of its unit hung does not redeem the unit.
    pub fn succeeded(&mut self, unit: &UnitRef, contents: Contents) {
        if let Some(record) = self.record_mut(unit)
            && (record.contents != contents || record.standing != UnitState::Off)
        {
            record.standing = UnitState::Good;
            record.contents = contents;
        }
    }

    /// Switches a unit on again.
    pub fn switch_on(&mut self, unit: &UnitRef) {
        if let Some(record) = self.record_mut(unit) {
            record.standing = UnitState::Good;
        }
    }

    /// What is known of a unit; nothing where it never failed.
    #[must_use]
    pub fn record(&self, unit: &UnitRef) -> Option<&Record> {
        self.records.iter().find(|record| record.unit == *unit)
    }

    /// Every unit that failed, in the order of first failures.
    #[must_use]
    pub fn records(&self) -> &[Record] {
        &self.records
    }

    fn record_mut(&mut self, unit: &UnitRef) -> Option<&mut Record> {
        self.records.iter_mut().find(|record| record.unit == *unit)
    }
}
