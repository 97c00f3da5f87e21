//! Where a surfel set stands: its transform, and the axes of the file.
//!
//! A point of the file's records becomes C T p: T is the set's transform, and the rows of C are the file's directions to the right,
//! upwards and back. Where both are rigid but for a mirror in C, the cloud's own axes are C's, and the
//! rest, C T C⁻¹, is a pose that the host applies. Else all of it is applied to the surfels.

use surfelshop_api::format::Pose;
use surfelshop_api::glam::{DMat3, DQuat, DVec3};

/// How far the entries of a matrix may be from those of a rotation. They are 32-bit floats, which are 6e-8 from
/// what they stand for.
const TOLERANCE: f64 = 2e-6;

/// What becomes of the surfels of a set.
#[derive(Clone, Debug)]
pub(crate) struct Placement {
    /// Where the cloud stands, for the host.
    pub(crate) pose: Pose,
    /// What is done to the surfels before.
    pub(crate) applied: Option<Applied>,
    /// Whether positions stay 32-bit floats.
    pub(crate) keeps_f32: bool,
    scales: bool,
}

/// An affine map of surfels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Applied {
    linear: DMat3,
    offset: DVec3,
    /// The inverse transpose, for normals.
    normals: DMat3,
    determinant: f64,
    /// The factor of all lengths, where they have one.
    scale: Option<f64>,
}

impl Applied {
    fn of(linear: DMat3, offset: DVec3) -> Self {
        let normals = linear.inverse().transpose();
        Self {
            linear,
            offset,
            normals,
            determinant: linear.determinant(),
            scale: similarity(linear),
        }
    }

    /// A point.
    pub(crate) fn point(&self, point: DVec3) -> DVec3 {
        self.linear * point + self.offset
    }

    /// The first tangent.
    pub(crate) fn tangent_u(&self, tangent: DVec3) -> DVec3 {
        self.linear * tangent
    }

    /// The second tangent; it turns round where the map mirrors, so that u x v stays on the normal's side.
    pub(crate) fn tangent_v(&self, tangent: DVec3) -> DVec3 {
        self.linear * tangent * self.determinant.signum()
    }

    /// A normal, of unit length; zero stays zero.
    pub(crate) fn normal(&self, normal: DVec3) -> DVec3 {
        (self.normals * normal).normalize_or_zero()
    }

    /// The radius of a disc with a normal. Where the map stretches directions differently, it is that of a disc with
    /// the area of the ellipse, or of a ball with the volume where there is no normal.
    pub(crate) fn radius(&self, radius: f64, normal: Option<DVec3>) -> f64 {
        let volume = self.determinant.abs();
        let factor = self.scale.unwrap_or_else(|| {
            let unit = normal.and_then(DVec3::try_normalize);
            unit.map_or_else(
                || volume.cbrt(),
                |unit| (volume * (self.normals * unit).length()).sqrt(),
            )
        });
        radius * factor
    }
}

/// The factor of all lengths of a map that keeps angles; `None` of others.
fn similarity(linear: DMat3) -> Option<f64> {
    let gram = linear.transpose() * linear;
    let square = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
    let is_close = (gram - DMat3::from_diagonal(DVec3::splat(square)))
        .to_cols_array()
        .iter()
        .all(|entry| entry.abs() <= TOLERANCE * square);
    (is_close && square > 0.0).then(|| square.sqrt())
}

/// Whether a map is a rotation, or one that mirrors.
fn is_orthogonal(linear: DMat3) -> bool {
    similarity(linear).is_some_and(|scale| (scale - 1.0).abs() <= TOLERANCE)
}

/// Whether every row of a matrix is one axis: numbers stay exact.
fn permutes(linear: DMat3) -> bool {
    let is_axis = |row: DVec3| {
        let row = row.to_array();
        row.iter().filter(|entry| **entry == 0.0).count() == 2
            && row.iter().any(|entry| entry.abs() == 1.0)
    };
    let rows = linear.transpose();
    is_axis(rows.x_axis) && is_axis(rows.y_axis) && is_axis(rows.z_axis)
}

/// The linear part and the offset of a matrix of 16 numbers, row by row; a line where it is none that can be applied.
fn affine(matrix: [f64; 16]) -> Result<(DMat3, DVec3), &'static str> {
    let [a, b, c, x, d, e, f, y, g, h, i, z, p, q, r, w] = matrix;
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return Err("its transform has numbers that are not finite and is left out");
    }
    if [p, q, r] != [0.0; 3] || w == 0.0 {
        return Err("its transform is a perspective and is left out");
    }
    let linear = DMat3::from_cols_array(&[a, d, g, b, e, h, c, f, i]) * w.recip();
    if !is_invertible(linear) {
        return Err("its transform flattens the surfels and is left out");
    }
    let offset = DVec3::new(x, y, z) / w;
    if !offset.is_finite() {
        return Err("its transform moves the surfels out of all numbers and is left out");
    }
    Ok((linear, offset))
}

/// Whether a map keeps three dimensions, as far as numbers can tell.
pub(crate) fn is_invertible(linear: DMat3) -> bool {
    let largest = linear.to_cols_array().iter().fold(0.0_f64, |most, entry| most.max(entry.abs()));
    let volume = linear.determinant().abs();
    volume.is_finite() && volume > 1e-12 * largest.powi(3) && linear.inverse().is_finite()
}

impl Placement {
    /// What becomes of the surfels of a set with a transform, in a file whose axes are the rows of a matrix. Also
    /// lines of what is doubtful.
    pub(crate) fn of(axes: DMat3, transform: Option<[f64; 16]>) -> (Self, Vec<String>) {
        let mut lines = Vec::new();
        let identity = (DMat3::IDENTITY, DVec3::ZERO);
        let (linear, offset) = transform.map_or(Ok(identity), affine).unwrap_or_else(|line| {
            lines.push(line.to_owned());
            identity
        });
        let is_rigid = is_orthogonal(linear) && linear.determinant() > 0.0;
        if is_rigid && is_orthogonal(axes) {
            let rotation = DQuat::from_mat3(&(axes * linear * axes.inverse())).normalize();
            let pose = Pose { rotation, translation: axes * offset };
            let applied = (axes != DMat3::IDENTITY).then(|| Applied::of(axes, DVec3::ZERO));
            return (Self { pose, applied, keeps_f32: permutes(axes), scales: false }, lines);
        }
        let applied = Applied::of(axes * linear, axes * offset);
        if applied.scale.is_none() {
            lines.push(
                "its transform stretches directions differently: discs become discs of the same area"
                    .to_owned(),
            );
        }
        let pose = Pose::default();
        (Self { pose, applied: Some(applied), keeps_f32: false, scales: true }, lines)
    }

    /// A comment for people, where the transform is no pose.
    pub(crate) fn comment(&self) -> Option<&'static str> {
        self.scales.then_some("the set's transform scales or mirrors and is applied to the surfels")
    }

    /// The box of the corners of a box.
    pub(crate) fn bounds(&self, bounds: [DVec3; 2]) -> [DVec3; 2] {
        let Some(applied) = &self.applied else { return bounds };
        let [low, high] = bounds;
        let mut found = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 1 { high[axis] } else { low[axis] };
            let moved = applied.point(DVec3::new(pick(0), pick(1), pick(2)));
            found = [found[0].min(moved), found[1].max(moved)];
        }
        found
    }
}
