//! How much is drawn while something moves.

use std::time::Duration;
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

/// And where a whole frame takes long: ten a second still follow the hand, and show more.
const MOST_MS: f64 = 100.0;

/// Such a frame takes at most so many times as long as one in motion may, between these two.
const SHORTER: f64 = 4.0;

/// Time without a change after which a view is drawn in full detail.
const STILL: Duration = Duration::from_millis(150);

/// And where that takes so long that a hand which only paused would wait for it.
const LONGEST_STILL: Duration = Duration::from_millis(500);

/// Finds the detail at which frames keep within the budget.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Governor {
    /// Position in the ladder.
    step: usize,
    /// What the last whole frame took, milliseconds; 0 where there was none.
    whole_ms: f64,
}

impl Governor {
    /// The detail for the next frame in motion.
    pub(crate) fn detail(self) -> Detail {
        LADDER[self.step]
    }

    /// Milliseconds a frame may take while something moves.
    fn budget_ms(self) -> f64 {
        (self.whole_ms / SHORTER).clamp(BUDGET_MS, MOST_MS)
    }

    /// Time without a change after which the whole is drawn: at least half of what that takes, within
    /// bounds.
    pub(crate) fn still(self) -> Duration {
        Duration::from_secs_f64(0.5e-3 * self.whole_ms.min(1e6)).clamp(STILL, LONGEST_STILL)
    }

    /// Learns what a whole frame takes, where one was drawn; the detail stays.
    pub(crate) fn learn_whole(&mut self, drawn: Detail, milliseconds: f64) {
        if drawn.is_full() && milliseconds > 0.0 {
            self.whole_ms = milliseconds;
        }
    }

    /// Learns from a frame: down as many steps as it took doublings of the budget, or up one where
    /// that leaves room for a frame that takes twice as long.
    pub(crate) fn learn(&mut self, drawn: Detail, milliseconds: f64) {
        self.learn_whole(drawn, milliseconds);
        let over = milliseconds / self.budget_ms();
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

    /// A renderer that takes so long for all surfels and for all pixels, and 5 ms: where it ends, how long
    /// that takes, and how long it may.
    fn settles(surfels: f64, pixels: f64) -> (Detail, f64, f64) {
        let mut governor = Governor::default();
        let time = |detail: Detail| {
            let share = 1.0 / f64::from(detail.coarseness * detail.coarseness);
            5.0 + surfels / f64::from(detail.stride) + pixels * share
        };
        for _ in 0..40 {
            let detail = governor.detail();
            governor.learn(detail, time(detail));
        }
        (governor.detail(), time(governor.detail()), governor.budget_ms())
    }

    #[test]
    fn fast_frames_keep_everything() {
        assert_eq!(settles(10.0, 5.0).0, Detail::FULL);
    }

    #[test]
    fn slow_frames_are_brought_within_the_budget() {
        for (surfels, pixels) in [(60.0, 5.0), (150.0, 10.0), (300.0, 30.0), (500.0, 30.0)] {
            let (detail, time, budget) = settles(surfels, pixels);
            assert!(time <= budget && detail.coarseness == 1, "{detail:?}: {time} of {budget}");
        }
        for (surfels, pixels) in [(300.0, 100.0), (1000.0, 300.0), (100.0, 300.0)] {
            let (detail, time, budget) = settles(surfels, pixels);
            assert!(time <= budget && detail.coarseness > 1, "{detail:?}: {time} of {budget}");
        }
        // What is too slow for every detail ends at the coarsest.
        assert_eq!(settles(1e6, 1e6).0, LADDER[LADDER.len() - 1]);
    }

    #[test]
    fn what_takes_long_may_take_longer_in_motion_and_is_waited_for() {
        let after = |whole_ms| {
            let mut governor = Governor::default();
            governor.learn(Detail::FULL, whole_ms);
            (governor.budget_ms(), governor.still().as_millis())
        };
        assert_eq!(Governor::default().still(), STILL);
        assert_eq!(after(20.0), (40.0, 150));
        assert_eq!(after(240.0), (60.0, 150));
        assert_eq!(after(800.0), (100.0, 400));
        assert_eq!(after(9000.0), (100.0, 500));
        // What cannot be is no time.
        assert_eq!(after(f64::NAN), (40.0, 150));
        assert_eq!(after(f64::INFINITY).1, 500);
    }

    #[test]
    fn a_still_frame_brings_detail_down_and_never_up() {
        let mut governor = Governor::default();
        governor.learn(Detail::FULL, 5000.0);
        let after = governor.detail();
        assert!(after.coarseness > 1, "{after:?}");
        governor.learn(Detail::FULL, 20.0);
        assert_eq!(governor.detail(), after);
        governor.learn(after, 10.0);
        assert_ne!(governor.detail(), after);
    }
}
