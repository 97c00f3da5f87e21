//! Footprints of splats: which pixels they cover, and with what opacity.

use super::view::{Kind, View, Words};

/// Opacities below this are not seen: one of 255 steps.
///
/// Source: Kerbl et al. 2023, appendix C: fragments of less are left out.
pub(super) const LEAST_OPACITY: f32 = 1.0 / 255.0;

/// A Gaussian of a plane is at least as wide as one of this inverse variance in pixels: 1 / (√2 / 2)².
///
/// Source: Huang et al. 2024, "2D Gaussian Splatting", equation 11.
pub(super) const LOW_PASS: f32 = 2.0;

/// The largest part of a distance that is drawn: its square is a number still, and so is the depth of it in any unit that
/// scenes have.
pub(super) const MOST_DISTANCE: f32 = 1e18;

/// Bytes of a footprint.
pub const FOOTPRINT_BYTES: usize = size_of::<Words>();

/// A footprint, as the shader `surfelshop::splat` makes it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Footprint {
    /// Of a conic (a, b, c, 0): the exponent is -(a x² + 2 b x y + c y²) / 2 of pixels x, y from the centre. Of a plane
    /// the rows (a, b) and (c, d) that take places in it to pixels from the centre, times their distance.
    pub shape: [f32; 4],
    /// The distance of a place (s, t) in the plane along the viewing axis, in a unit of the view: (s, t, 1) times this. Of
    /// a conic (0, 0, distance).
    pub distance: [f32; 3],
    /// Opacity at the centre, 0 to 1.
    pub opacity: f32,
    /// Where the centre is seen, pixels; the first pixel's centre is at (0.5, 0.5).
    pub center: [f32; 2],
}

impl Footprint {
    /// The footprint of these words, as the device stores them.
    #[must_use]
    #[inline]
    pub fn of(w: &Words) -> Self {
        Self {
            shape: [w[0], w[1], w[2], w[3]],
            distance: [w[4], w[5], w[6]],
            opacity: w[7],
            center: [w[8], w[9]],
        }
    }

    /// The words that stand for it.
    #[cfg(test)]
    pub(super) fn words(&self) -> Words {
        let ([a, b, c, d], [x, y, z], [i, j]) = (self.shape, self.distance, self.center);
        [a, b, c, d, x, y, z, self.opacity, i, j, 0.0, 0.0]
    }

    /// Twice the exponent at which the opacity falls below what is seen; `None` where nothing is.
    #[inline]
    pub(super) fn cutoff(&self) -> Option<f32> {
        // Of a number that is none the least of it and 1 would be 1.
        (self.opacity >= LEAST_OPACITY).then(|| 2.0 * (self.opacity.min(1.0) / LEAST_OPACITY).ln())
    }

    /// The pixels that may be covered, left, top, right and bottom, the latter two beyond; `None` where there is none.
    #[inline]
    pub(super) fn pixels(&self, kind: Kind, cutoff: f32, view: &View) -> Option<[u16; 4]> {
        // A planar one in front of the eye may have its centre behind the near plane.
        let near = self.distance[2];
        if !self.is_finite() || self.is_too_far() || (kind == Kind::Conic && near < view.near) {
            return None;
        }
        let [x, y] = match kind {
            Kind::Conic => self.reach_of_conic(cutoff)?,
            Kind::Planar => self.reach_of_plane(cutoff, view),
        };
        let [width, height] = view.size_px;
        let first = |low: f32| (low - 0.5).ceil().max(0.0);
        let end = |high: f32, size: u32| ((high - 0.5).floor() + 1.0).min(size as f32);
        let [left, top] = [first(x[0]), first(y[0])];
        let [right, bottom] = [end(x[1], width), end(y[1], height)];
        (left < right && top < bottom).then_some([
            left as u16,
            top as u16,
            right as u16,
            bottom as u16,
        ])
    }

    fn is_too_far(&self) -> bool {
        self.distance.iter().any(|part| part.abs() > MOST_DISTANCE)
    }

    fn is_finite(&self) -> bool {
        // A number that is none makes the sum none, and so does an infinite one times zero.
        let ([a, b, c, d], [x, y, z], [i, j]) = (self.shape, self.distance, self.center);
        let none = (a + b + c + d + x + y + z + i + j) * 0.0;
        none == 0.0 || [a, b, c, d, x, y, z, i, j].iter().all(|number| number.is_finite())
    }

    /// Left and right, top and bottom of the ellipse of a conic; `None` where it is none.
    fn reach_of_conic(&self, cutoff: f32) -> Option<[[f32; 2]; 2]> {
        let [a, b, c, _] = self.shape;
        let determinant = a * c - b * b;
        if !(a > 0.0 && c > 0.0 && determinant > 0.0) {
            return None;
        }
        let half = |variance: f32| (cutoff * variance / determinant).sqrt();
        let [x, y] = self.center;
        // A wide conic whose determinant rounds reaches a little farther than it says: by its own rounding.
        let [rx, ry] = [half(c), half(a)].map(|reach| reach * 1.0001);
        Some([[x - rx, x + rx], [y - ry, y + ry]])
    }

    /// The same of a Gaussian of a plane, which is infinite where the plane's part that is seen reaches the eye.
    fn reach_of_plane(&self, cutoff: f32, view: &View) -> [[f32; 2]; 2] {
        let [a0, a1, b0, b1] = self.shape;
        let [w0, w1, w2] = match view.orthographic {
            true => [0.0, 0.0, 1.0],
            false => self.distance,
        };
        let d = w2 * w2 - cutoff * (w0 * w0 + w1 * w1);
        let least = (cutoff / LOW_PASS).sqrt();
        let along = |[p, q]: [f32; 2], center: f32| {
            if !(d > 0.0 && w2 > 0.0) {
                return [f32::NEG_INFINITY, f32::INFINITY];
            }
            let middle = -cutoff * (p * w0 + q * w1);
            let half = (middle * middle + d * cutoff * (p * p + q * q)).sqrt();
            let [low, high] = [(middle - half) / d, (middle + half) / d];
            // The same rounding as of conics.
            [center + (low * 1.0001).min(-least), center + (high * 1.0001).max(least)]
        };
        [along([a0, a1], self.center[0]), along([b0, b1], self.center[1])]
    }
}
