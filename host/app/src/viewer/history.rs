//! Undo and redo of settings and clouds, in bounded memory.
//!
//! Clouds share their columns, so a step costs what it replaced. A step back brings the very same
//! columns back, not copies.

use super::settings::Settings;
use super::stock::Stock;
use std::collections::{HashMap, HashSet, VecDeque};

/// Most steps.
const MOST_STEPS: usize = 200;

/// Most bytes of columns that are kept for undo and redo alone.
pub(crate) const MOST_BYTES: u64 = 1 << 30;

/// What a step covers.
#[derive(Clone, PartialEq)]
pub(crate) struct State {
    pub(crate) settings: Settings,
    pub(crate) stock: Option<Stock>,
}

/// The steps.
pub(crate) struct History {
    /// What was, oldest first; the last is what was fed last.
    undos: VecDeque<State>,
    /// What was undone, the next to come back last.
    redos: Vec<State>,
    pub(crate) most_bytes: u64,
}

impl Default for History {
    fn default() -> Self {
        Self { undos: VecDeque::new(), redos: Vec::new(), most_bytes: MOST_BYTES }
    }
}

impl History {
    /// Forgets all steps; what is fed next is the first thing to go back to.
    pub(crate) fn begin_anew(&mut self) {
        self.undos.clear();
        self.redos.clear();
    }

    /// Takes what is now; a step where it differs from what was.
    pub(crate) fn feed(&mut self, now: &State) {
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

    /// Whether there is something to undo.
    pub(crate) fn has_undo(&self, now: &State) -> bool {
        match self.undos.back() {
            Some(last) if last == now => self.undos.len() > 1,
            last => last.is_some(),
        }
    }

    /// Whether there is something to redo.
    pub(crate) fn has_redo(&self, now: &State) -> bool {
        !self.redos.is_empty() && self.undos.back() == Some(now)
    }

    /// One step back.
    pub(crate) fn undo(&mut self, now: &State) -> Option<State> {
        if !self.has_undo(now) {
            return None;
        }
        if self.undos.back() == Some(now) {
            self.undos.pop_back();
        }
        // As it is now: it may have been saved since it was fed.
        self.redos.push(now.clone());
        let before = self.undos.back().cloned()?;
        self.trim(&before);
        Some(before)
    }

    /// One step forward.
    pub(crate) fn redo(&mut self, now: &State) -> Option<State> {
        if !self.has_redo(now) {
            return None;
        }
        let next = self.redos.pop()?;
        self.undos.push_back(next.clone());
        self.trim(&next);
        Some(next)
    }

    /// Bytes of columns that nothing but the steps holds.
    pub(crate) fn bytes(&self, now: &State) -> u64 {
        let columns = |state: &State| {
            state
                .stock
                .iter()
                .flat_map(|stock| stock.columns().collect::<Vec<_>>())
                .collect::<Vec<_>>()
        };
        let held: HashSet<u64> =
            columns(now).into_iter().map(|(generation, _)| generation).collect();
        let kept: HashMap<u64, u64> =
            self.undos.iter().chain(&self.redos).flat_map(columns).collect();
        kept.iter().filter(|(generation, _)| !held.contains(generation)).map(|(_, n)| n).sum()
    }

    /// Lets steps go until their columns take no more memory than they may: the oldest first, then
    /// those farthest ahead.
    fn trim(&mut self, now: &State) {
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
