//! The level of detail of pictures in motion.

use std::time::Duration;
use surfelshop_api::View;

/// A share of the surfels and of the pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Detail {
    /// One surfel of every `stride` is drawn, along the curve that orders them in memory.
    pub(crate) stride: u32,
    /// Pixels of the window per pixel drawn, in each direction.
    pub(crate) coarseness: u32,
}

impl Detail {
    /// All surfels and all pixels.
    pub(crate) const FULL: Self = Self { stride: 1, coarseness: 1 };

    /// Whether all surfels and pixels are drawn.
    pub(crate) fn is_full(self) -> bool {
        self == Self::FULL
    }

    /// The view with its size in drawn pixels.
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

/// The levels, finest first. Surfels go first, since their number dominates the time on software
/// drivers. From one of eight on the covered pixels dominate, since fewer surfels are larger. One of
/// 64 still shows what the object is.
const LEVELS: [Detail; 10] = [
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

/// Milliseconds a frame in motion may take: 25 frames a second, with the window's own work.
const BUDGET_MS: f64 = 36.0;

/// The bound where a full frame takes long: 15 frames a second still follow the hand and show more.
const LONGEST_MS: f64 = 62.0;

/// Between the two bounds a frame in motion may take this fraction of a full frame.
const FULL_FRAME_FRACTION: f64 = 8.0;

/// Where surfels are kept from one frame to the next, as while a light moves, a finer level costs one frame in which
/// they are drawn anew: up to so many milliseconds, half of what the hand notices.
const LONGEST_ANEW_MS: f64 = 75.0;

/// Time without a change after which full detail is drawn.
const STILL_DELAY: Duration = Duration::from_millis(150);

/// The longest such time, where full detail takes long and a pause of the hand must not start it.
const LONGEST_STILL_DELAY: Duration = Duration::from_millis(500);

/// Chooses the level of detail at which frames in motion stay within the time budget.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Governor {
    /// Index of the level.
    step: usize,
    /// Time of the last full frame, milliseconds; 0 before the first.
    full_frame_ms: f64,
    /// Time of the last frame of this level whose surfels were drawn, milliseconds; 0 before the first.
    anew_ms: f64,
    /// Whether the last frame had its surfels from before, and the level was made finer after it.
    refined_at_rest: bool,
}

impl Governor {
    /// The detail for the next frame in motion.
    pub(crate) fn detail(self) -> Detail {
        LEVELS[self.step]
    }

    /// Milliseconds a frame in motion may take.
    fn budget_ms(self) -> f64 {
        (self.full_frame_ms / FULL_FRAME_FRACTION).clamp(BUDGET_MS, LONGEST_MS)
    }

    /// Time without a change after which full detail is drawn: half the time of a full frame, within
    /// bounds.
    pub(crate) fn still_delay(self) -> Duration {
        Duration::from_secs_f64(0.5e-3 * self.full_frame_ms.min(1e6))
            .clamp(STILL_DELAY, LONGEST_STILL_DELAY)
    }

    /// Records the time of a full frame; the level stays.
    pub(crate) fn record_full_frame(&mut self, drawn: Detail, milliseconds: f64) {
        if drawn.is_full() && milliseconds > 0.0 {
            self.full_frame_ms = milliseconds;
        }
    }

    /// Adapts the level to a frame: coarser by one level for each doubling of the budget, or finer by one
    /// where a frame of twice the time would fit. `reused` says that its surfels are those of the frame before.
    pub(crate) fn adapt(&mut self, drawn: Detail, milliseconds: f64, reused: bool) {
        self.record_full_frame(drawn, milliseconds);
        let over = milliseconds / self.budget_ms();
        if drawn != self.detail() && !(drawn.is_full() && over > 1.0) {
            return;
        }
        let step = LEVELS.iter().position(|detail| *detail == drawn).unwrap_or(self.step);
        if !reused {
            self.anew_ms = milliseconds;
        }
        // The one frame that a finer level costs while surfels are kept.
        let was_expected = std::mem::take(&mut self.refined_at_rest) && !reused;
        let next = if over > 1.0 && !(was_expected && milliseconds < 2.0 * LONGEST_ANEW_MS) {
            let steps = over.log2().ceil().clamp(1.0, LEVELS.len() as f64) as usize;
            // A still frame never refines the level that motion has found.
            (step + steps).min(LEVELS.len() - 1).max(self.step)
        } else if over < 0.45 && !(reused && 2.0 * self.anew_ms > LONGEST_ANEW_MS) {
            self.refined_at_rest = reused;
            step.saturating_sub(1)
        } else {
            self.step
        };
        if next > self.step {
            // Coarser frames take less.
            self.anew_ms = 0.0;
        }
        self.step = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The final level of a renderer that takes 5 ms and these times for all surfels and all pixels, with
    /// its time and its budget.
    fn settles(surfels: f64, pixels: f64) -> (Detail, f64, f64) {
        let mut governor = Governor::default();
        let time = |detail: Detail| {
            let share = 1.0 / f64::from(detail.coarseness * detail.coarseness);
            5.0 + surfels / f64::from(detail.stride) + pixels * share
        };
        for _ in 0..40 {
            let detail = governor.detail();
            governor.adapt(detail, time(detail), false);
        }
        (governor.detail(), time(governor.detail()), governor.budget_ms())
    }

    #[test]
    fn fast_frames_keep_everything() {
        assert_eq!(settles(10.0, 5.0).0, Detail::FULL);
    }

    #[test]
    fn slow_frames_are_brought_within_the_budget() {
        for (surfels, pixels) in [(60.0, 5.0), (150.0, 10.0), (200.0, 5.0)] {
            let (detail, time, budget) = settles(surfels, pixels);
            assert!(time <= budget && detail.coarseness == 1, "{detail:?}: {time} of {budget}");
        }
        let coarser =
            [(300.0, 30.0), (500.0, 30.0), (300.0, 100.0), (1000.0, 300.0), (100.0, 300.0)];
        for (surfels, pixels) in coarser {
            let (detail, time, budget) = settles(surfels, pixels);
            assert!(time <= budget && detail.coarseness > 1, "{detail:?}: {time} of {budget}");
        }
        // A renderer that is too slow at every level ends at the coarsest.
        assert_eq!(settles(1e6, 1e6).0, LEVELS[LEVELS.len() - 1]);
    }

    #[test]
    fn what_takes_long_may_take_longer_in_motion_and_is_waited_for() {
        let after = |full_frame_ms| {
            let mut governor = Governor::default();
            governor.adapt(Detail::FULL, full_frame_ms, false);
            (governor.budget_ms(), governor.still_delay().as_millis())
        };
        assert_eq!(Governor::default().still_delay(), STILL_DELAY);
        assert_eq!(after(20.0), (36.0, 150));
        assert_eq!(after(240.0), (36.0, 150));
        assert_eq!(after(400.0), (50.0, 200));
        assert_eq!(after(800.0), (62.0, 400));
        assert_eq!(after(9000.0), (62.0, 500));
        // An impossible time is ignored.
        assert_eq!(after(f64::NAN), (36.0, 150));
        assert_eq!(after(f64::INFINITY).1, 500);
    }

    #[test]
    fn a_still_frame_brings_detail_down_and_never_up() {
        let mut governor = Governor::default();
        governor.adapt(Detail::FULL, 5000.0, false);
        let after = governor.detail();
        assert!(after.coarseness > 1, "{after:?}");
        governor.adapt(Detail::FULL, 20.0, false);
        assert_eq!(governor.detail(), after);
        governor.adapt(after, 10.0, false);
        assert_ne!(governor.detail(), after);
    }

    #[test]
    fn kept_surfels_are_refined_as_far_as_drawing_them_once_is_not_noticed() {
        // A light moves: 5 ms where surfels are kept, and 240 ms for all of them.
        let mut governor = Governor::default();
        let drawn = |detail: Detail| 5.0 + 240.0 / f64::from(detail.stride);
        governor.adapt(Detail::FULL, drawn(Detail::FULL), false);
        let mut longest: f64 = 0.0;
        let mut last = Detail::FULL;
        for _ in 0..200 {
            let detail = governor.detail();
            let reused = detail == last;
            let milliseconds = if reused { 5.0 } else { drawn(detail) };
            longest = longest.max(milliseconds);
            governor.adapt(detail, milliseconds, reused);
            last = detail;
        }
        assert_eq!(last, Detail { stride: 4, coarseness: 1 }, "finer than in motion, and it stays");
        assert!(longest <= LONGEST_ANEW_MS, "{longest}");
        // The view moves: within the budget again.
        governor.adapt(last, drawn(last), false);
        let moved = governor.detail();
        assert!(drawn(moved) <= BUDGET_MS, "{moved:?}");
    }
}
