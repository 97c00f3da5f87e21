//! Which frames of a picture are drawn at once.

use crate::render_thread::view_request::{EXPORT_SLOT, ViewRequest, ViewSlot};
use surfelshop_session::session::ConvergedFrame;

/// Which frames of a refined picture are drawn.
#[derive(Clone, Copy)]
pub(super) enum Frames {
    /// All, until the picture is final.
    All,
    /// The one of this index, of the settled picture that is seen at this place of the pixels.
    One { sample: u32, frame: u32 },
}

impl Frames {
    /// The frames drawn for a new request: measured and exported pictures are not shown in between.
    pub(super) fn of(slot: ViewSlot, request: &ViewRequest) -> Self {
        match request.for_measurement || slot == EXPORT_SLOT {
            true => Self::All,
            false => Self::One { sample: 0, frame: 0 },
        }
    }

    /// Settled pictures that are drawn with these frames, the last of which is `frame`.
    pub(super) fn n_settled(self, frame: &ConvergedFrame) -> u32 {
        match self {
            Self::All => frame.n_samples,
            Self::One { sample, .. } => sample + u32::from(!frame.refines()),
        }
    }

    /// Whether they are of the first place in each pixel, whose depths and explanation are shown.
    pub(super) fn is_first_sample(self) -> bool {
        matches!(self, Self::All | Self::One { sample: 0, .. })
    }
}
