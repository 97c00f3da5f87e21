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

    /// The next coarser detail: the number of surfels rules the time on software drivers, so it is
    /// reduced first.
    fn coarser(self) -> Self {
        match self {
            Self { stride, coarseness } if stride >= MOST_STRIDE => {
                Self { stride, coarseness: (coarseness + 1).min(MOST_COARSENESS) }
            }
            Self { stride, coarseness } => Self { stride: 2 * stride, coarseness },
        }
    }

    fn finer(self) -> Self {
        match self {
            Self { stride, coarseness } if coarseness > 1 => {
                Self { stride, coarseness: coarseness - 1 }
            }
            Self { stride, coarseness } => Self { stride: (stride / 2).max(1), coarseness },
        }
    }
}

/// Fewer surfels than one of 64 no longer show what the object is.
const MOST_STRIDE: u32 = 64;
const MOST_COARSENESS: u32 = 2;

/// Milliseconds a frame may take while something moves: 20 a second, which leaves room for the
/// window's own work at 15.
const BUDGET_MS: f64 = 50.0;

/// Finds the detail at which frames keep within the budget.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Governor {
    detail: Detail,
}

impl Default for Governor {
    fn default() -> Self {
        Self { detail: Detail::FULL }
    }
}

impl Governor {
    /// The detail for the next frame in motion.
    pub(crate) fn detail(self) -> Detail {
        self.detail
    }

    /// Learns from a frame.
    ///
    /// Time falls more slowly than detail, since there are costs per pixel and per frame; so it
    /// takes one step a frame, unless a frame took several budgets.
    pub(crate) fn learn(&mut self, drawn: Detail, milliseconds: f64) {
        if drawn != self.detail && !(drawn.is_full() && milliseconds > BUDGET_MS) {
            return;
        }
        let over = milliseconds / BUDGET_MS;
        let mut detail = drawn;
        if over > 1.0 {
            // A frame of 3 budgets is halved twice.
            for _ in 0..over.log2().ceil() as u32 {
                detail = detail.coarser();
            }
            self.detail = detail;
        } else if over < 0.45 {
            self.detail = detail.finer();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A renderer that takes so long per million surfels and per million pixels, and 5 ms.
    fn settles(per_surfels: f64, per_pixels: f64) -> (Detail, f64) {
        let mut governor = Governor::default();
        let time = |detail: Detail| {
            let pixels = 1.0 / f64::from(detail.coarseness * detail.coarseness);
            5.0 + per_surfels / f64::from(detail.stride) + per_pixels * pixels
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
        for per_surfels in [60.0, 300.0, 1000.0] {
            let (detail, time) = settles(per_surfels, 10.0);
            assert!(time <= BUDGET_MS && detail.coarseness == 1, "{detail:?}: {time}");
        }
        let (detail, time) = settles(1000.0, 100.0);
        assert!(time <= BUDGET_MS && detail.coarseness > 1, "{detail:?}: {time}");
    }

    #[test]
    fn a_full_frame_says_how_long_full_frames_take() {
        let mut governor = Governor { detail: Detail { stride: 8, coarseness: 1 } };
        governor.learn(Detail::FULL, 20.0);
        assert_eq!(governor.detail().stride, 8);
        governor.learn(Detail { stride: 8, coarseness: 1 }, 10.0);
        assert_eq!(governor.detail().stride, 4);
    }
}
