//! Elements of accessors as values of columns.

use crate::Colors;
use crate::accessor::{Reader, Shape};
use crate::buffers::Buffers;
use crate::columns::{Column, Content};
use crate::decode::{floats, numbers};
use crate::mesh::{Base, Vertices};
use crate::splats::SplatReader;
use gltf::json::accessor::ComponentType;
use surfelshop_api::columns::{Element, NEUTRAL_ALBEDO, Values};
use surfelshop_api::glam::{DMat3, DMat4, DVec3};
use surfelshop_api::params::srgb_to_linear;
use surfelshop_api::prelude::Result;

/// Values of a batch.
pub(crate) enum Decoded {
    I8(Vec<i8>),
    U8(Vec<u8>),
    I16(Vec<i16>),
    U16(Vec<u16>),
    I32(Vec<i32>),
    U32(Vec<u32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

impl Decoded {
    /// What the sink takes.
    pub(crate) fn values(&self) -> Values<'_> {
        match self {
            Self::I8(values) => Values::I8(values),
            Self::U8(values) => Values::U8(values),
            Self::I16(values) => Values::I16(values),
            Self::U16(values) => Values::U16(values),
            Self::I32(values) => Values::I32(values),
            Self::U32(values) => Values::U32(values),
            Self::F32(values) => Values::F32(values),
            Self::F64(values) => Values::F64(values),
        }
    }
}

/// How a mesh is moved.
#[derive(Clone, Copy)]
pub(crate) struct Movement {
    pub matrix: DMat4,
    /// For directions that are normal to surfaces: the cofactors, which are the transposed inverse but for a factor,
    /// and exist where there is no inverse.
    normals: DMat3,
}

impl Movement {
    pub(crate) fn new(matrix: DMat4) -> Self {
        let DMat3 { x_axis: x, y_axis: y, z_axis: z } = DMat3::from_mat4(matrix);
        let normals = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
        let mirrors = DMat3::from_mat4(matrix).determinant() < 0.0;
        Self { matrix, normals: if mirrors { -normals } else { normals } }
    }

    /// Whether triangles are seen from behind after it.
    pub(crate) fn mirrors(&self) -> bool {
        DMat3::from_mat4(self.matrix).determinant() < 0.0
    }
}

/// Points of a mesh that are read.
pub(crate) struct Source<'a> {
    vertices: &'a Vertices,
    movement: Movement,
    colors: Colors,
    columns: &'a [Column],
    /// For each column, the accessor of its values.
    readers: Vec<Option<Reader<'a>>>,
    splats: Option<SplatReader<'a>>,
}

impl<'a> Source<'a> {
    /// Ready to be read.
    ///
    /// # Errors
    /// As [`Accessor::reader`](crate::accessor::Accessor::reader).
    pub(crate) fn new(
        vertices: &'a Vertices,
        movement: Movement,
        colors: Colors,
        columns: &'a [Column],
        buffers: &'a Buffers,
    ) -> Result<Self> {
        let reader = |column: &Column| {
            let accessor = match &column.content {
                Content::Position => Some(&vertices.position),
                Content::Normal => vertices.normal.as_ref(),
                Content::Color => vertices.color.as_ref(),
                Content::Splat(_) => None,
                Content::Own(name) => {
                    let own = vertices.own.iter().find(|own| own.name == *name);
                    own.map(|own| &own.accessor)
                }
            };
            accessor.map(|accessor| accessor.reader(buffers)).transpose()
        };
        let readers = columns.iter().map(reader).collect::<Result<_>>()?;
        let splats = vertices.splats.as_ref();
        let matrix = DMat3::from_mat4(movement.matrix);
        let splats = splats.map(|splats| SplatReader::new(splats, matrix, buffers)).transpose()?;
        Ok(Self { vertices, movement, colors, columns, readers, splats })
    }

    /// The values of `n` points from the `first` on, for each column.
    ///
    /// # Errors
    /// Where memory runs out, or the system refuses.
    pub(crate) fn batch(&self, first: u32, n: usize) -> Result<Vec<Decoded>> {
        let mut batch = Vec::with_capacity(self.columns.len());
        for (column, reader) in self.columns.iter().zip(&self.readers) {
            if let (Content::Splat(part), Some(splats)) = (&column.content, &self.splats) {
                batch.push(Decoded::F32(splats.values(
                    *part,
                    column.column.components as usize,
                    first,
                    n,
                )?));
                continue;
            }
            let read = |reader: &Reader<'_>| -> Result<_> {
                Ok((reader.elements(first, n)?, reader.shape()))
            };
            let found = reader.as_ref().map(read).transpose()?;
            batch.push(self.column(column, found, n));
        }
        Ok(batch)
    }

    fn column(&self, column: &Column, found: Option<(Vec<u8>, Shape)>, n: usize) -> Decoded {
        let len = n * column.column.components as usize;
        match (&column.content, found) {
            (Content::Position, Some((bytes, shape))) => self.positions(column, &bytes, shape),
            (Content::Normal, Some((bytes, shape))) => {
                let turned = floats(&bytes, shape);
                let turn = |normal: &[f64; 3]| {
                    let turned = self.movement.normals * DVec3::from_array(*normal);
                    // What has no direction stays without one, and the host estimates it.
                    turned.normalize_or(DVec3::NAN).as_vec3().to_array()
                };
                Decoded::F32(turned.as_chunks::<3>().0.iter().flat_map(turn).collect())
            }
            (Content::Color, Some((bytes, shape))) => self.colors(column, &bytes, shape),
            (Content::Color, None) => {
                let base = without_color(&self.vertices.base);
                let components = column.column.components as usize;
                Decoded::F32(base[..components].iter().copied().cycle().take(len).collect())
            }
            (_, Some((bytes, shape))) => own(column, &bytes, shape),
            (_, None) => absent(column.column.element, len),
        }
    }

    fn positions(&self, column: &Column, bytes: &[u8], shape: Shape) -> Decoded {
        if column.column.element == Element::F32 {
            return Decoded::F32(numbers!(bytes, f32).collect());
        }
        let mut positions = floats(bytes, shape);
        let matrix = self.movement.matrix;
        if matrix != DMat4::IDENTITY {
            for position in positions.as_chunks_mut::<3>().0 {
                *position = matrix.transform_point3(DVec3::from_array(*position)).to_array();
            }
        }
        Decoded::F64(positions)
    }

    fn colors(&self, column: &Column, bytes: &[u8], shape: Shape) -> Decoded {
        let (from, to) = (shape.components, column.column.components as usize);
        match (column.column.element, shape.kind) {
            (Element::U8, ComponentType::U8) => {
                Decoded::U8(widened(bytes.iter().copied(), from, to, u8::MAX))
            }
            (Element::U16, ComponentType::U16) => {
                Decoded::U16(widened(numbers!(bytes, u16), from, to, u16::MAX))
            }
            _ => {
                let is_encoded = self.colors == Colors::Encoded && shape.kind != ComponentType::F32;
                let numbers = floats(bytes, shape).into_iter().map(|value| value as f32);
                let mut colors = widened(numbers, from, to, 1.0);
                for color in colors.chunks_exact_mut(to) {
                    for (channel, value) in color.iter_mut().enumerate() {
                        // Alpha is never encoded.
                        let linear =
                            if is_encoded && channel < 3 { srgb_to_linear(*value) } else { *value };
                        *value = linear * self.vertices.base.factor[channel];
                    }
                }
                Decoded::F32(colors)
            }
        }
    }
}

/// The colour of points that have none of their own.
fn without_color(base: &Base) -> [f32; 4] {
    let [red, green, blue] = NEUTRAL_ALBEDO;
    if base.is_stated { base.factor } else { [red, green, blue, base.factor[3]] }
}

/// Colours with as many components as the column; what they do not have is opaque.
fn widened<T: Copy>(values: impl Iterator<Item = T>, from: usize, to: usize, opaque: T) -> Vec<T> {
    if from == to {
        return values.collect();
    }
    let mut out = Vec::new();
    for (place, value) in values.enumerate() {
        out.push(value);
        if place % from == from - 1 {
            out.resize(out.len() + to - from, opaque);
        }
    }
    out
}

/// An attribute of an own name.
fn own(column: &Column, bytes: &[u8], shape: Shape) -> Decoded {
    match column.column.element {
        Element::I8 => Decoded::I8(numbers!(bytes, i8).collect()),
        Element::U8 => Decoded::U8(bytes.to_vec()),
        Element::I16 => Decoded::I16(numbers!(bytes, i16).collect()),
        Element::U16 => Decoded::U16(numbers!(bytes, u16).collect()),
        Element::U32 => Decoded::U32(numbers!(bytes, u32).collect()),
        // Accessors have no such numbers.
        Element::I32 => Decoded::I32(Vec::new()),
        Element::F32 => {
            Decoded::F32(floats(bytes, shape).into_iter().map(|value| value as f32).collect())
        }
        Element::F64 => Decoded::F64(floats(bytes, shape)),
    }
}

/// What stands where points do not have an attribute.
fn absent(element: Element, len: usize) -> Decoded {
    match element {
        Element::I8 => Decoded::I8(vec![0; len]),
        Element::U8 => Decoded::U8(vec![0; len]),
        Element::I16 => Decoded::I16(vec![0; len]),
        Element::U16 => Decoded::U16(vec![0; len]),
        Element::I32 => Decoded::I32(vec![0; len]),
        Element::U32 => Decoded::U32(vec![0; len]),
        Element::F32 => Decoded::F32(vec![f32::NAN; len]),
        Element::F64 => Decoded::F64(vec![f64::NAN; len]),
    }
}
