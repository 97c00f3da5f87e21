//! The columns of all points together.

use crate::Colors;
use crate::accessor::Shape;
use crate::mesh::{Mesh, Vertices};
use crate::scene::Instance;
use crate::splats::{Part, Splats};
use gltf::json::accessor::ComponentType;
use std::collections::HashMap;
use surfelshop_api::columns::{
    AO, COLOR, Element, MATERIAL, NORMAL, POSITION, RADIUS, TANGENT_U, TANGENT_V,
};
use surfelshop_api::format::{CloudSink, FileColumn};
use surfelshop_api::glam::DMat4;

/// Most columns of own names.
const MAX_OWN: usize = 1000;

/// What a column holds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Content {
    Position,
    Normal,
    Color,
    Splat(Part),
    /// The attribute of this name.
    Own(String),
}

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Column {
    pub content: Content,
    pub column: FileColumn,
}

/// The columns of a file.
pub(crate) struct Columns {
    pub columns: Vec<Column>,
    /// Names of attributes that cannot be told apart from others, or are too many.
    pub left_out: Vec<String>,
}

/// The type that an attribute of an own name has in a column.
fn element(shape: Shape) -> Element {
    match shape.kind {
        ComponentType::F32 => Element::F32,
        _ if shape.normalized => Element::F32,
        ComponentType::I8 => Element::I8,
        ComponentType::U8 => Element::U8,
        ComponentType::I16 => Element::I16,
        ComponentType::U16 => Element::U16,
        ComponentType::U32 => Element::U32,
    }
}

/// The name of a column of an own attribute; another one where a column of that name is something else.
fn own_name(name: &str, components: u32, element: Element) -> String {
    let floats = matches!(element, Element::F32 | Element::F64);
    let is_taken = match name {
        POSITION | NORMAL | COLOR => true,
        TANGENT_U | TANGENT_V => components != 3 || !floats,
        RADIUS | AO => components != 1 || !floats,
        MATERIAL => components != 1,
        _ => false,
    };
    if is_taken { format!("{name}_") } else { name.to_owned() }
}

impl Columns {
    /// Finds the columns that somebody reads.
    pub(crate) fn new(
        instances: &[Instance],
        meshes: &[Option<Mesh>],
        colors: Colors,
        clouds: &CloudSink<'_>,
    ) -> Self {
        let shown = || instances.iter().filter_map(|instance| meshes.get(instance.mesh)?.as_ref());
        let vertices = || {
            // Each mesh once, however often it is shown.
            meshes.iter().flatten().flat_map(|mesh| &mesh.vertices)
        };
        let stays = instances.iter().all(|instance| instance.matrix == DMat4::IDENTITY);
        let narrow = |vertices: &Vertices| vertices.position.shape.kind == ComponentType::F32;
        let element = if stays && vertices().all(narrow) { Element::F32 } else { Element::F64 };
        let mut found = Self { columns: Vec::new(), left_out: Vec::new() };
        found.push(Content::Position, FileColumn::new(POSITION, 3, element));
        if shown().next().is_some() {
            if vertices().any(|vertices| vertices.normal.is_some()) {
                found.push(Content::Normal, FileColumn::new(NORMAL, 3, Element::F32));
            }
            let splats: Vec<&Splats> =
                vertices().filter_map(|vertices| vertices.splats.as_ref()).collect();
            if let Some(n_orders) = splats.iter().map(|splats| splats.n_orders()).max() {
                let own = [Part::Opacity, Part::Scale, Part::Rotation];
                for part in own.into_iter().chain((0..n_orders).map(Part::Harmonics)) {
                    found.push(Content::Splat(part), part.column());
                }
            } else if let Some((element, components)) = color(vertices, colors) {
                found.push(Content::Color, FileColumn::new(COLOR, components, element));
            }
            found.own(vertices());
        }
        found.columns.retain(|column| {
            column.content == Content::Position || clouds.wants(&column.column.name)
        });
        found
    }

    fn push(&mut self, content: Content, column: FileColumn) {
        self.columns.push(Column { content, column });
    }

    fn own<'a>(&mut self, all: impl Iterator<Item = &'a Vertices>) {
        let mut order: Vec<&str> = Vec::new();
        // For each name its shape; none where meshes do not agree.
        let mut known: HashMap<&str, Option<(Element, usize)>> = HashMap::new();
        for attribute in all.flat_map(|vertices| &vertices.own) {
            let shape = attribute.accessor.shape;
            let new = (element(shape), shape.components);
            let before = known.entry(&attribute.name).or_insert_with(|| {
                order.push(&attribute.name);
                Some(new)
            });
            *before = before.and_then(|(element, components)| {
                let element = if element == new.0 { element } else { Element::F64 };
                (components == new.1).then_some((element, components))
            });
        }
        for (place, name) in order.into_iter().enumerate() {
            let Some(Some((element, components))) = known.get(name).filter(|_| place < MAX_OWN)
            else {
                self.left_out.push(name.to_owned());
                continue;
            };
            // 1 to 4.
            let components = *components as u32;
            let column =
                FileColumn::new(own_name(name, components, *element), components, *element);
            if self.columns.iter().any(|other| other.column.name == column.name) {
                self.left_out.push(name.to_owned());
            } else {
                self.push(Content::Own(name.to_owned()), column);
            }
        }
    }
}

/// The type and the components of colours; `None` where nothing has one.
fn color<'a, I: Iterator<Item = &'a Vertices>>(
    vertices: impl Fn() -> I,
    colors: Colors,
) -> Option<(Element, u32)> {
    if !vertices().any(|vertices| vertices.color.is_some() || vertices.base.is_stated) {
        return None;
    }
    let shape = |vertices: &Vertices| vertices.color.as_ref().map(|color| color.shape);
    let four = |vertices: &Vertices| {
        shape(vertices).is_some_and(|shape| shape.components == 4) || vertices.base.factor[3] != 1.0
    };
    let components = if vertices().any(four) { 4 } else { 3 };
    let first = vertices().next().and_then(shape).map(|shape| shape.kind);
    let plain = |vertices: &Vertices| {
        vertices.base.factor == [1.0; 4] && shape(vertices).map(|shape| shape.kind) == first
    };
    let stays = colors == Colors::Encoded && vertices().all(plain);
    let element = match first {
        Some(ComponentType::U8) if stays => Element::U8,
        Some(ComponentType::U16) if stays => Element::U16,
        _ => Element::F32,
    };
    Some((element, components))
}
