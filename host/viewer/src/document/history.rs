//! Undo and redo of settings and clouds, in bounded memory.
//!
//! Clouds share their columns, so that a step holds what it replaced. Undo restores the same columns,
//! not copies.

use super::open_clouds::OpenClouds;
use super::settings::Settings;
use std::collections::{HashMap, HashSet, VecDeque};

/// Most steps.
const MOST_STEPS: usize = 200;

/// Most bytes of columns that only the steps hold.
pub(crate) const MOST_BYTES: u64 = 1 << 30;

/// The state that a step covers.
#[derive(Clone, PartialEq)]
pub(crate) struct Snapshot {
    pub(crate) settings: Settings,
    pub(crate) open_clouds: Option<OpenClouds>,
}

/// The steps.
pub(crate) struct History {
    /// Past states, oldest first; the last one was recorded last.
    undos: VecDeque<Snapshot>,
    /// Undone states, the next to redo last.
    redos: Vec<Snapshot>,
    pub(crate) most_bytes: u64,
}

impl Default for History {
    fn default() -> Self {
        Self { undos: VecDeque::new(), redos: Vec::new(), most_bytes: MOST_BYTES }
    }
}

impl History {
    /// Drops all steps.
    pub(crate) fn clear(&mut self) {
        self.undos.clear();
        self.redos.clear();
    }

    /// Records the present state; a step where it differs from the last one.
    pub(crate) fn record(&mut self, now: &Snapshot) {
        if self.undos.back() == Some(now) {
            return;
        }
        self.undos.push_back(now.clone());
        self.redos.clear();
        while self.undos.len() > MOST_STEPS {
            self.undos.pop_front();
        }
        self.trim(now);
    }

    /// Whether there is a step to undo.
    pub(crate) fn has_undo(&self, now: &Snapshot) -> bool {
        match self.undos.back() {
            Some(last) if last == now => self.undos.len() > 1,
            last => last.is_some(),
        }
    }

    /// Whether there is a step to redo.
    pub(crate) fn has_redo(&self, now: &Snapshot) -> bool {
        !self.redos.is_empty() && self.undos.back() == Some(now)
    }

    /// Undoes a step.
    pub(crate) fn undo(&mut self, now: &Snapshot) -> Option<Snapshot> {
        if !self.has_undo(now) {
            return None;
        }
        if self.undos.back() == Some(now) {
            self.undos.pop_back();
        }
        // The present state: clouds may have been saved since it was recorded.
        self.redos.push(now.clone());
        let before = self.undos.back().cloned()?;
        self.trim(&before);
        Some(before)
    }

    /// Redoes a step.
    pub(crate) fn redo(&mut self, now: &Snapshot) -> Option<Snapshot> {
        if !self.has_redo(now) {
            return None;
        }
        let next = self.redos.pop()?;
        self.undos.push_back(next.clone());
        self.trim(&next);
        Some(next)
    }

    /// Bytes of columns that only the steps hold.
    pub(crate) fn bytes(&self, now: &Snapshot) -> u64 {
        let columns = |state: &Snapshot| {
            state
                .open_clouds
                .iter()
                .flat_map(|open_clouds| open_clouds.columns().collect::<Vec<_>>())
                .collect::<Vec<_>>()
        };
        let held: HashSet<u64> =
            columns(now).into_iter().map(|(generation, _)| generation).collect();
        let lengths: HashMap<u64, u64> =
            self.undos.iter().chain(&self.redos).flat_map(columns).collect();
        lengths.iter().filter(|(generation, _)| !held.contains(generation)).map(|(_, n)| n).sum()
    }

    /// Drops steps until their columns fit into the memory bound: the oldest first, then those farthest
    /// ahead.
    fn trim(&mut self, now: &Snapshot) {
        while self.bytes(now) > self.most_bytes {
            if self.undos.len() > 1 {
                self.undos.pop_front();
            } else if !self.redos.is_empty() {
                self.redos.remove(0);
            } else {
                return;
            }
        }
    }
}
