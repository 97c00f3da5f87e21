//! What varies over a surfel: the normals of a field, and the lines that cut it. Twins of the functions
//! of `local.wgsl` of `host/render`.

use crate::columns::Columns;
use crate::columns::geometry::Shape;
use crate::lanes::{F, M, V};
use fearless_simd::prelude::*;
use glam::{Vec2, Vec3};

/// Numbers of a surfel for points in units of the drawn disc's half axes.
#[derive(Clone, Copy)]
pub(crate) struct Local {
    /// A normal in the middle, and what a step along each half axis adds; zeros where there is no field.
    field: [[f32; 3]; 3],
    /// Two lines: a point (u, v) stays where a u + b v + c is not negative.
    lines: [[f32; 3]; 2],
    /// How many of them count, as in the column.
    kind: f32,
}

/// A surfel as it is drawn, in view space.
pub(crate) struct DrawnSurfel<'a> {
    pub(crate) place: usize,
    pub(crate) center: Vec3,
    pub(crate) axis_u: Vec3,
    pub(crate) axis_v: Vec3,
    /// What the low-pass left of the half axes, as shares.
    pub(crate) kept: [f32; 2],
    /// Seen from behind.
    pub(crate) back: bool,
    /// The centre before the low-pass.
    pub(crate) own_center: Vec3,
    /// Takes differences of positions to view space.
    pub(crate) offset: &'a dyn Fn(Vec3) -> Vec3,
    pub(crate) tangent_scale: f32,
}

/// A vector over its length, and one over that; zeros where it has none.
fn direction_and_inverse_length(v: Vec3) -> (Vec3, f32) {
    let size = v.abs().max_element();
    if size.is_nan() || size <= 0.0 {
        return (Vec3::ZERO, 0.0);
    }
    let inverse = 1.0 / (v / size).length();
    (v / size * inverse, inverse / size)
}

impl Local {
    /// Nothing varies.
    pub(crate) const NONE: Self = Self { field: [[0.0; 3]; 3], lines: [[0.0; 3]; 2], kind: 0.0 };

    /// What varies over a surfel; `None` where nothing does.
    pub(crate) fn of(
        columns: &Columns,
        drawn: &DrawnSurfel<'_>,
        with_fields: bool,
    ) -> Option<Self> {
        let splats = &columns.splats;
        let (part, at) = columns.geometry_at(drawn.place);
        let Shape::Tangents(u, v) = &part.shape else { return None };
        let field = splats.fields.as_ref().filter(|_| with_fields);
        let field = field.and_then(|fields| fields.get(drawn.place));
        let clip = splats.clip(drawn.place).filter(|clip| clip[6] > 0.5);
        if field.is_none() && clip.is_none() {
            return None;
        }
        let raw = [u, v].map(|axis| Vec3::from(axis.one(at)));
        let own = OwnFrame::of(drawn, raw);
        let mut local = Self::NONE;
        if let Some(field) = field {
            let given = Vec3::from(part.normals.one(at));
            local.field = own.field(*field, raw, given, drawn).map(|v| v.to_array());
        }
        if let Some([a, b, c, d, e, f, kind]) = clip {
            local.lines = [own.line([*a, *b, *c]), own.line([*d, *e, *f])];
            local.kind = *kind;
        }
        Some(local)
    }

    /// Lanes whose points are cut off.
    #[inline(always)]
    pub(crate) fn cuts<S: Simd>(&self, u: F<S>, v: F<S>) -> M<S> {
        let simd = u.token();
        let zero = F::splat(simd, 0.0);
        let side = |[a, b, c]: [f32; 3]| (u * a + v * b + c).simd_lt(zero);
        let (first, second) = (side(self.lines[0]), side(self.lines[1]));
        match self.kind {
            kind if kind > 1.5 => first & second,
            kind if kind > 0.5 => first | second,
            _ => M::splat(simd, false),
        }
    }

    /// Unit normals of points.
    #[inline(always)]
    pub(crate) fn normals<S: Simd>(&self, u: F<S>, v: F<S>) -> V<S> {
        let [middle, along_u, along_v] = self.field;
        let along = |axis: usize| u * along_u[axis] + v * along_v[axis] + middle[axis];
        let normal = V { x: along(0), y: along(1), z: along(2) };
        let length = normal.dot(normal).sqrt();
        V { x: normal.x / length, y: normal.y / length, z: normal.z / length }
    }

    /// Whether there is a field.
    pub(crate) fn has_field(&self) -> bool {
        self.field[0] != [0.0; 3]
    }
}

/// Where points of the drawn disc lie in the surfel as its columns have it, in units of its own half
/// axes.
struct OwnFrame {
    center: Vec2,
    u: Vec2,
    v: Vec2,
}

impl OwnFrame {
    fn of(drawn: &DrawnSurfel<'_>, raw: [Vec3; 2]) -> Self {
        let scale = drawn.tangent_scale;
        if drawn.kept == [1.0; 2] {
            return Self { center: Vec2::ZERO, u: Vec2::new(scale, 0.0), v: Vec2::new(0.0, scale) };
        }
        let [(u, per_u), (v, per_v)] =
            raw.map(|axis| direction_and_inverse_length((drawn.offset)(axis) * scale));
        let skew = u.dot(v);
        let upright = scale / (1.0 - skew * skew).max(1e-6);
        let along_u = (u - skew * v) * (per_u * upright);
        let along_v = (v - skew * u) * (per_v * upright);
        let at = |vector: Vec3| Vec2::new(vector.dot(along_u), vector.dot(along_v));
        Self {
            center: at(drawn.center - drawn.own_center),
            u: at(drawn.axis_u),
            v: at(drawn.axis_v),
        }
    }

    fn line(&self, [a, b, c]: [f32; 3]) -> [f32; 3] {
        let normal = Vec2::new(a, b);
        [normal.dot(self.u), normal.dot(self.v), normal.dot(self.center) + c]
    }

    fn field(
        &self,
        field: [f32; 4],
        raw: [Vec3; 2],
        given: Vec3,
        drawn: &DrawnSurfel<'_>,
    ) -> [Vec3; 3] {
        let [(u, _), (v, _)] = raw.map(direction_and_inverse_length);
        let (mut plane, _) = direction_and_inverse_length(u.cross(v));
        if plane == Vec3::ZERO {
            plane = given;
        }
        let side = if drawn.back == (plane.dot(given) < 0.0) { 1.0 } else { -1.0 };
        let kept = drawn.kept.map(|kept| side * kept * kept);
        let (du, dv) = (field[2] * u, field[3] * v);
        [
            side * (plane + field[0] * u + field[1] * v),
            kept[0] * (self.u.x * du + self.u.y * dv),
            kept[1] * (self.v.x * du + self.v.y * dv),
        ]
    }
}
