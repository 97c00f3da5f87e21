//! What varies over a splat, in f64: its normals, and the lines that cut it.

use glam::{DVec2, DVec3, Vec3};
use surfelshop_api::columns::{CLIP, NORMAL_FIELD, TANGENT_U, TANGENT_V};
use surfelshop_cloud::{Buffer, Cloud};

pub(super) struct Local {
    /// What a vector in view space has of each half axis, in units of it.
    dual: [DVec3; 2],
    /// x, y, α, β, and the directions of the tangents and of the plane's normal, world-oriented.
    field: Option<([f64; 4], [DVec3; 3])>,
    clip: Option<[f64; 7]>,
    /// Seen from behind.
    back: bool,
    /// Whether the vector product of the tangents points away from the normal.
    turned_round: bool,
}

fn numbers<const N: usize>(cloud: &Cloud, name: &str, i: usize) -> Option<[f64; N]> {
    let column = cloud.columns().iter().find(|column| column.name() == name)?;
    let Buffer::F32(values) = column.values() else { return None };
    Some(values.as_chunks::<N>().0[i].map(f64::from))
}

impl Local {
    /// What varies over a surfel; `None` where nothing does.
    pub(super) fn new(
        cloud: &Cloud,
        i: usize,
        turned: &dyn Fn(Vec3) -> DVec3,
        back: bool,
    ) -> Option<Self> {
        let [u, v] = [TANGENT_U, TANGENT_V].map(|name| cloud.vectors(name));
        let (u, v) = (*u.get(i)?, *v.get(i)?);
        let clip = numbers::<7>(cloud, CLIP, i).filter(|clip| clip[6] > 0.5);
        let field = numbers::<4>(cloud, NORMAL_FIELD, i);
        if clip.is_none() && field.is_none() {
            return None;
        }
        let directions = [u, v].map(|axis| axis.as_dvec3().normalize_or(DVec3::Z));
        let plane = directions[0].cross(directions[1]).normalize_or(DVec3::Z);
        let turned_round = plane.dot(cloud.normals()[i].as_dvec3()) < 0.0;
        // Rows of the inverse of (u v n).
        let axes = glam::DMat3::from_cols(turned(u), turned(v), turned(u).cross(turned(v)));
        let inverse = axes.inverse();
        Some(Self {
            dual: [inverse.row(0), inverse.row(1)],
            field: field.map(|field| (field, [directions[0], directions[1], plane])),
            clip,
            back,
            turned_round,
        })
    }

    fn at(&self, from_center: DVec3) -> DVec2 {
        DVec2::new(self.dual[0].dot(from_center), self.dual[1].dot(from_center))
    }

    /// How far a point is on the side that stays; infinite where nothing is cut off.
    pub(super) fn stays(&self, from_center: DVec3) -> f64 {
        let Some([a, b, c, d, e, f, kind]) = self.clip else { return f64::INFINITY };
        let at = self.at(from_center);
        let (first, second) = (a * at.x + b * at.y + c, d * at.x + e * at.y + f);
        if kind > 1.5 { first.max(second) } else { first.min(second) }
    }

    /// The unit normal at a point.
    pub(super) fn normal(&self, from_center: DVec3) -> Option<DVec3> {
        let ([x, y, alpha, beta], [u, v, plane]) = self.field?;
        let at = self.at(from_center);
        let normal =
            (plane + (x + alpha * at.x) * u + (y + beta * at.y) * v).normalize_or(DVec3::Z);
        Some(if self.back == self.turned_round { normal } else { -normal })
    }
}
