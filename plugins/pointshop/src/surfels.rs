//! What the tools share: a cloud in f64, its spacing, checked numbers and progress.

use crate::search::Search;
use std::ops::{ControlFlow, Range};
use surfelshop_api::columns::{NORMAL, POSITION, RADIUS, Values};
use surfelshop_api::glam::{DVec3, Vec3};
use surfelshop_api::prelude::*;
use surfelshop_api::tool::NewColumn;

/// Places, normals and radii of surfels, in f64 around an origin of their own.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surfels {
    /// Places, scene units from the origin.
    pub(crate) places: Vec<DVec3>,
    /// Unit normals.
    pub(crate) normals: Vec<DVec3>,
    /// Radii, scene units, above 0.
    pub(crate) radii: Vec<f64>,
}

impl Surfels {
    /// The surfels of a cloud.
    ///
    /// # Errors
    /// Where the cloud is empty or lacks positions or normals.
    pub(crate) fn of(cloud: &CloudView<'_>) -> Result<Self> {
        if cloud.len == 0 {
            return Err(Error::new("expected surfels, found an empty cloud"));
        }
        let places: Vec<DVec3> = cloud.vectors(POSITION).map(Vec3::as_dvec3).collect();
        if places.len() != cloud.len {
            return Err(Error::new("expected a column `position` of three f32, found none"));
        }
        let unit = |normal: Vec3| normal.as_dvec3().normalize_or(DVec3::Z);
        let normals: Vec<DVec3> = cloud.vectors(NORMAL).map(unit).collect();
        if normals.len() != cloud.len {
            return Err(Error::new(
                "expected a column `normal` of three f32, found none; the tool `normals` \
                 estimates them",
            ));
        }
        let radii = cloud.floats(RADIUS, 1).unwrap_or_default();
        let radii = radii.iter().map(|&radius| f64::from(radius)).collect();
        Ok(Self { places, normals, radii })
    }
}

/// Points whose distances tell how far surfels are apart.
const COUNTED: usize = 8;

/// How far surfels are apart around each place: the root of the area that each of the nearest
/// eight has of the circle around them. Where all coincide it is the median of the others, and 0
/// where there are none.
///
/// # Errors
/// Where the job is to stop.
pub(crate) fn spacings(
    search: &Search,
    places: &[DVec3],
    job: &Job<'_>,
    share: Range<f64>,
) -> Result<Vec<f64>> {
    let mut found = job.map(places.len(), share, |i| {
        let near = search.nearest(places[i], COUNTED + 1, f64::INFINITY);
        let circle = near.last().map_or(0.0, |last| std::f64::consts::PI * last.squared);
        (circle / (near.len().max(2) as f64 - 0.5)).sqrt()
    })?;
    let middle = median(found.iter().copied().filter(|spacing| *spacing > 0.0)).unwrap_or(0.0);
    for spacing in &mut found {
        if *spacing <= 0.0 {
            *spacing = middle;
        }
    }
    Ok(found)
}

/// The median; of an even number the upper of the two in the middle.
pub(crate) fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
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
pub(crate) fn flat(vectors: impl IntoIterator<Item = DVec3>) -> Vec<f32> {
    vectors.into_iter().flat_map(|vector| vector.as_vec3().to_array()).collect()
}

/// A column of `f32`.
pub(crate) fn floats<'a>(name: &'a str, components: u32, values: &'a [f32]) -> NewColumn<'a> {
    NewColumn { name, components, values: Values::F32(values) }
}
