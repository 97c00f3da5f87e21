//! Columns and blocks for those who draw surfels themselves: which places are to be drawn, and what stands
//! in them.

use crate::cloud::{Cloud, CloudInView};
use crate::columns::geometry::Shape;
use crate::columns::{Albedo, Columns};
use crate::cull::runs;
use crate::view::{Eye, View};
use std::ops::Range;

/// Places that a view of a cloud is drawn from, in ascending order: blocks that cannot be seen are left
/// out, and where `View::detail_px` allows, merged surfels stand for theirs.
#[must_use]
pub fn places(cloud: &Cloud<'_>, view: &View) -> Vec<Range<u32>> {
    let eye = Eye::new(view, cloud.view_from_cloud, cloud.round_reach);
    let Cloud { columns, first, object, .. } = *cloud;
    runs(CloudInView { columns, eye, first: 1, first_surfel: first, object })
}

/// One of the columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Three floats, scene units.
    Position,
    /// Three floats, a unit vector.
    Normal,
    /// A float, scene units; of ellipses none.
    Radius,
    /// Three floats, scene units; of discs none.
    TangentU,
    /// Three floats, scene units; of discs none.
    TangentV,
    /// Four floats: a normal field.
    Field,
    /// Seven floats: lines that cut it.
    Clip,
    /// A float.
    Ao,
    /// An index.
    Material,
    /// The code of an 8-bit colour, or four half-precision floats.
    Color,
}

impl Columns {
    /// Number of places: those of surfels, zeros up to a whole group, and those of merged ones.
    #[must_use]
    pub fn n_places(&self) -> usize {
        self.n_places
    }

    /// The longest half axis, merged surfels among them, scene units.
    #[must_use]
    pub fn max_reach(&self) -> f32 {
        self.max_reach
    }

    /// Appends the bytes of what stands in a place, zeros where it is none's.
    ///
    /// # Panics
    /// Where there is no such place, or its part was not made: [`Columns::make_all_parts`].
    pub fn put(&self, part: Part, place: usize, out: &mut Vec<u8>) {
        let floats = |out: &mut Vec<u8>, values: &[f32]| {
            out.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        };
        let (own, at) = self.geometry_at(place);
        match (part, &own.shape, &self.albedo) {
            (Part::Position, ..) => floats(out, &own.positions.one(at)),
            (Part::Normal, ..) => floats(out, &own.normals.one(at)),
            (Part::Radius, Shape::Radius(radii), _) => floats(out, &[radii.one(at)]),
            (Part::TangentU, Shape::Tangents(u, _), _) => floats(out, &u.one(at)),
            (Part::TangentV, Shape::Tangents(_, v), _) => floats(out, &v.one(at)),
            (Part::Field, ..) => {
                let fields = self.splats.fields.as_ref();
                let field = fields.and_then(|fields| fields.get(place)).copied();
                floats(out, &field.unwrap_or_default());
            }
            (Part::Clip, ..) => floats(out, &self.splats.clip(place).copied().unwrap_or_default()),
            (Part::Ao, ..) => floats(out, &[self.ao_of(place)]),
            (Part::Material, ..) => {
                let surfel = self.surfel_at(place);
                let is_one = (surfel as usize) < self.len();
                let material = if is_one { self.material_of(surfel) } else { 0 };
                out.extend(material.to_le_bytes());
            }
            (Part::Color, _, Albedo::Codes(codes)) => out.extend(codes[place].to_le_bytes()),
            (Part::Color, _, Albedo::Halves(halves)) => {
                out.extend(halves[place].iter().flat_map(|half| half.to_le_bytes()));
            }
            (Part::Radius | Part::TangentU | Part::TangentV | Part::Color, ..) => {}
        }
    }
}
