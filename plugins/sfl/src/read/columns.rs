//! Which columns come out of a layout.

use super::geometry::Geometry;
use super::placement::Placement;
use crate::surfel::layout::Layout;
use crate::surfel::plain::{PLAIN, Stored};
use crate::surfel::property;
use surfelshop_api::columns::{
    COLOR, Element, NORMAL, POSITION, RADIUS, TANGENT_U, TANGENT_V, Values,
};
use surfelshop_api::format::FileColumn;

/// Column of ambient colours.
pub(crate) const AMBIENT: &str = "ambient";
/// Column of specular colours.
pub(crate) const SPECULAR: &str = "specular";

/// What a column is made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Source {
    /// Centres, as 32-bit floats.
    Position,
    /// Centres that were moved, as 64-bit floats.
    MovedPosition,
    /// Normals.
    Normal,
    /// Radii.
    Radius,
    /// First tangents.
    TangentU,
    /// Second tangents.
    TangentV,
    /// A colour at a place, with opacity or without.
    Color { place: usize, components: usize, is_diffuse: bool },
    /// Numbers as they are, at a place.
    Plain { place: usize, components: usize, stored: Stored },
}

/// The columns of a cloud and what they are made from.
#[derive(Clone, Debug, Default)]
pub(crate) struct Plan {
    columns: Vec<(FileColumn, Source)>,
}

impl Plan {
    /// The columns that somebody wants of a layout's records. Colours have opacity `with_alpha`.
    pub(crate) fn of(
        layout: &Layout,
        placement: &Placement,
        with_alpha: bool,
        wants: impl Fn(&str) -> bool,
    ) -> Self {
        let mut plan = Self::default();
        let (element, source) = if placement.keeps_f32 {
            (Element::F32, Source::Position)
        } else {
            (Element::F64, Source::MovedPosition)
        };
        plan.add(FileColumn::new(POSITION, 3, element), source);
        if Geometry::has_normal(layout) && wants(NORMAL) {
            plan.add(FileColumn::new(NORMAL, 3, Element::F32), Source::Normal);
        }
        if Geometry::has_radius(layout) && wants(RADIUS) {
            plan.add(FileColumn::new(RADIUS, 1, Element::F32), Source::Radius);
        }
        if layout.place(property::TANGENTS).is_some() {
            for (name, source) in [(TANGENT_U, Source::TangentU), (TANGENT_V, Source::TangentV)] {
                if wants(name) {
                    plan.add(FileColumn::new(name, 3, Element::F32), source);
                }
            }
        }
        let colors = [
            (COLOR, property::DIFFUSE, if with_alpha { 4 } else { 3 }),
            (SPECULAR, property::SPECULAR, 3),
            (AMBIENT, property::AMBIENT, 3),
        ];
        for (name, number, components) in colors {
            if let Some(place) = layout.place(number).filter(|_place| wants(name)) {
                let is_diffuse = number == property::DIFFUSE;
                let source = Source::Color { place, components: components as usize, is_diffuse };
                plan.add(FileColumn::new(name, components, Element::U8), source);
            }
        }
        for plain in &PLAIN {
            if let Some(place) = layout.place(plain.property).filter(|_| wants(plain.column)) {
                let (components, stored) = (plain.components, plain.stored);
                let mut column = FileColumn::new(plain.column, components as u32, stored.element());
                plain.description.clone_into(&mut column.description);
                plan.add(column, Source::Plain { place, components, stored });
            }
        }
        plan
    }

    fn add(&mut self, column: FileColumn, source: Source) {
        self.columns.push((column, source));
    }

    /// The columns for the header.
    pub(crate) fn file_columns(&self) -> Vec<FileColumn> {
        self.columns.iter().map(|(column, _source)| column.clone()).collect()
    }

    /// What the columns are made from, in order.
    pub(crate) fn sources(&self) -> impl Iterator<Item = Source> + '_ {
        self.columns.iter().map(|(_column, source)| *source)
    }

    /// Empty values for each column.
    pub(crate) fn buffers(&self) -> Vec<Buffer> {
        self.columns.iter().map(|(column, _source)| Buffer::of(column.element)).collect()
    }
}

/// Values of a column, as they are decoded.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Buffer {
    U8(Vec<u8>),
    U16(Vec<u16>),
    U32(Vec<u32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

impl Buffer {
    fn of(element: Element) -> Self {
        match element {
            Element::U8 | Element::I8 => Self::U8(Vec::new()),
            Element::U16 | Element::I16 => Self::U16(Vec::new()),
            Element::U32 | Element::I32 => Self::U32(Vec::new()),
            Element::F32 => Self::F32(Vec::new()),
            Element::F64 => Self::F64(Vec::new()),
        }
    }

    /// The values.
    pub(crate) fn values(&self) -> Values<'_> {
        match self {
            Self::U8(values) => Values::U8(values),
            Self::U16(values) => Values::U16(values),
            Self::U32(values) => Values::U32(values),
            Self::F32(values) => Values::F32(values),
            Self::F64(values) => Values::F64(values),
        }
    }

    /// Some of the values.
    #[cfg(test)]
    pub(crate) fn slice(&self, range: std::ops::Range<usize>) -> Values<'_> {
        match self {
            Self::U8(values) => Values::U8(&values[range]),
            Self::U16(values) => Values::U16(&values[range]),
            Self::U32(values) => Values::U32(&values[range]),
            Self::F32(values) => Values::F32(&values[range]),
            Self::F64(values) => Values::F64(&values[range]),
        }
    }
}
