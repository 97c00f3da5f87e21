//! The samples of a cloud, made ready: in a box of unit size, in f64, copies merged.

use std::ops::{ControlFlow, Range};
use surfelshop_api::columns::{NORMAL, POSITION, RADIUS};
use surfelshop_api::glam::{DVec3, Vec3};
use surfelshop_api::prelude::*;
use surfelshop_geometry::{Bounds, Neighbours, normals, radii};

/// Nearest other places that are kept of each sample: the first ring and some of the second.
const NEAREST: usize = 10;

/// Most samples in one place that count; more say nothing new and would fill every list.
const MOST_IN_PLACE: usize = 4;

/// Samples and what is near each; lengths in units of the box.
pub(crate) struct Samples {
    pub(crate) points: Vec<DVec3>,
    /// Unit vectors that point outwards.
    pub(crate) normals: Vec<DVec3>,
    /// Radii of the discs that cover the surface.
    pub(crate) discs: Vec<f64>,
    /// For each sample its index in the cloud.
    pub(crate) index: Vec<u32>,
    /// For each sample those near it, nearest first.
    pub(crate) near: Vec<Vec<u32>>,
    /// Middle of the box, from the cloud's origin.
    pub(crate) centre: DVec3,
    /// Scene units per unit of the box.
    pub(crate) unit: f64,
    /// Diagonal of the box.
    pub(crate) diagonal: f64,
    /// How far a position is moved where it is rounded to single precision.
    pub(crate) grain: f64,
    /// Samples left out, since their position or normal is not finite or the normal is zero.
    pub(crate) n_refused: usize,
}

/// What comes of a cloud's places before anything is near anything.
struct Places {
    /// Samples of each place: a range of the samples.
    ranges: Vec<Range<u32>>,
    /// For each sample of the cloud its place; `NOWHERE` where it was left out.
    of: Vec<u32>,
    /// For each sample its index in the cloud.
    index: Vec<u32>,
}

const NOWHERE: u32 = u32::MAX;

impl Samples {
    /// Reads a cloud. Samples in one place count once, but for those whose normals differ by more
    /// than an angle of cosine `alike`: where faces meet, a place has a sample on each.
    pub(crate) fn of(
        cloud: &CloudView<'_>,
        alike: f64,
        share: Range<f64>,
        job: &Job<'_>,
    ) -> Result<Self> {
        let (positions, given) = read(cloud)?;
        let sound = |i: usize| positions[i].is_finite() && normals::is_valid(given[i]);
        let known: Vec<Vec3> =
            (0..positions.len()).map(|i| if sound(i) { positions[i] } else { Vec3::NAN }).collect();
        let given: Vec<DVec3> = given
            .iter()
            .map(|&n| normals::normalised(n).as_dvec3().normalize_or(DVec3::Z))
            .collect();
        let told = |from: f64, to: f64| told(job, within(&share, from), within(&share, to));
        let neighbours = Neighbours::build(&known, &told(0.0, 0.3))?;
        if neighbours.n_distinct() == 0 {
            return Err(Error::new("expected finite positions with normals, found none"));
        }
        let places = places(&known, &given, alike, neighbours.bounds());
        job.check()?;
        let discs = discs(cloud, &neighbours, &given, &told(0.3, 0.6))?;

        let bounds = neighbours.bounds();
        let extent = bounds.extent();
        // A power of two, so that scaling rounds nothing.
        let unit = if extent > 0.0 { 2f64.powi(extent.log2().ceil() as i32) } else { 1.0 };
        let centre = bounds.centre();
        let points: Vec<DVec3> = (places.index.iter())
            .map(|&i| (positions[i as usize].as_dvec3() - centre) / unit)
            .collect();
        let near = job.map(points.len(), within(&share, 0.6)..share.end, |sample| {
            let index = places.index[sample] as usize;
            let own = places.of[index];
            let around = neighbours.nearest(index, NEAREST);
            let others = around.iter().map(|neighbour| places.of[neighbour.index]);
            let all = std::iter::once(own).chain(others);
            let samples = all
                .flat_map(|place| places.ranges.get(place as usize).cloned().into_iter().flatten());
            samples.filter(|&other| other as usize != sample).collect()
        })?;
        let index = places.index;
        Ok(Self {
            normals: index.iter().map(|&i| given[i as usize]).collect(),
            discs: index.iter().map(|&i| discs[i as usize] / unit).collect(),
            points,
            near,
            centre,
            unit,
            diagonal: bounds.diagonal() / unit,
            grain: bounds.reach() / unit * f64::from(f32::EPSILON),
            n_refused: (0..known.len()).filter(|&i| !known[i].is_finite()).count(),
            index,
        })
    }

    /// Number of samples.
    pub(crate) fn len(&self) -> usize {
        self.points.len()
    }

    /// The point of a sample.
    pub(crate) fn point(&self, sample: u32) -> DVec3 {
        self.points[sample as usize]
    }

    /// The normal of a sample.
    pub(crate) fn normal(&self, sample: u32) -> DVec3 {
        self.normals[sample as usize]
    }

    /// The radius of a sample's disc.
    pub(crate) fn disc(&self, sample: u32) -> f64 {
        self.discs[sample as usize]
    }
}

/// A place in a share of the progress.
pub(crate) fn within(share: &Range<f64>, fraction: f64) -> f64 {
    share.start + fraction * (share.end - share.start)
}

/// Takes the progress of a step of the geometry as a share of the job's, and stops it with the job.
fn told(job: &Job<'_>, start: f64, end: f64) -> impl Fn(f64) -> ControlFlow<()> {
    move |fraction| {
        job.progress(start + fraction * (end - start), "");
        if job.cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// Positions and normals of a cloud.
fn read(cloud: &CloudView<'_>) -> Result<(Vec<Vec3>, Vec<Vec3>)> {
    if cloud.len == 0 {
        return Err(Error::new("expected samples, found an empty cloud"));
    }
    let positions: Vec<Vec3> = cloud.vectors(POSITION).collect();
    if positions.len() != cloud.len {
        return Err(Error::new("expected a column `position` of three f32, found none"));
    }
    let given: Vec<Vec3> = cloud.vectors(NORMAL).collect();
    if given.len() != cloud.len {
        return Err(Error::new(
            "expected a column `normal` of three f32, found none; run the tool `normals` first",
        ));
    }
    Ok((positions, given))
}

/// Radii of the samples' discs, scene units: those of the cloud, or estimates.
fn discs(
    cloud: &CloudView<'_>,
    neighbours: &Neighbours,
    given: &[DVec3],
    progress: &dyn Fn(f64) -> ControlFlow<()>,
) -> Result<Vec<f64>> {
    let sound = |radius: f32| radius.is_finite() && radius > 0.0;
    let column = cloud.floats(RADIUS, 1).filter(|radii| radii.len() == cloud.len);
    if let Some(radii) = column.filter(|radii| radii.iter().all(|&radius| sound(radius))) {
        return Ok(radii.iter().copied().map(f64::from).collect());
    }
    let given: Vec<Vec3> = given.iter().map(|normal| normal.as_vec3()).collect();
    let estimates = radii::estimate_with(neighbours, &given, &[], progress)?;
    let found = estimates.iter().enumerate().map(|(i, &estimate)| {
        let radius = column.map_or(estimate, |radii| radii[i]);
        f64::from(if sound(radius) { radius } else { estimate })
    });
    Ok(found.collect())
}

/// A sample's place along a curve, its coordinates and normal bit by bit, and its index.
type Key = (u64, [u32; 3], [u64; 3], u32);

/// Groups samples by place, and keeps those of each that differ. Places are in the order of a curve that
/// fills the box, so that what is near is near in memory, and so that the order of the cloud says nothing.
fn places(known: &[Vec3], normals: &[DVec3], alike: f64, bounds: Bounds) -> Places {
    let key = |(i, point): (usize, &Vec3)| -> Key {
        // Adding zero makes the two zeros one.
        let point = *point + Vec3::ZERO;
        let in_box = (point.as_dvec3() - bounds.min) / bounds.extent().max(f64::MIN_POSITIVE);
        let normal = normals[i].to_array().map(f64::to_bits);
        (curve(in_box), point.to_array().map(f32::to_bits), normal, i as u32)
    };
    let finite = known.iter().enumerate().filter(|(_, point)| point.is_finite());
    let mut keys: Vec<Key> = finite.map(key).collect();
    keys.sort_unstable();
    let mut places = Places {
        ranges: Vec::with_capacity(keys.len()),
        of: vec![NOWHERE; known.len()],
        index: Vec::with_capacity(keys.len()),
    };
    for (place, group) in keys.chunk_by(|a, b| a.1 == b.1).enumerate() {
        let start = places.index.len();
        for &(.., i) in group {
            places.of[i as usize] = place as u32;
            let new = |&other: &u32| normals[other as usize].dot(normals[i as usize]) < alike;
            let kept = &places.index[start..];
            if kept.len() < MOST_IN_PLACE && kept.iter().all(new) {
                places.index.push(i);
            }
        }
        places.ranges.push(start as u32..places.index.len() as u32);
    }
    places
}

/// The place of a point of the unit cube along a Morton curve: the bits of its coordinates in turns.
fn curve(point: DVec3) -> u64 {
    let spread = |coordinate: f64| {
        let cell = (coordinate * f64::from(1 << 21)) as u64;
        (0..21).fold(0, |bits, i| bits | ((cell.min((1 << 21) - 1) >> i & 1) << (3 * i)))
    };
    spread(point.x) | spread(point.y) << 1 | spread(point.z) << 2
}
