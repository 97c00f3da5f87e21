//! Spheres and planes fitted to surfels and their normals.
//!
//! Source: Guennebaud, Germann and Gross, "Dynamic sampling and rendering of algebraic point set
//! surfaces", Eurographics 2008, eq. 4: the sphere whose gradients are the normals, in closed form.

use surfelshop_api::glam::DVec3;

/// An algebraic sphere: the places where `constant + linear · p + square p · p` is zero. Where `square`
/// is zero it is a plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AlgebraicSphere {
    /// The place that the numbers are relative to.
    origin: DVec3,
    constant: f64,
    linear: DVec3,
    square: f64,
}

/// A place on a surface and the unit normal there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Foot {
    pub(crate) place: DVec3,
    pub(crate) normal: DVec3,
}

/// Sums over weighted surfels that a sphere is fitted to.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sums {
    weight: f64,
    place: DVec3,
    normal: DVec3,
    along: f64,
    square: f64,
}

impl Sums {
    /// Adds a surfel at a place relative to the origin of the fit.
    pub(crate) fn add(&mut self, weight: f64, place: DVec3, normal: DVec3) {
        self.weight += weight;
        self.place += weight * place;
        self.normal += weight * normal;
        self.along += weight * place.dot(normal);
        self.square += weight * place.length_squared();
    }

    /// The mean place, relative to the origin of the fit.
    pub(crate) fn mean(&self) -> DVec3 {
        if self.weight > 0.0 { self.place / self.weight } else { DVec3::ZERO }
    }

    /// The sphere, or the plane where `is_flat`; `None` where the normals say nothing.
    pub(crate) fn fit(&self, origin: DVec3, is_flat: bool) -> Option<AlgebraicSphere> {
        let (mean, normal) = (self.place / self.weight, self.normal / self.weight);
        let spread = self.square - mean.dot(self.place);
        let bend = self.along - mean.dot(self.normal);
        // Surfels all but in one place bend nothing.
        let is_spread = spread > 1e-9 * self.square;
        let square = if is_flat || !is_spread { 0.0 } else { 0.5 * bend / spread };
        let linear = normal - 2.0 * square * mean;
        let constant = -linear.dot(mean) - square * self.square / self.weight;
        let sphere = AlgebraicSphere { origin, constant, linear, square };
        let is_finite = constant.is_finite() && linear.is_finite() && square.is_finite();
        (is_finite && normal.length() > 0.1).then_some(sphere)
    }
}

impl AlgebraicSphere {
    /// The nearest place of the surface.
    pub(crate) fn foot(&self, place: DVec3) -> Option<Foot> {
        let x = place - self.origin;
        let value = self.constant + self.linear.dot(x) + self.square * x.length_squared();
        let gradient = self.linear + 2.0 * self.square * x;
        let length = gradient.length();
        let normal = gradient.try_normalize()?;
        let root = (length * length - 4.0 * self.square * value).max(0.0).sqrt();
        let far = -2.0 * value / (length + root);
        far.is_finite().then(|| Foot { place: place + far * normal, normal })
    }

    /// How far along a unit direction the surface is met where its normal faces that way; `None` where
    /// it is not.
    pub(crate) fn along(&self, from: DVec3, direction: DVec3) -> Option<f64> {
        let x = from - self.origin;
        let value = self.constant + self.linear.dot(x) + self.square * x.length_squared();
        let slope = (self.linear + 2.0 * self.square * x).dot(direction);
        // Of the two places that one where the gradient along the direction, the root, is positive.
        let root = (slope * slope - 4.0 * self.square * value).sqrt();
        let far = if slope > 0.0 {
            -2.0 * value / (slope + root)
        } else {
            (root - slope) / (2.0 * self.square)
        };
        (root > 0.0 && far.is_finite()).then_some(far)
    }
}
