//! The hemisphere over a point as a square map: what `hemisphere.wgsl` computes.

use glam::{Vec2, Vec3};

/// Two directions at right angles to a third, unit length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axes([Vec3; 3]);

impl Axes {
    /// Source: Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
    pub(super) fn around(n: Vec3) -> Self {
        let s = if n.z >= 0.0 { 1.0 } else { -1.0 };
        let a = -1.0 / (s + n.z);
        let b = n.x * n.y * a;
        let across = Vec3::new(1.0 + s * n.x * n.x * a, s * b, -s * n.x);
        Self([across, Vec3::new(b, s + n.y * n.y * a, -n.y), n])
    }

    pub(super) fn local(&self, v: Vec3) -> Vec3 {
        let [x, y, z] = self.0.map(|axis| axis.dot(v));
        Vec3::new(x, y, z)
    }
}

/// Where a unit direction lies in the map, -1 to 1.
pub(super) fn place_of(direction: Vec3) -> Vec2 {
    direction.truncate() / f32::max(1.0 + direction.z, 1e-4)
}

/// The unit direction of a place.
pub(super) fn direction_of(place: Vec2) -> Vec3 {
    let square = place.length_squared();
    (2.0 * place).extend(1.0 - square) / (1.0 + square)
}

/// The texel of a place in a map of `side` texels, the outermost one beyond it.
pub(super) fn texel_of(place: Vec2, side: usize) -> [usize; 2] {
    let texel = ((place * 0.5 + 0.5) * side as f32).floor();
    texel.clamp(Vec2::ZERO, Vec2::splat(side as f32 - 1.0)).to_array().map(|at| at as usize)
}

/// The place of a texel's centre.
pub(super) fn center_of(x: usize, y: usize, side: usize) -> Vec2 {
    (Vec2::new(x as f32, y as f32) + 0.5) / side as f32 * 2.0 - 1.0
}

/// The angle that a texel at a place is wide, radians.
pub(super) fn width_at(place: Vec2, side: usize) -> f32 {
    4.0 / (side as f32 * (1.0 + place.length_squared()))
}
