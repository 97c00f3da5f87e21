//! Undo and redo of settings and clouds, in bounded memory.
//!
//! Clouds share their columns, and of those that changed a step holds what differs from the step beside, where that is
//! known: undo makes the same columns again, with their generations, not others like them.

use super::open_clouds::OpenClouds;
use super::packed_clouds::PackedClouds;
use super::settings::Settings;
use std::collections::{HashMap, HashSet, VecDeque};
use surfelshop_session::options::UpAxis;

/// Most steps.
const MOST_STEPS: usize = 200;

/// Most bytes of columns that only the steps hold.
pub(crate) const MOST_BYTES: u64 = 1 << 30;

/// The state that a step covers.
#[derive(Clone, PartialEq)]
pub(crate) struct Snapshot {
    pub(crate) settings: Settings,
    pub(crate) up: UpAxis,
    pub(crate) open_clouds: Option<OpenClouds>,
}

/// A state, whole or as what differs from the one beside it.
enum Step {
    Whole(Snapshot),
    Packed(Settings, UpAxis, PackedClouds),
}

impl Step {
    /// A state beside another one, from which it will be made again.
    fn beside(state: Snapshot, base: &Snapshot) -> Self {
        let both = state.open_clouds.as_ref().zip(base.open_clouds.as_ref());
        match both.and_then(|(clouds, base)| PackedClouds::between(clouds, base)) {
            Some(packed) => Self::Packed(state.settings, state.up, packed),
            None => Self::Whole(state),
        }
    }

    /// The state, from the one that it was beside; `None` where there is no memory.
    fn state(&self, base: &Snapshot) -> Option<Snapshot> {
        match self {
            Self::Whole(state) => Some(state.clone()),
            Self::Packed(settings, up, packed) => {
                let open_clouds = Some(packed.unpacked(base.open_clouds.as_ref()?)?);
                Some(Snapshot { settings: settings.clone(), up: *up, open_clouds })
            }
        }
    }

    /// Generation and bytes of the columns that it has whole.
    fn columns(&self) -> Vec<(u64, u64)> {
        match self {
            Self::Whole(state) => {
                let clouds = state.open_clouds.iter();
                clouds.flat_map(|clouds| clouds.columns().collect::<Vec<_>>()).collect()
            }
            Self::Packed(.., packed) => packed.columns().collect(),
        }
    }

    /// Bytes of what differs.
    fn patch_bytes(&self) -> u64 {
        match self {
            Self::Whole(_) => 0,
            Self::Packed(.., packed) => packed.patch_bytes(),
        }
    }
}

/// The steps.
pub(crate) struct History {
    /// The state that was recorded last.
    last: Option<Snapshot>,
    /// The states before it, oldest first, each beside the one behind it.
    undos: VecDeque<Step>,
    /// Undone states, the next to redo last, each beside the one behind it; the last one beside the present.
    redos: Vec<Step>,
    pub(crate) most_bytes: u64,
}

impl Default for History {
    fn default() -> Self {
        let (last, undos, redos) = Default::default();
        Self { last, undos, redos, most_bytes: MOST_BYTES }
    }
}

impl History {
    /// Drops all steps.
    pub(crate) fn clear(&mut self) {
        self.last = None;
        self.undos.clear();
        self.redos.clear();
    }

    /// Records the present state; a step where it differs from the last one.
    pub(crate) fn record(&mut self, now: &Snapshot) {
        if self.last.as_ref() == Some(now) {
            return;
        }
        if let Some(last) = self.last.replace(now.clone()) {
            self.undos.push_back(Step::beside(last, now));
        }
        self.redos.clear();
        while self.undos.len() >= MOST_STEPS {
            self.undos.pop_front();
        }
        self.trim(now);
    }

    /// Whether there is a step to undo.
    pub(crate) fn has_undo(&self, now: &Snapshot) -> bool {
        match &self.last {
            Some(last) if last == now => !self.undos.is_empty(),
            last => last.is_some(),
        }
    }

    /// Whether there is a step to redo.
    pub(crate) fn has_redo(&self, now: &Snapshot) -> bool {
        !self.redos.is_empty() && self.last.as_ref() == Some(now)
    }

    /// Undoes a step; nothing changes where there is no memory for it.
    pub(crate) fn undo(&mut self, now: &Snapshot) -> Option<Snapshot> {
        if !self.has_undo(now) {
            return None;
        }
        let last = self.last.as_ref()?;
        let before = match last == now {
            true => {
                let before = self.undos.back()?.state(last)?;
                self.undos.pop_back();
                before
            }
            // What changed since was not recorded.
            false => last.clone(),
        };
        // The present state: clouds may have been saved since it was recorded.
        self.redos.push(Step::beside(now.clone(), &before));
        self.last = Some(before.clone());
        self.trim(&before);
        Some(before)
    }

    /// Redoes a step; nothing changes where there is no memory for it.
    pub(crate) fn redo(&mut self, now: &Snapshot) -> Option<Snapshot> {
        if !self.has_redo(now) {
            return None;
        }
        let next = self.redos.last()?.state(self.last.as_ref()?)?;
        self.redos.pop();
        if let Some(last) = self.last.replace(next.clone()) {
            self.undos.push_back(Step::beside(last, &next));
        }
        self.trim(&next);
        Some(next)
    }

    /// Bytes of columns, and of what differs in columns, that only the steps hold.
    pub(crate) fn bytes(&self, now: &Snapshot) -> u64 {
        let of = |state: &Snapshot| Step::Whole(state.clone()).columns();
        let held: HashSet<u64> = of(now).into_iter().map(|(generation, _)| generation).collect();
        let steps = || self.undos.iter().chain(&self.redos);
        let last = self.last.iter().flat_map(of);
        let lengths: HashMap<u64, u64> = steps().flat_map(Step::columns).chain(last).collect();
        let whole = lengths.iter().filter(|(generation, _)| !held.contains(generation));
        whole.map(|(_, n)| n).sum::<u64>() + steps().map(Step::patch_bytes).sum::<u64>()
    }

    /// Drops steps until their columns fit into the memory bound: the oldest first, then those farthest
    /// ahead.
    fn trim(&mut self, now: &Snapshot) {
        while self.bytes(now) > self.most_bytes {
            if self.undos.pop_front().is_some() {
                continue;
            }
            if self.redos.is_empty() {
                return;
            }
            self.redos.remove(0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_cloud::selection::{Selection, with_value};
    use surfelshop_cloud::{Buffer, Cloud, Column, Loaded, Summary};
    use surfelshop_session::input::clouds::Clouds;

    /// Surfels of the cloud, and of a stroke.
    const N: usize = 40_000;
    const STROKE: usize = 500;

    fn state(cloud: Cloud) -> Snapshot {
        let loaded = Loaded { cloud, summary: Summary::default() };
        let open_clouds = OpenClouds::read(Clouds::of(vec![loaded]), &[0]);
        Snapshot { settings: Settings::default(), up: UpAxis::Y, open_clouds: Some(open_clouds) }
    }

    fn cloud_of(state: &Snapshot) -> Cloud {
        state.open_clouds.as_ref().unwrap().all()[0].loaded.cloud.clone()
    }

    /// Invariant: undo of 100 strokes restores bit-identical columns, and takes as much memory as the strokes changed
    #[test]
    fn undo_of_a_hundred_strokes_restores_every_bit_in_the_memory_of_what_changed() {
        let position: Vec<f32> = (0..3 * N).map(|i| (i % 1013) as f32).collect();
        let columns = vec![
            Column::new("position", 3, Buffer::F32(position)),
            Column::new("class", 1, Buffer::F32((0..N).map(|i| i as f32).collect())),
        ];
        let mut states = vec![state(Cloud::new(glam::DVec3::ZERO, columns).unwrap())];
        let mut history = History::default();
        history.record(&states[0]);
        for stroke in 0..100 {
            let first = stroke * 311 % (N - STROKE);
            let chosen = Selection::of(N, |i| (first..first + STROKE).contains(&i)).unwrap();
            let before = cloud_of(states.last().unwrap());
            let after = with_value(&before, &chosen, "class", &[stroke as f64 + 0.25]).unwrap();
            let open_clouds = states.last().unwrap().open_clouds.as_ref().unwrap();
            let open_clouds = Some(open_clouds.edited(0, after));
            let next = Snapshot { settings: Settings::default(), up: UpAxis::Y, open_clouds };
            history.record(&next);
            states.push(next);
        }
        let now = states.last().unwrap().clone();
        // Each surfel's number and its value.
        assert_eq!(history.bytes(&now), 100 * STROKE as u64 * 8);
        let same = |a: &Snapshot, b: &Snapshot| {
            assert!(a == b, "the same generations");
            let (a, b) = (cloud_of(a), cloud_of(b));
            for (a, b) in a.columns().iter().zip(b.columns()) {
                assert_eq!((a.generation(), a.values()), (b.generation(), b.values()));
            }
        };
        let mut at = now;
        for expected in states.iter().rev().skip(1) {
            at = history.undo(&at).unwrap();
            same(&at, expected);
        }
        assert!(!history.has_undo(&at));
        for expected in &states[1..] {
            at = history.redo(&at).unwrap();
            same(&at, expected);
        }
        assert!(!history.has_redo(&at));
        // With less memory the oldest steps go, and the others stay whole.
        history.most_bytes = 10 * STROKE as u64 * 8;
        history.trim(&at);
        for expected in states.iter().rev().skip(1).take(10) {
            at = history.undo(&at).unwrap();
            same(&at, expected);
        }
        assert!(!history.has_undo(&at));
    }
}
