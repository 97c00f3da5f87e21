//! The C form of clouds; values stay where they are.

use surfelshop_api::abi::table::{Bytes, RawCloud, RawColumn};
use surfelshop_api::{CloudView, ObjectFrame};

pub(super) fn raw_columns(cloud: &CloudView<'_>) -> Vec<RawColumn> {
    cloud
        .columns
        .iter()
        .map(|column| RawColumn {
            name: Bytes::of(column.name.as_bytes()),
            element: column.values.element() as u32,
            components: column.components,
            generation: column.generation,
            values: column.values.as_ptr(),
            len: column.values.len(),
        })
        .collect()
}

fn raw_object(object: &ObjectFrame) -> [f64; 8] {
    let ([x, y, z], [qx, qy, qz, qw]) = (object.center.to_array(), object.rotation.to_array());
    [x, y, z, object.size, qx, qy, qz, qw]
}

pub(super) fn raw_cloud(cloud: &CloudView<'_>, columns: &[RawColumn]) -> RawCloud {
    RawCloud {
        origin: cloud.origin.to_array(),
        len: cloud.len,
        columns: columns.as_ptr(),
        n_columns: columns.len(),
        faces: cloud.faces.as_ptr(),
        n_faces: cloud.faces.len(),
        object: raw_object(&cloud.object),
    }
}
