//! Position, normal, radius and tangents of a record, in the cloud's own axes.

use super::placement::Placement;
use crate::big_endian::{f32_at, u16_at, u32_at, vector_at};
use crate::surfel::layout::{Layout, Normals};
use crate::surfel::normal_code::Cube;
use crate::surfel::property;
use surfelshop_api::glam::{DVec3, Vec3};

/// Half the diagonal between samples of a density, and a little more: what a radius covers.
const COVER: f64 = 1.2;

/// What reads the geometry of records.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Geometry<'a> {
    pub(crate) layout: &'a Layout,
    pub(crate) placement: &'a Placement,
}

fn vector(record: &[u8], place: usize) -> DVec3 {
    Vec3::from(vector_at(record, place)).as_dvec3()
}

impl Geometry<'_> {
    /// Whether records have a radius, or something that one is made from.
    pub(crate) fn has_radius(layout: &Layout) -> bool {
        [property::RADIUS, property::TANGENTS, property::DENSITY]
            .iter()
            .any(|&number| layout.place(number).is_some())
    }

    /// Whether records have a normal, or tangents that one is made from.
    pub(crate) fn has_normal(layout: &Layout) -> bool {
        [property::NORMAL, property::TANGENTS].iter().any(|&number| layout.place(number).is_some())
    }

    /// The centre.
    pub(crate) fn position(&self, record: &[u8]) -> DVec3 {
        let own = vector(record, self.layout.place(property::POSITION).unwrap_or(0));
        self.placement.applied.map_or(own, |applied| applied.point(own))
    }

    /// The two tangents as stored.
    fn stored_tangents(&self, record: &[u8]) -> Option<[DVec3; 2]> {
        let place = self.layout.place(property::TANGENTS)?;
        Some([vector(record, place), vector(record, place + 12)])
    }

    /// The two tangents; zero where there are none.
    pub(crate) fn tangents(&self, record: &[u8]) -> [DVec3; 2] {
        let [u, v] = self.stored_tangents(record).unwrap_or_default();
        self.placement
            .applied
            .map_or([u, v], |applied| [applied.tangent_u(u), applied.tangent_v(v)])
    }

    /// The normal in the record's axes; `None` where its code is invalid, or there is none.
    fn stored_normal(&self, record: &[u8]) -> Option<DVec3> {
        let Some(place) = self.layout.place(property::NORMAL) else {
            let [u, v] = self.stored_tangents(record)?;
            return Some(u.cross(v).normalize_or_zero());
        };
        match self.layout.normals {
            Normals::Floats => Some(vector(record, place)),
            Normals::Ico8 => None,
            Normals::Code(Cube::Cub16) => Cube::Cub16.decode(u16_at(record, place).into()),
            Normals::Code(Cube::Cub32) => Cube::Cub32.decode(u32_at(record, place)),
        }
    }

    /// The normal; `None` where its code is invalid, or there is none.
    pub(crate) fn normal(&self, record: &[u8]) -> Option<DVec3> {
        let own = self.stored_normal(record)?;
        Some(self.placement.applied.map_or(own, |applied| applied.normal(own)))
    }

    /// The radius: the stored one, the longer tangent's length, or what covers the surface at the sampling density.
    pub(crate) fn radius(&self, record: &[u8]) -> f64 {
        let own = match self.layout.place(property::RADIUS) {
            Some(place) => f64::from(f32_at(record, place)),
            None if self.layout.place(property::TANGENTS).is_some() => {
                let [u, v] = self.tangents(record);
                return u.length().max(v.length());
            }
            None => {
                let place = self.layout.place(property::DENSITY).unwrap_or(0);
                let density = vector(record, place).length();
                COVER / (std::f64::consts::PI * density).sqrt()
            }
        };
        match self.placement.applied {
            Some(applied) => applied.radius(own, self.stored_normal(record)),
            None => own,
        }
    }
}
