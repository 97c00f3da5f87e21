//! Makes a cloud of a file's points, whatever the format: finds the columns that have a meaning,
//! drops and repairs what cannot be drawn, estimates what is missing, and counts all of it.

mod appearance;
mod foreign;
mod position;
mod shape;

use crate::buffer::Buffer;
use crate::cloud::Cloud;
use crate::column::Column;
use crate::error::ReadFault;
use crate::read::{Loaded, ReadOptions};
use crate::summary::Summary;
use crate::table::Table;
use glam::Vec3;
use surfelshop_api::columns::{NORMAL, POSITION, RADIUS};

/// A cloud of the table's points.
pub(crate) fn cloud(mut table: Table, options: &ReadOptions<'_>) -> Result<Loaded, ReadFault> {
    let mut summary = Summary {
        format: std::mem::take(&mut table.format),
        n_in_file: table.n_rows as u64,
        warnings: std::mem::take(&mut table.warnings),
        ..Summary::default()
    };
    let placed = position::take(&mut table, &mut summary)?;
    let shape = shape::take(&mut table, &placed.positions, options, &mut summary)?;
    position::warn_if_coarse(&placed.positions, &shape.radii, &mut summary);
    let mut columns = vec![
        Column::new(POSITION, 3, flat(&placed.positions)),
        Column::new(NORMAL, 3, flat(&shape.normals)),
        Column::new(RADIUS, 1, Buffer::F32(shape.radii)),
    ];
    columns.extend(appearance::take(&mut table, &mut summary));
    columns.extend(shape.tangents);
    columns.extend(foreign::take(&mut table, &mut summary));
    // Every rule that `Cloud::new` checks is established above; were one missed, the load fails
    // with the column's name rather than hand out a cloud that cannot be drawn.
    let cloud = Cloud::new(placed.origin, columns).map_err(|error| ReadFault::Value {
        place: "columns".to_owned(),
        expected: "columns that make a cloud".to_owned(),
        found: error.to_string(),
    })?;
    summary.n_surfels = cloud.len() as u64;
    summary.origin = placed.origin.to_array();
    summary.columns = cloud.columns().iter().map(|column| column.name().to_owned()).collect();
    summary.comments =
        table.comments.into_iter().filter(|comment| !comment.starts_with("surfelshop ")).collect();
    Ok(Loaded { cloud, summary })
}

/// Vectors as a flat buffer.
fn flat(vectors: &[Vec3]) -> Buffer {
    Buffer::F32(bytemuck::cast_slice(vectors).to_vec())
}

/// Three columns as vectors in f32; what exceeds its range becomes infinite.
fn vectors(parts: &[Buffer; 3]) -> Vec<Vec3> {
    let [x, y, z] = parts.each_ref().map(Buffer::to_f32);
    x.iter().zip(&y).zip(&z).map(|((&x, &y), &z)| Vec3::new(x, y, z)).collect()
}
