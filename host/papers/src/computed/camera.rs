//! A pinhole camera at the origin that looks along -z, and a splat before it.

use glam::DVec3;

/// Half the height of the picture at the distance 1.
const HALF: f64 = 1.0;

/// The ray through a place of a picture of so many pixels, of depth 1; `at` is 1/2 for a pixel's centre.
pub(super) fn ray(size: u32, x: u32, y: u32, at: f64) -> DVec3 {
    let place = |k: u32| (f64::from(k) + at) / f64::from(size) * 2.0 - 1.0;
    DVec3::new(HALF * place(x), -HALF * place(y), -1.0)
}

/// An ellipse in space.
#[derive(Clone, Copy)]
pub(super) struct Splat {
    pub(super) center: DVec3,
    /// The half axes, as vectors of their lengths.
    pub(super) axes: [DVec3; 2],
}

impl Splat {
    pub(super) fn normal(&self) -> DVec3 {
        self.axes[0].cross(self.axes[1]).normalize_or(DVec3::Z)
    }

    /// How far along a ray its plane is, in lengths of the ray; negative behind the eye, not finite edge-on.
    pub(super) fn distance(&self, ray: DVec3) -> f64 {
        let normal = self.normal();
        self.center.dot(normal) / ray.dot(normal)
    }

    /// The parameters of a point of its plane: within the ellipse where their squares add up to at most 1.
    pub(super) fn parameters(&self, point: DVec3) -> [f64; 2] {
        self.axes.map(|axis| axis.dot(point - self.center) / axis.length_squared())
    }

    /// What the program does: the parameters of the point that a ray shows, in front of the eye.
    pub(super) fn hit(&self, ray: DVec3) -> Option<([f64; 2], DVec3)> {
        let t = self.distance(ray);
        let point = t * ray;
        let [u, v] = self.parameters(point);
        (t.is_finite() && t > 0.0 && u * u + v * v <= 1.0).then_some(([u, v], point))
    }
}
