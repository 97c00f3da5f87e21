//! What the tools share: reading a cloud, checking numbers, progress, and new columns.

use std::ops::{ControlFlow, Range};
use surfelshop_api::columns::{NORMAL, POSITION, RADIUS, TANGENT_U, TANGENT_V, Values};
use surfelshop_api::glam::Vec3;
use surfelshop_api::prelude::*;
use surfelshop_api::tool::NewColumn;

/// The positions; an error where there are none.
pub(crate) fn positions(cloud: &CloudView<'_>) -> Result<Vec<Vec3>> {
    if cloud.len == 0 {
        return Err(Error::new("expected surfels, found an empty cloud"));
    }
    let positions: Vec<Vec3> = cloud.vectors(POSITION).collect();
    if positions.len() != cloud.len {
        return Err(Error::new("expected a column `position` of three f32, found none"));
    }
    Ok(positions)
}

/// Normals; empty where there is no such column.
pub(crate) fn normals(cloud: &CloudView<'_>) -> Vec<Vec3> {
    cloud.vectors(NORMAL).collect()
}

/// A number that the tool cannot work without.
pub(crate) fn finite(id: &str, value: f64) -> Result<f64> {
    match value.is_finite() {
        true => Ok(value),
        false => Err(Error::new(format!("expected a finite number for `{id}`, found {value}"))),
    }
}

/// Takes the progress of a step of the geometry as a share of the job's, and stops it with the job.
pub(crate) fn progress_of<'a>(
    job: &'a Job<'_>,
    share: Range<f64>,
    message: &'a str,
) -> impl Fn(f64) -> ControlFlow<()> + 'a {
    move |fraction| {
        job.progress(share.start + fraction * (share.end - share.start), message);
        if job.cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// Vectors as a flat row.
pub(crate) fn flat(vectors: &[Vec3]) -> Vec<f32> {
    vectors.iter().flat_map(|vector| vector.to_array()).collect()
}

/// A column of `f32`.
pub(crate) fn floats<'a>(name: &'a str, components: u32, values: &'a [f32]) -> NewColumn<'a> {
    NewColumn { name, components, values: Values::F32(values) }
}

/// Stages radii, and the tangents of elliptical surfels, whose axes grow and shrink alike.
pub(crate) fn stage_radii(cloud: &CloudView<'_>, radii: &[f32], job: &Job<'_>) -> Result<()> {
    let before = cloud.floats(RADIUS, 1);
    let resized = |name: &str| -> Option<Vec<f32>> {
        let (tangents, before) = (cloud.floats(name, 3)?, before?);
        let factors = radii.iter().zip(before).map(|(new, old)| new / old);
        let resized = tangents.chunks_exact(3).zip(factors).flat_map(|(tangent, factor)| {
            // A radius of 0 says nothing of the tangents.
            let factor = if factor.is_finite() { factor } else { 1.0 };
            [tangent[0] * factor, tangent[1] * factor, tangent[2] * factor]
        });
        let resized: Vec<f32> = resized.collect();
        resized.iter().all(|value| value.is_finite()).then_some(resized)
    };
    let tangents = [TANGENT_U, TANGENT_V].map(|name| (name, resized(name)));
    let mut columns = vec![floats(RADIUS, 1, radii)];
    for (name, values) in &tangents {
        columns.extend(values.as_deref().map(|values| floats(name, 3, values)));
    }
    job.edit(&Edit::Columns(columns))
}

/// Number of entries that are true.
pub(crate) fn count(mask: &[bool]) -> usize {
    mask.iter().filter(|kept| **kept).count()
}
