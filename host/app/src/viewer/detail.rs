//! How much is drawn while something moves.

use surfelshop_api::View;

/// A share of the surfels and of the pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Detail {
    /// One surfel of so many is drawn, along the curve that they lie on in memory.
    pub(crate) stride: u32,
    /// Pixels of the window per pixel drawn, in each direction.
    pub(crate) coarseness: u32,
}

impl Detail {
    /// Everything.
    pub(crate) const FULL: Self = Self { stride: 1, coarseness: 1 };

    /// Whether this is everything.
    pub(crate) fn is_full(self) -> bool {
        self == Self::FULL
    }

    /// The view as drawn.
    pub(crate) fn view(self, view: View) -> View {
        let size_px = view.size_px.map(|side| side.div_ceil(self.coarseness).max(1));
        View { size_px, ..view }
    }

    /// In a few words, for the status line.
    pub(crate) fn describe(self) -> String {
        match (self.stride, self.coarseness) {
            (1, 1) => "full detail".to_owned(),
            (stride, 1) => format!("1 surfel of {stride}"),
            (stride, coarseness) => {
                format!("1 surfel of {stride}, 1 pixel of {}", coarseness * coarseness)
            }
        }
    }
}

/// From the whole to the coarsest: fewer surfels first, since their number rules the time on
/// software drivers; from one of eight on it is the pixels that they cover, since fewer ones are
/// larger. One of 64 still shows what the object is.
const LADDER: [Detail; 10] = [
    Detail::FULL,
    Detail { stride: 2, coarseness: 1 },
    Detail { stride: 4, coarseness: 1 },
    Detail { stride: 8, coarseness: 1 },
    Detail { stride: 8, coarseness: 2 },
    Detail { stride: 16, coarseness: 2 },
    Detail { stride: 16, coarseness: 3 },
    Detail { stride: 32, coarseness: 3 },
    Detail { stride: 32, coarseness: 4 },
    Detail { stride: 64, coarseness: 4 },
];

/// Milliseconds a frame may take while something moves: 25 a second, which leaves room for the
/// window's own work at 15.
const BUDGET_MS: f64 = 40.0;

/// Finds the detail at which frames keep within the budget.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Governor {
    /// Position in the ladder.
    step: usize,
}

impl Governor {
    /// The detail for the next frame in motion.
    pub(crate) fn detail(self) -> Detail {
        LADDER[self.step]
    }

    /// Learns from a frame: down as many steps as it took doublings of the budget, or up one where
    /// that leaves room for a frame that takes twice as long.
    pub(crate) fn learn(&mut self, drawn: Detail, milliseconds: f64) {
        let over = milliseconds / BUDGET_MS;
        if drawn != self.detail() && !(drawn.is_full() && over > 1.0) {
            return;
        }
        let step = LADDER.iter().position(|detail| *detail == drawn).unwrap_or(self.step);
        if over > 1.0 {
            let steps = over.log2().ceil().clamp(1.0, LADDER.len() as f64) as usize;
            // What was found to be enough in motion is not unlearned by a still frame.
            self.step = (step + steps).min(LADDER.len() - 1).max(self.step);
        } else if over < 0.45 {
            self.step = step.saturating_sub(1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A renderer that takes so long for all surfels and for all pixels, and 5 ms.
    fn settles(surfels: f64, pixels: f64) -> (Detail, f64) {
        let mut governor = Governor::default();
        let time = |detail: Detail| {
            let share = 1.0 / f64::from(detail.coarseness * detail.coarseness);
            5.0 + surfels / f64::from(detail.stride) + pixels * share
        };
        for _ in 0..40 {
            let detail = governor.detail();
            governor.learn(detail, time(detail));
        }
        (governor.detail(), time(governor.detail()))
    }

    #[test]
    fn fast_frames_keep_everything() {
        assert_eq!(settles(10.0, 5.0).0, Detail::FULL);
    }

    #[test]
    fn slow_frames_are_brought_within_the_budget() {
        for (surfels, pixels) in [(60.0, 5.0), (150.0, 10.0)] {
            let (detail, time) = settles(surfels, pixels);
            assert!(time <= BUDGET_MS && detail.coarseness == 1, "{detail:?}: {time}");
        }
        for (surfels, pixels) in [(300.0, 100.0), (1000.0, 100.0), (100.0, 300.0)] {
            let (detail, time) = settles(surfels, pixels);
            assert!(time <= BUDGET_MS && detail.coarseness > 1, "{detail:?}: {time}");
        }
        // What is too slow for every detail ends at the coarsest.
        assert_eq!(settles(1e6, 1e6).0, LADDER[LADDER.len() - 1]);
    }

    #[test]
    fn a_still_frame_brings_detail_down_and_never_up() {
        let mut governor = Governor::default();
        governor.learn(Detail::FULL, 700.0);
        let after = governor.detail();
        assert!(after.coarseness > 1, "{after:?}");
        governor.learn(Detail::FULL, 20.0);
        assert_eq!(governor.detail(), after);
        governor.learn(after, 10.0);
        assert_ne!(governor.detail(), after);
    }
}
