//! Columns of surfels under linear maps.

use surfelshop_api::columns::{Role, Values, role_of};
use surfelshop_api::glam::{DMat3, DQuat, DVec2, DVec3, DVec4};
use surfelshop_api::prelude::*;
use surfelshop_geometry::harmonics;

/// A similarity: a factor on lengths, and a rotation or a rotation with a mirror.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Similarity {
    /// Factor on lengths, above 0.
    pub(crate) scale: f64,
    /// Orthogonal; its determinant is -1 where it mirrors.
    pub(crate) turn: DMat3,
}

impl Similarity {
    /// Whether left becomes right.
    pub(crate) fn mirrors(&self) -> bool {
        self.turn.determinant() < 0.0
    }

    /// The whole map.
    pub(crate) fn matrix(&self) -> DMat3 {
        self.turn * self.scale
    }

    /// The values of a column after the map, by what its name says that it holds; `None` where they
    /// stay. Positions, tangents and normal fields are not among the roles.
    pub(crate) fn moved(&self, column: &ColumnView<'_>) -> Option<Vec<f32>> {
        let Values::F32(values) = column.values else { return None };
        let components = column.components as usize;
        let moved = match (role_of(column.name), components) {
            (Role::Length, _) => {
                values.iter().map(|&length| (f64::from(length) * self.scale) as f32).collect()
            }
            (Role::Direction, 3) => {
                rows(values, |[x, y, z]| (self.turn * DVec3::new(x, y, z)).to_array())
            }
            (Role::Quaternion, 4) => rows(values, |own| self.quaternion(own)),
            (Role::SphericalHarmonics(order), _) => {
                self.harmonics(usize::from(order), values, components)?
            }
            _ => return None,
        };
        Some(moved)
    }

    /// The rotation of a splat's own axes. A mirrored splat's axes would be left-handed, so that its
    /// first one is turned round, which its shape does not show.
    fn quaternion(&self, own: [f64; 4]) -> [f64; 4] {
        let length = DVec4::from_array(own).length();
        if !(length > 0.0 && length.is_finite()) {
            return own;
        }
        let mut axes = self.turn * DMat3::from_quat(DQuat::from_array(own.map(|c| c / length)));
        if self.mirrors() {
            axes.x_axis = -axes.x_axis;
        }
        DQuat::from_mat3(&axes).to_array()
    }

    /// Coefficients of one order. A mirror is a rotation and a turn inside out, which changes the
    /// sign of odd orders.
    fn harmonics(&self, order: usize, values: &[f32], components: usize) -> Option<Vec<f32>> {
        let n = 2 * order + 1;
        if components == 0 || !components.is_multiple_of(n) {
            return None;
        }
        let channels = components / n;
        let sign = if self.mirrors() { -1.0 } else { 1.0 };
        let odd = if order.is_multiple_of(2) { 1.0 } else { sign };
        let matrix = harmonics::rotation(order, self.turn * sign)?;
        let turned = values.chunks_exact(components).flat_map(|row| {
            let of = |m: usize, channel: usize| {
                let products =
                    (0..n).map(|k| matrix[m * n + k] * f64::from(row[k * channels + channel]));
                (odd * products.sum::<f64>()) as f32
            };
            (0..components).map(|i| of(i / channels, i % channels)).collect::<Vec<_>>()
        });
        Some(turned.collect())
    }
}

/// A column row by row, in f64.
pub(crate) fn rows<const N: usize>(values: &[f32], map: impl Fn([f64; N]) -> [f64; N]) -> Vec<f32> {
    let (all, _) = values.as_chunks::<N>();
    all.iter().flat_map(|row| map(row.map(f64::from)).map(|value| value as f32)).collect()
}

/// The half axes of the ellipse that conjugate half diameters span, and the rotation from places on
/// it in units of the half axes to those in units of the diameters: `u = c u' - s v'`,
/// `v = s u' + c v'` with this (c, s).
pub(crate) fn half_axes(a: DVec3, b: DVec3) -> (DVec3, DVec3, DVec2) {
    let angle = 0.5 * (2.0 * a.dot(b)).atan2(a.length_squared() - b.length_squared());
    let (s, c) = angle.sin_cos();
    (c * a + s * b, c * b - s * a, DVec2::new(c, s))
}

/// The cofactors of a map: normals go with them, whatever the map's determinant.
pub(crate) fn cofactors(map: DMat3) -> DMat3 {
    let (x, y, z) = (map.x_axis, map.y_axis, map.z_axis);
    DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y))
}
