//! Makes a cloud of a file's points, whatever the format: finds the columns that have a meaning,
//! drops and repairs what cannot be drawn, estimates what is missing, and counts all of it.

mod appearance;
mod camera_frame;
mod foreign;
mod gaussians;
mod map;
pub(crate) mod memory_estimate;
mod mesh;
mod position;
mod shape;
mod side_guide;
mod sides;
mod trajectory;
mod vectors;

use crate::cloud::Cloud;
use crate::cloud::buffer::Buffer;
use crate::cloud::column::Column;
use crate::cloud::provenance::of_comments;
use crate::cloud::source::Source;
use crate::cloud::splat_columns;
use crate::error::ReadFault;
use crate::options::ReadOptions;
use crate::summary::{Loaded, Summary};
use crate::table::{NORMALS, RADII, Table};
pub(crate) use appearance::NARROW_COLORS;
pub use appearance::narrowed;
pub use camera_frame::camera_frame;
pub(crate) use gaussians::TrainedSplats;
pub(crate) use gaussians::{are_splats, woven as woven_splats};
pub use map::lies_on_map;
pub use side_guide::SideGuide;
use surfelshop_api::columns::{COLOR, NORMAL, POSITION, RADIUS};
use vectors::flat;

/// Share of the work that is reading rather than estimating, for the progress bar, where a file
/// has columns of these names.
pub(crate) fn share_of_reading<'a>(
    names: impl Iterator<Item = &'a str> + Clone,
    has_faces: bool,
    options: &ReadOptions<'_>,
) -> f64 {
    let has = |name: &str| names.clone().any(|own| own.eq_ignore_ascii_case(name));
    let normals = NORMALS.iter().any(|spelling| spelling.iter().all(|name| has(name)));
    let radii = options.radius.is_some() || RADII.iter().any(|[name]| has(name));
    match ((normals && radii) || gaussians::may_be_splats(names.clone()), has_faces) {
        (true, _) => 0.9,
        // Points without a face need estimates, which only shows when all is read.
        (false, true) => 0.5,
        (false, false) => 0.03,
    }
}

/// A cloud of the table's points.
pub(crate) fn cloud(
    table: Table,
    source: Source,
    options: &ReadOptions<'_>,
) -> Result<Loaded, ReadFault> {
    guided(table, source, None, options)
}

/// A cloud of the table's points, whose normals face the sides of a guide where they are estimated and no scanner
/// says them.
pub(crate) fn guided(
    mut table: Table,
    mut source: Source,
    guide: Option<&SideGuide>,
    options: &ReadOptions<'_>,
) -> Result<Loaded, ReadFault> {
    let mut summary = Summary {
        format: std::mem::take(&mut table.format),
        n_in_file: table.n_rows as u64,
        warnings: std::mem::take(&mut table.warnings),
        ..Summary::default()
    };
    let (n_rows, n_triangles) = (table.n_rows as u64, table.faces.len() as u64);
    memory_estimate::ask(&table.fields, n_rows, n_triangles, options, 0)
        .map_err(ReadFault::memory(table.n_rows))?;
    let placed = position::take(&mut table, &mut summary)?;
    source.camera_frame = camera_frame::before_camera(placed.origin, &placed.positions, &source);
    source.is_on_map = map::is_on_map(placed.origin, &placed.positions, &source);
    mesh::turn_outwards(&mut table, &placed.positions, &mut summary);
    let splats = gaussians::take(&mut table, options, &mut summary)?;
    let shape = match &splats {
        Some(splats) => splats.shape(&mut table, &placed, &mut summary),
        None => shape::take(&mut table, &placed, (&source, guide), options, &mut summary)?,
    };
    if !table.is_part && splats.is_none() {
        position::warn_if_coarse(&placed, &shape.radii, &mut summary);
    }
    let mut columns = vec![
        Column::new(POSITION, 3, flat(placed.positions)),
        Column::new(NORMAL, 3, flat(shape.normals)),
        Column::new(RADIUS, 1, Buffer::F32(shape.radii)),
    ];
    columns.extend(appearance::take(&mut table, options.color_bits, &mut summary));
    columns.extend(shape.others);
    if let Some(splats) = splats {
        let has_colors = columns.iter().any(|column| column.name() == COLOR);
        if !has_colors {
            columns.extend(splats.color(&mut summary));
        }
        columns.extend(splats.columns());
    }
    let foreign = foreign::take(&mut table, &columns, &mut summary);
    columns.extend(foreign);
    // Every rule that `Cloud::new` checks is established above; were one missed, the load fails
    // with the column's name rather than hand out a cloud that cannot be drawn.
    let cloud = Cloud::new(placed.origin, columns);
    let cloud = cloud.and_then(|cloud| cloud.with_faces(table.faces));
    let cloud = cloud.map_err(|error| ReadFault::Value {
        place: "columns".to_owned(),
        expected: "columns that make a cloud".to_owned(),
        found: error.to_string(),
    })?;
    let cloud = with_provenance(&cloud, &table.comments, &summary).with_source(source);
    summary.n_surfels = cloud.len() as u64;
    summary.splats = splat_columns(&cloud);
    summary.n_triangles = cloud.faces().len() as u64;
    summary.origin = placed.origin.to_array();
    summary.columns = cloud.columns().iter().map(|column| column.name().to_owned()).collect();
    summary.comments =
        table.comments.into_iter().filter(|comment| !comment.starts_with("surfelshop ")).collect();
    Ok(Loaded { cloud, summary })
}

/// The cloud with what the file's comments say of who made it. Columns that were not in the file
/// are this load's own, whatever the comments say.
fn with_provenance(cloud: &Cloud, comments: &[String], summary: &Summary) -> Cloud {
    let (made, history) = of_comments(comments);
    if made.is_empty() && history.is_empty() {
        return cloud.clone();
    }
    let is_of_file = |name: &str| match name {
        NORMAL => summary.normals.given + summary.normals.normalised > 0,
        RADIUS => summary.radii.given > 0,
        _ => true,
    };
    let of = |column: &Column| made.get(column.name()).filter(|_| is_of_file(column.name()));
    let columns = cloud.columns().iter().map(|column| column.made_by(of(column).cloned()));
    cloud.with_origin(cloud.origin(), columns.collect()).with_history(history)
}
