//! What the filter makes of a splat's outline on the screen, in f64.

use glam::{DVec2, DVec3};
use surfelshop_api::View;

/// An ellipse on the screen, pixels, y downwards: what the filter made of a disc's outline.
pub(super) struct Outline {
    pub(super) center: DVec2,
    /// Unit vectors along the half axes.
    pub(super) axes: [DVec2; 2],
    /// Half axes in pixels.
    pub(super) widened: [f64; 2],
    /// The same before widening.
    pub(super) own: [f64; 2],
    /// Inverse distance (distance, where orthographic) at the centre, and its change along each of
    /// the half axes.
    pub(super) depth: [f64; 3],
    pub(super) orthographic: bool,
}

impl Outline {
    /// Distance along the viewing axis at a position in units of the half axes.
    pub(super) fn distance(&self, at: DVec2) -> f64 {
        let value = self.depth[0] + self.depth[1] * at.x + self.depth[2] * at.y;
        if self.orthographic { value } else { 1.0 / value }
    }

    /// Relative change of inverse distance along the half axes; none where orthographic.
    pub(super) fn tilt(&self) -> DVec2 {
        let tilt = DVec2::new(self.depth[1], self.depth[2]) / self.depth[0];
        if self.orthographic { DVec2::ZERO } else { tilt }
    }

    /// The point of the widened disc in view space at a position in units of the half axes.
    pub(super) fn point(&self, at: DVec2, view: &View) -> DVec3 {
        let px = self.center
            + self.axes[0] * (self.widened[0] * at.x)
            + self.axes[1] * (self.widened[1] * at.y);
        let (start, direction) = view.ray(px.x, px.y);
        start + direction * ((self.distance(at) + start.z) / -direction.z)
    }

    /// Half the longest diameter of the widened disc in space, found by going around it.
    pub(super) fn reach(&self, view: &View) -> f64 {
        let point = |at: DVec2| self.point(at, view);
        // The disc's centre lies where the mean of two opposite points of its edge is the same.
        let center = point(-self.tilt());
        // A degree apart, so that the longest is found to a part in 10,000.
        let around = (0..360).map(|i| DVec2::from_angle(f64::from(i).to_radians()));
        around.map(|at| point(at).distance(center)).fold(0.0, f64::max)
    }

    /// Position of a pixel in units of the half axes.
    pub(super) fn position(&self, px: DVec2) -> DVec2 {
        let offset = px - self.center;
        let [s, t] = [0, 1].map(|k| offset.dot(self.axes[k]) / self.widened[k]);
        DVec2::new(s, t)
    }

    /// Squared distance from the disc's centre in units of its radius, and distance from the eye:
    /// z^2 (1 - s^2 - t^2) and 1 - r^2 are the same quadratic form up to a factor.
    pub(super) fn meet(&self, px: DVec2) -> (f64, f64) {
        let at = self.position(px);
        let distance = self.distance(at);
        let kappa = 1.0 - self.tilt().length_squared();
        let relative = if self.orthographic { 1.0 } else { distance * self.depth[0] };
        (1.0 - (1.0 - at.length_squared()) * kappa * relative * relative, distance)
    }
}
