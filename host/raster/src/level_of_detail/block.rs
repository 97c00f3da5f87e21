//! Blocks of surfels with what they are culled by: a bounding sphere and a cone of normals.

/// What blocks are culled, sorted and chosen by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    /// First group, and how many; none where its parts have to be drawn.
    pub(crate) first: usize,
    pub(crate) count: usize,
    /// Its parts among the blocks.
    pub(crate) parts: [u32; 2],
    /// Middle of the centres.
    pub(crate) middle: [f32; 3],
    /// From there to the farthest centre, scene units.
    pub(crate) spread: f32,
    /// Largest half axis, scene units.
    pub(crate) reach: f32,
    /// The largest radius of merged surfels, scene units.
    pub(crate) grain: f32,
    /// How far from them those that they stand for lie at most, scene units.
    pub(crate) apart: f32,
    /// A unit vector.
    pub(crate) axis: [f32; 3],
    /// Least cosine of the angle between it and the normals; -1 where that is not known.
    pub(crate) cosine: f32,
}

/// A box around centres.
#[derive(Clone, Copy)]
pub(super) struct Bounds {
    pub(super) low: [f32; 3],
    pub(super) high: [f32; 3],
}

impl Bounds {
    pub(super) fn none() -> Self {
        Self { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] }
    }

    pub(super) fn and(mut self, low: [f32; 3], high: [f32; 3]) -> Self {
        for axis in 0..3 {
            self.low[axis] = self.low[axis].min(low[axis]);
            self.high[axis] = self.high[axis].max(high[axis]);
        }
        self
    }

    pub(super) fn middle(&self) -> [f32; 3] {
        [0, 1, 2].map(|axis| 0.5 * self.low[axis] + 0.5 * self.high[axis])
    }

    pub(super) fn spread(&self) -> f32 {
        let half = [0, 1, 2].map(|axis| f64::from(0.5 * self.high[axis] - 0.5 * self.low[axis]));
        // In f64, whose range no square of a length leaves; rounded outwards.
        (half.iter().map(|h| h * h).sum::<f64>().sqrt() * (1.0 + 1e-6)) as f32
    }
}

/// The angle between a block's axis and any of its normals is at most this, radians.
pub(crate) fn half_angle(block: &Block) -> f32 {
    block.cosine.clamp(-1.0, 1.0).acos()
}
