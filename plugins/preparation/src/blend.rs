//! Interpolation: columns of a mesh's vertices at points of its triangles.

use std::ops::Range;
use surfelshop_api::columns::{COLOR, Values};
use surfelshop_api::params::{linear_to_srgb, srgb_to_linear};
use surfelshop_api::prelude::*;
use surfelshop_api::tool::NewColumn;
use surfelshop_geometry::mesh::MeshPoint;

/// Values of a new column.
pub(crate) enum ColumnValues {
    I8(Vec<i8>),
    U8(Vec<u8>),
    I16(Vec<i16>),
    U16(Vec<u16>),
    I32(Vec<i32>),
    U32(Vec<u32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

impl ColumnValues {
    /// The column of this name.
    pub(crate) fn column<'a>(&'a self, name: &'a str, components: u32) -> NewColumn<'a> {
        let values = match self {
            Self::I8(values) => Values::I8(values),
            Self::U8(values) => Values::U8(values),
            Self::I16(values) => Values::I16(values),
            Self::U16(values) => Values::U16(values),
            Self::I32(values) => Values::I32(values),
            Self::U32(values) => Values::U32(values),
            Self::F32(values) => Values::F32(values),
            Self::F64(values) => Values::F64(values),
        };
        NewColumn { name, components, values }
    }
}

/// Places on triangles, and what is blended there.
pub(crate) struct MeshSamples<'a> {
    pub(crate) places: &'a [MeshPoint],
    pub(crate) faces: &'a [[u32; 3]],
}

impl MeshSamples<'_> {
    /// A column at each place: numbers are weighted means of those at the corners, colours in
    /// linear light; whole numbers that are no colours are those of the nearest corner.
    pub(crate) fn blend(
        &self,
        column: &ColumnView<'_>,
        job: &Job<'_>,
        share: Range<f64>,
    ) -> Result<ColumnValues> {
        let components = column.components as usize;
        let is_color = column.name == COLOR;
        macro_rules! nearest {
            ($slice:expr) => {
                self.each(components, job, share, |place, component| {
                    $slice[self.nearest(place) * components + component]
                })?
            };
        }
        Ok(match column.values {
            Values::F32(slice) => {
                ColumnValues::F32(self.each(components, job, share, |place, i| {
                    self.mean(place, |corner| f64::from(slice[corner * components + i])) as f32
                })?)
            }
            Values::F64(slice) => {
                ColumnValues::F64(self.each(components, job, share, |place, i| {
                    self.mean(place, |corner| slice[corner * components + i])
                })?)
            }
            Values::U8(slice) if is_color => {
                let decode = |code: u8| srgb_to_linear(f32::from(code) / 255.0);
                let linear: Vec<f32> = (0..=255).map(decode).collect();
                ColumnValues::U8(self.each(components, job, share, |place, i| {
                    let code = |corner: usize| slice[corner * components + i];
                    if i == 3 {
                        return self.mean(place, |corner| f64::from(code(corner))).round() as u8;
                    }
                    let mean =
                        self.mean(place, |corner| f64::from(linear[usize::from(code(corner))]));
                    (linear_to_srgb(mean as f32) * 255.0).round() as u8
                })?)
            }
            Values::U16(slice) if is_color => {
                ColumnValues::U16(self.each(components, job, share, |place, i| {
                    let code = |corner: usize| slice[corner * components + i];
                    if i == 3 {
                        return self.mean(place, |corner| f64::from(code(corner))).round() as u16;
                    }
                    let linear = |code: u16| f64::from(srgb_to_linear(f32::from(code) / 65535.0));
                    let mean = self.mean(place, |corner| linear(code(corner)));
                    (linear_to_srgb(mean as f32) * 65535.0).round() as u16
                })?)
            }
            Values::I8(slice) => ColumnValues::I8(nearest!(slice)),
            Values::U8(slice) => ColumnValues::U8(nearest!(slice)),
            Values::I16(slice) => ColumnValues::I16(nearest!(slice)),
            Values::U16(slice) => ColumnValues::U16(nearest!(slice)),
            Values::I32(slice) => ColumnValues::I32(nearest!(slice)),
            Values::U32(slice) => ColumnValues::U32(nearest!(slice)),
        })
    }

    /// A value for each component at each place, on the host's threads.
    fn each<T: Send>(
        &self,
        components: usize,
        job: &Job<'_>,
        share: Range<f64>,
        value: impl Fn(&MeshPoint, usize) -> T + Sync,
    ) -> Result<Vec<T>> {
        job.map(self.places.len() * components, share, |number| {
            value(&self.places[number / components], number % components)
        })
    }

    /// The weighted mean of what the corners have. A corner of weight 0 has no say, so that at a
    /// vertex the value is its own, whatever the others are.
    fn mean(&self, place: &MeshPoint, value: impl Fn(usize) -> f64) -> f64 {
        let corners = self.faces[place.face as usize].iter().zip(place.weights);
        let heard = corners.filter(|(_, weight)| *weight > 0.0);
        heard.map(|(&corner, weight)| weight * value(corner as usize)).sum()
    }

    /// The corner of the largest weight.
    fn nearest(&self, place: &MeshPoint) -> usize {
        let [a, b, c] = place.weights;
        let corner = if a >= b && a >= c { 0 } else { 1 + usize::from(c > b) };
        self.faces[place.face as usize][corner] as usize
    }
}
