//! Clouds as messages: what their columns are in a head, and values and triangles as parts.

use super::wire::Part;
use crate::boundary::of_aligned;
use serde::{Deserialize, Serialize};
use surfelshop_api::columns::{Element, Values};
use surfelshop_api::glam::{DQuat, DVec3};
use surfelshop_api::{CloudView, ColumnView, ObjectFrame};

/// A cloud without its values. Two are the same where the values are: generations say so.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct CloudHead {
    len: u64,
    columns: Vec<ColumnHead>,
    n_faces: u64,
    /// Origin; centre, size and rotation of its own box.
    place: [f64; 11],
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct ColumnHead {
    name: String,
    components: u32,
    generation: u64,
    element: Element,
    len: u64,
}

/// The elements of a column as bytes.
pub(super) fn bytes<'a>(values: &Values<'a>) -> &'a [u8] {
    match *values {
        Values::I8(values) => bytemuck::cast_slice(values),
        Values::U8(values) => values,
        Values::I16(values) => bytemuck::cast_slice(values),
        Values::U16(values) => bytemuck::cast_slice(values),
        Values::I32(values) => bytemuck::cast_slice(values),
        Values::U32(values) => bytemuck::cast_slice(values),
        Values::F32(values) => bytemuck::cast_slice(values),
        Values::F64(values) => bytemuck::cast_slice(values),
    }
}

impl CloudHead {
    pub(super) fn of(cloud: &CloudView<'_>) -> Self {
        let column = |column: &ColumnView<'_>| ColumnHead {
            name: column.name.to_owned(),
            components: column.components,
            generation: column.generation,
            element: column.values.element(),
            len: column.values.len() as u64,
        };
        let ObjectFrame { center, size, rotation } = cloud.object;
        let ([x, y, z], [cx, cy, cz]) = (cloud.origin.to_array(), center.to_array());
        let [qx, qy, qz, qw] = rotation.to_array();
        Self {
            len: cloud.len as u64,
            columns: cloud.columns.iter().map(column).collect(),
            n_faces: cloud.faces.len() as u64,
            place: [x, y, z, cx, cy, cz, size, qx, qy, qz, qw],
        }
    }

    /// How many parts go with it.
    pub(super) fn n_parts(&self) -> usize {
        self.columns.len() + 1
    }

    /// The cloud with its parts, of which there are too few where they were cut.
    pub(super) fn view<'a>(&'a self, parts: &'a [Part]) -> CloudView<'a> {
        let part = |i: usize| parts.get(i).map_or(&[][..], Part::bytes);
        let columns = self.columns.iter().enumerate().map(|(i, column)| ColumnView {
            name: &column.name,
            components: column.components,
            generation: column.generation,
            values: of_aligned(column.element, part(i)),
        });
        let [x, y, z, cx, cy, cz, size, qx, qy, qz, qw] = self.place;
        CloudView {
            origin: DVec3::new(x, y, z),
            len: self.len as usize,
            columns: columns.collect(),
            faces: bytemuck::try_cast_slice(part(self.columns.len())).unwrap_or_default(),
            object: ObjectFrame {
                center: DVec3::new(cx, cy, cz),
                size,
                rotation: DQuat::from_xyzw(qx, qy, qz, qw),
            },
        }
    }
}

/// The parts that go with a cloud's head.
pub(super) fn parts<'a>(cloud: &CloudView<'a>) -> Vec<&'a [u8]> {
    let columns = cloud.columns.iter().map(|column| bytes(&column.values));
    columns.chain([bytemuck::cast_slice(cloud.faces)]).collect()
}
