//! Signed distance fields: negative inside, positive outside, zero on the surface.
//!
//! The shapes need not be exact distances. Sampling divides by the gradient, so it is enough that
//! a field is smooth near its zero set and roughly as steep as a distance.

use glam::DVec3;

/// A piece of the figure with its own surface and paint.
pub trait Part: Sync {
    /// The field.
    fn distance(&self, point: DVec3) -> f64;

    /// Centre and radius of a ball that holds the whole piece.
    fn ball(&self) -> (DVec3, f64);

    /// The albedo at a surface point, sRGB-encoded, each channel in [0, 1]. Colours are chosen and
    /// mixed as encoded values, as a painter would.
    fn paint(&self, point: DVec3, normal: DVec3) -> DVec3;

    /// The wanted distance between neighbouring samples around a surface point.
    fn spacing(&self, point: DVec3) -> f64;
}

/// The lesser of two fields, with a seam rounded over the width `k`.
#[must_use]
pub fn smooth_min(a: f64, b: f64, k: f64) -> f64 {
    let overlap = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - overlap * overlap * k / 4.0
}

/// The greater of two fields, with an edge rounded over the width `k`.
#[must_use]
pub fn smooth_max(a: f64, b: f64, k: f64) -> f64 {
    -smooth_min(-a, -b, k)
}

/// 0 below the first edge, 1 above the second, and a smooth step between.
#[must_use]
pub fn step(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// An ellipsoid around the origin, by its first-order distance.
#[must_use]
pub fn ellipsoid(point: DVec3, radii: DVec3) -> f64 {
    let scaled = (point / radii).length();
    let slope = (point / (radii * radii)).length();
    // At the very centre the slope vanishes; any negative depth will do there.
    if slope < 1e-9 { -radii.min_element() } else { scaled * (scaled - 1.0) / slope }
}

/// A ball swept along a straight line while its radius changes evenly.
#[must_use]
pub fn tapered(point: DVec3, from: (DVec3, f64), to: (DVec3, f64)) -> f64 {
    let axis = to.0 - from.0;
    let t = ((point - from.0).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
    (point - from.0 - axis * t).length() - (from.1 + (to.1 - from.1) * t)
}

/// A place and a right-handed set of unit axes, to model a piece upright and put it anywhere.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    origin: DVec3,
    axes: [DVec3; 3],
}

impl Frame {
    /// With local y along `up` and local x as near to `forward` as that allows. The two must be
    /// neither zero nor parallel.
    #[must_use]
    pub fn new(origin: DVec3, up: DVec3, forward: DVec3) -> Self {
        let y = up / up.length();
        let across = forward.cross(y);
        let z = across / across.length();
        Self { origin, axes: [y.cross(z), y, z] }
    }

    /// A world point in local coordinates.
    #[must_use]
    pub fn local(&self, point: DVec3) -> DVec3 {
        let offset = point - self.origin;
        DVec3::from_array(self.axes.map(|axis| axis.dot(offset)))
    }

    /// A local point in the world.
    #[must_use]
    pub fn world(&self, point: DVec3) -> DVec3 {
        self.origin + self.turned(point)
    }

    /// A local direction in the world.
    #[must_use]
    pub fn turned(&self, direction: DVec3) -> DVec3 {
        let [x, y, z] = self.axes;
        x * direction.x + y * direction.y + z * direction.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn placing_and_back_is_the_identity() {
        let placed = Frame::new(DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.3, 1.0, 0.2), DVec3::X);
        let point = DVec3::new(0.4, -0.7, 1.1);
        assert!((placed.local(placed.world(point)) - point).length() < 1e-14);
    }

    #[test]
    fn ellipsoid_is_zero_on_its_surface() {
        let radii = DVec3::new(1.0, 0.5, 2.0);
        assert!(ellipsoid(DVec3::X, radii).abs() < 1e-12);
        assert!(ellipsoid(DVec3::Y * 0.5, radii).abs() < 1e-12);
        assert!(ellipsoid(DVec3::ZERO, radii) < 0.0);
    }

    #[test]
    fn rounded_union_lies_below_both() {
        assert!(smooth_min(0.1, 0.1, 0.05) < 0.1);
        assert!((smooth_min(0.1, 0.9, 0.05) - 0.1).abs() < 1e-15);
    }
}
