//! How far away what is seen in a picture is.

use super::ScreenShape;
use crate::memory::{OutOfMemory, with_room};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD_NO_PAD;
use glam::DVec2;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// How far away pixels of a picture are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "StoredPicture", into = "StoredPicture")]
pub struct DepthPicture {
    /// Cells in a row of the whole picture, and rows; the picture may be smaller or larger than the view.
    whole: [f64; 2],
    /// The first column and row that are known.
    corner: [i64; 2],
    /// Columns and rows that are known.
    size: [u32; 2],
    /// Distances along the viewing axis of what is farthest in each cell, scene units; 0 where nothing is.
    values: Arc<[f32]>,
    /// The farthest of them.
    farthest: f32,
    /// Radius in pixels of the merged surfels that were seen: what they stand for lies up to this far behind them.
    pub(super) merged_px: f32,
}

/// A surfel counts as visible to this share of its distance behind what is shown: rounding of depths in pictures.
const TOLERANCE: f64 = 1e-4;

/// Pixels around a shape that are kept, as a surfel of less than a pixel may have been drawn beside its centre.
const MARGIN: f64 = 2.0;

impl DepthPicture {
    /// Of a picture, of which what a shape needs is kept; `view_px` is the size in pixels of what the shape is drawn
    /// over. Distances beyond the end of `values` count as nothing.
    ///
    /// # Errors
    /// Where there is no memory for it.
    pub fn new(
        [width, height]: [u32; 2],
        values: &[f32],
        (shape, view_px): (&ScreenShape, [u32; 2]),
    ) -> Result<Self, OutOfMemory> {
        let [low, high] = shape.bounds();
        let end = |axis: usize, at: DVec2, of: u32, by: f64| {
            let share = at[axis] / f64::from(view_px[axis].max(1));
            // Saturates, and NaN is 0.
            (share * f64::from(of) + by).floor().clamp(0.0, f64::from(of)) as u32
        };
        let corner = [end(0, low, width, -MARGIN), end(1, low, height, -MARGIN)];
        let behind = [end(0, high, width, MARGIN + 1.0), end(1, high, height, MARGIN + 1.0)];
        let size = [0, 1].map(|axis| behind[axis].saturating_sub(corner[axis]));
        let mut kept = with_room(size[0] as usize * size[1] as usize)?;
        for y in corner[1]..corner[1] + size[1] {
            for x in corner[0]..corner[0] + size[0] {
                let at = y as usize * width as usize + x as usize;
                kept.push(values.get(at).copied().unwrap_or(0.0));
            }
        }
        let whole = [f64::from(width), f64::from(height)];
        let seen = Self::of(whole, corner.map(i64::from), size, kept);
        // What lies within a pixel is up to so much farther away than its middle.
        let deeper = |(i, depth): (usize, &f32)| *depth + seen.slope(i) as f32;
        let values = seen.values.iter().enumerate().map(deeper).collect();
        Ok(Self::of(whole, seen.corner, size, values))
    }

    fn of(whole: [f64; 2], corner: [i64; 2], size: [u32; 2], values: Vec<f32>) -> Self {
        let farthest = values.iter().copied().fold(0.0, f32::max);
        Self { whole, corner, size, values: values.into(), farthest, merged_px: 0.0 }
    }

    /// How much farther away a surface is a pixel beside, along both axes: pictures have the distance in the middle of a
    /// pixel, and that may have been half of one beside. Of both sides the one that changes less counts, and the other as
    /// far as twice that, since at an outline it leads to something else.
    fn slope(&self, i: usize) -> f64 {
        let width = i64::from(self.size[0].max(1));
        let [x, y] = [i as i64 % width + self.corner[0], i as i64 / width + self.corner[1]];
        let middle = self.at(x, y);
        if middle <= 0.0 {
            return 0.0;
        }
        let change = |depth: f64| if depth > 0.0 { (depth - middle).abs() } else { f64::INFINITY };
        let along = |dx: i64, dy: i64| {
            let [a, b] = [-1, 1].map(|by| change(self.at(x + by * dx, y + by * dy)));
            let less = a.min(b);
            if less.is_finite() { a.max(b).min(2.0 * less) } else { 0.0 }
        };
        along(1, 0) + along(0, 1)
    }

    /// The same with so few cells that it has at most `most` columns and rows: each is as far away as what is farthest
    /// in it. What merged surfels of this radius in pixels stand for is seen where they are.
    #[must_use]
    pub fn coarse(self, most: u32, merged_px: f32) -> Self {
        Self { merged_px, ..self.of_cells(most) }
    }

    fn of_cells(self, most: u32) -> Self {
        let cell = self.size[0].max(self.size[1]).div_ceil(most.max(1));
        if cell <= 1 {
            return self;
        }
        let first = self.corner.map(|at| at.div_euclid(i64::from(cell)));
        let last = [0, 1].map(|axis| {
            (self.corner[axis] + i64::from(self.size[axis]) - 1).div_euclid(i64::from(cell))
        });
        let size = [0, 1].map(|axis| (last[axis] - first[axis] + 1) as u32);
        let mut values = vec![0f32; size[0] as usize * size[1] as usize];
        for (i, value) in self.values.iter().enumerate() {
            let own = [i as i64 % i64::from(self.size[0]), i as i64 / i64::from(self.size[0])];
            let at = [0, 1].map(|axis| {
                ((self.corner[axis] + own[axis]).div_euclid(i64::from(cell)) - first[axis]) as usize
            });
            let kept = &mut values[at[1] * size[0] as usize + at[0]];
            *kept = kept.max(*value);
        }
        let whole = self.whole.map(|length| length / f64::from(cell));
        Self { merged_px: self.merged_px, ..Self::of(whole, first, size, values) }
    }

    /// The distance in a cell; 0 where nothing is.
    fn at(&self, x: i64, y: i64) -> f64 {
        let [x, y] = [x.saturating_sub(self.corner[0]), y.saturating_sub(self.corner[1])];
        let [width, height] = self.size.map(i64::from);
        let inside = (0..width).contains(&x) && (0..height).contains(&y);
        let index = usize::try_from(y.saturating_mul(width).saturating_add(x)).ok();
        let value = index.filter(|_| inside).and_then(|i| self.values.get(i));
        value.map_or(0.0, |value| f64::from(*value))
    }

    /// Whether something at a place of the picture, in shares of its size, and this far away is in front.
    pub(super) fn shows(&self, share: DVec2, depth: f64, reach: f64) -> bool {
        let limit = |shown: f64| shown > 0.0 && depth <= shown + reach + TOLERANCE * depth;
        let [x, y] =
            [share.x * self.whole[0], share.y * self.whole[1]].map(|place| place.floor() as i64);
        let middle = self.at(x, y);
        if middle > 0.0 {
            return limit(middle);
        }
        // A surfel of less than a pixel may have been drawn beside its centre.
        let beside = |x: i64, by: i64| x.saturating_add(by);
        (-1..=1).any(|dy| (-1..=1).any(|dx| limit(self.at(beside(x, dx), beside(y, dy)))))
    }

    /// Whether something this far away may be in front anywhere.
    pub(super) fn may_show(&self, depth: f64, reach: f64) -> bool {
        self.farthest > 0.0 && depth <= f64::from(self.farthest) + reach + TOLERANCE * depth
    }
}

/// A picture as files have it.
#[derive(Serialize, Deserialize)]
struct StoredPicture {
    whole: [f64; 2],
    corner: [i64; 2],
    size: [u32; 2],
    merged_px: f32,
    /// The distances, each four bytes, the lowest first, in base 64.
    depths: String,
}

impl From<DepthPicture> for StoredPicture {
    fn from(picture: DepthPicture) -> Self {
        let DepthPicture { whole, corner, size, values, merged_px, .. } = picture;
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        Self { whole, corner, size, merged_px, depths: STANDARD_NO_PAD.encode(bytes) }
    }
}

impl TryFrom<StoredPicture> for DepthPicture {
    type Error = String;

    fn try_from(stored: StoredPicture) -> Result<Self, String> {
        let StoredPicture { whole, corner, size, merged_px, depths } = stored;
        let bytes = STANDARD_NO_PAD.decode(depths);
        let bytes = bytes.map_err(|error| format!("expected distances in base 64: {error}"))?;
        let values: Vec<f32> =
            bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        let n = u64::from(size[0]) * u64::from(size[1]);
        if values.len() as u64 != n || bytes.len() as u64 != 4 * n {
            return Err(format!("expected {n} distances, found {} bytes of them", bytes.len()));
        }
        // Corners beyond this are of no picture, and would not be counted with.
        if corner.iter().any(|at| at.unsigned_abs() > u64::from(u32::MAX)) {
            return Err(format!("expected the corner of a picture, found {corner:?}"));
        }
        Ok(Self { merged_px, ..Self::of(whole, corner, size, values) })
    }
}
