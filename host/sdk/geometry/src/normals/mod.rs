//! Surface normals from positions, and repair of single ones.

mod orientation;
pub(crate) mod signed_sets;

use crate::eigen;
use crate::neighbours::{Neighbours, SEARCH_SHARE};
use crate::progress::{Cancelled, Progress, each, map, part, report};
use glam::{DMat3, DVec3, Vec3};
use orientation::{GRAPH_NEIGHBOURS, Links};

/// Neighbours a normal is fitted to where nobody says otherwise: two rings of a hexagonal
/// sampling, enough to average noise and few enough to follow curvature.
pub const DEFAULT_NEIGHBOURS: usize = 16;

/// Normals of a whole cloud.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Estimate {
    /// One finite unit vector per position.
    pub normals: Vec<Vec3>,
    /// Positions whose surroundings do not span a plane and that got a fallback; coincident ones
    /// and those that are not finite are counted each.
    pub n_degenerate: usize,
    /// Connected parts that were oriented independently of each other.
    pub n_components: usize,
}

/// Estimates outward unit normals from the `k` nearest neighbours of each position.
///
/// The normal is the direction of least spread of the neighbourhood, made consistent along a
/// minimum spanning tree of the neighbour graph and turned outwards per connected part. A flat
/// sheet has no outside: it is turned so that the largest component of its mean normal is positive.
///
/// Where fewer than three distinct points are near, or they lie on a line, the normal is, up to
/// sign, the unit vector perpendicular to the line that is closest to +z (+z for a lone point).
/// Coincident positions get the same normal; positions that are not finite get +z.
///
/// Source: Hoppe et al., Surface reconstruction from unorganized points, SIGGRAPH 1992, sections
/// 3.2 and 3.3; our deviations are documented where they are made.
///
/// # Errors
/// Where `progress` asks to stop.
pub fn estimate(
    positions: &[Vec3],
    k: usize,
    progress: Progress<'_>,
) -> Result<Estimate, Cancelled> {
    let neighbours = Neighbours::build(positions, &part(progress, 0.0..SEARCH_SHARE))?;
    estimate_with(&neighbours, k, &part(progress, SEARCH_SHARE..1.0))
}

/// [`estimate`] for a search structure that exists already.
///
/// # Errors
/// Where `progress` asks to stop.
pub fn estimate_with(
    neighbours: &Neighbours,
    k: usize,
    progress: Progress<'_>,
) -> Result<Estimate, Cancelled> {
    let fitting = part(progress, 0.0..0.68);
    let n = neighbours.n_distinct();
    let fits = map(n, &fitting, |place| fit(neighbours, place, k))?;
    let mut normals = map(n, &part(progress, 0.68..0.69), |place| fits[place].normal)?;
    let links = map(n, &part(progress, 0.69..0.7), |place| fits[place].links)?;
    let degenerate = map(n, &part(progress, 0.7..0.71), |place| fits[place].degenerate)?;
    drop(fits);
    let points = neighbours.distinct();
    let orienting = part(progress, 0.71..0.98);
    let n_components = orientation::orient(points, &mut normals, &degenerate, &links, &orienting)?;
    let mut n_degenerate = 0;
    let mut result = Vec::with_capacity(neighbours.len());
    each(neighbours.len(), &part(progress, 0.98..1.0), |index| {
        let place = neighbours.place_of(index);
        n_degenerate += usize::from(place.is_none_or(|place| degenerate[place]));
        result.push(place.map_or(Vec3::Z, |place| normals[place].as_vec3()));
    })?;
    Ok(Estimate { normals: result, n_degenerate, n_components })
}

/// The plane through a neighbourhood.
#[derive(Clone, Copy, Debug)]
struct Fit {
    normal: DVec3,
    degenerate: bool,
    links: Links,
}

/// Fits a plane to a point and its `k` nearest; the sign of the normal means nothing yet.
fn fit(neighbours: &Neighbours, place: usize, k: usize) -> Fit {
    let near = neighbours.around(place, k.max(GRAPH_NEIGHBOURS));
    let mut links = Links::default();
    links.set(near.iter().map(|&(other, _)| other));
    let distinct = neighbours.distinct();
    let points: Vec<DVec3> = std::iter::once(distinct[place])
        .chain(near.iter().take(k).map(|&(other, _)| distinct[other as usize]))
        .collect();
    // One rounding step of an f32 coordinate here, in units of the box: positions do not tell
    // apart what is closer together.
    let here = distinct[place] * neighbours.scale() + neighbours.bounds().centre();
    let grain = here.abs().max_element() * f64::from(f32::EPSILON) / neighbours.scale();
    let plane = plane(&points, grain);
    Fit { normal: plane.0, degenerate: plane.1, links }
}

/// Ratio of width to length below which a neighbourhood counts as a line: f32 positions of a line
/// that is not parallel to an axis deviate from it by 1e-7 of their magnitude, so that a hundred
/// times this is noise rather than shape.
const LINE_WIDTH: f64 = 1e-5;

/// Unit normal of the best plane through `points`, and whether they do not span one.
///
/// The covariance is summed in a second pass about the mean: the one-pass form
/// `E[x^2] - E[x]^2` gives negative variances for small features far from the origin.
fn plane(points: &[DVec3], grain: f64) -> (DVec3, bool) {
    let mean = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
    let size = points.iter().map(|&p| p.distance(mean)).fold(0.0, f64::max);
    if points.len() < 2 || size <= 0.0 {
        return (DVec3::Z, true);
    }
    // Divided by their size, offsets of 1e-200 still have squares.
    let covariance = points.iter().fold(DMat3::ZERO, |sum, &point| {
        let d = (point - mean) / size;
        sum + DMat3::from_cols(d * d.x, d * d.y, d * d.z)
    });
    let eigen = eigen::symmetric(covariance * (1.0 / points.len() as f64));
    let width = eigen.values[1].max(0.0).sqrt();
    let length = eigen.values[2].max(0.0).sqrt();
    if points.len() < 3 || width <= (LINE_WIDTH * length).max(grain / size) {
        return (perpendicular_to(eigen.vectors[2]), true);
    }
    (eigen.vectors[0], false)
}

/// The unit vector perpendicular to a unit vector that is closest to +z; +y where that is z itself.
fn perpendicular_to(direction: DVec3) -> DVec3 {
    let rest = DVec3::Z - direction * direction.z;
    // The length is the sine of the angle to z; below a millionth its direction is rounding.
    if rest.length_squared() > 1e-12 { rest.normalize_or(DVec3::Z) } else { DVec3::Y }
}

/// What [`repair`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Repair {
    /// Normals replaced by the mean of valid ones nearby.
    pub n_from_neighbours: usize,
    /// Normals estimated from positions, since no valid one was near.
    pub n_estimated: usize,
}

impl Repair {
    /// All normals that were replaced.
    #[must_use]
    pub fn total(&self) -> usize {
        self.n_from_neighbours + self.n_estimated
    }
}

/// Whether a normal has a direction: finite and not zero.
#[must_use]
pub fn is_valid(normal: Vec3) -> bool {
    normal.is_finite() && normal != Vec3::ZERO
}

/// A valid normal at unit length, any magnitude from 1e-45 to 3e38 included; +z for others.
#[must_use]
pub fn normalised(normal: Vec3) -> Vec3 {
    let wide = normal.as_dvec3();
    (wide / wide.abs().max_element()).try_normalize().unwrap_or(DVec3::Z).as_vec3()
}

/// Rounds in which repaired normals serve their neighbours in turn. Each bridges one neighbourhood;
/// what is farther than this from every valid normal is estimated, so that the work stays linear.
const ROUNDS: usize = 8;

/// Replaces normals that are zero or not finite, leaving all others as they are bit by bit.
///
/// A replaced normal is the mean of the valid ones among the `k` nearest points, weighted by inverse
/// distance; where they cancel out or there are none, it is estimated as in [`estimate`].
/// `normals` beyond the number of positions are left alone.
///
/// # Errors
/// Where `progress` asks to stop; `normals` are then unchanged.
pub fn repair(
    neighbours: &Neighbours,
    normals: &mut [Vec3],
    k: usize,
    progress: Progress<'_>,
) -> Result<Repair, Cancelled> {
    let mut open: Vec<usize> = (0..normals.len().min(neighbours.len()))
        .filter(|&index| !is_valid(normals[index]))
        .collect();
    let mut done = Repair::default();
    if open.is_empty() {
        return Ok(done);
    }
    let mut repaired = normals.to_vec();
    let rounds = if open.len() == normals.len() { 0 } else { ROUNDS };
    for round in 0..rounds {
        let step = 0.5 / rounds as f64;
        let progress = part(progress, round as f64 * step..(round + 1) as f64 * step);
        let found = map(open.len(), &progress, |i| blend(neighbours, &repaired, open[i], k))?;
        let before = open.len();
        for (&index, normal) in open.iter().zip(&found) {
            repaired[index] = normal.unwrap_or(repaired[index]);
        }
        open.retain(|&index| !is_valid(repaired[index]));
        done.n_from_neighbours += before - open.len();
        if open.is_empty() || open.len() == before {
            break;
        }
    }
    if !open.is_empty() {
        let estimate = estimate_with(neighbours, k, &part(progress, 0.5..1.0))?;
        done.n_estimated = open.len();
        for index in open {
            repaired[index] = estimate.normals[index];
        }
    }
    report(progress, 1.0)?;
    normals.copy_from_slice(&repaired);
    Ok(done)
}

/// Length of a weighted mean of unit normals below which they cancel out: half of them would have
/// to lie at more than 150 degrees to the rest.
const CANCELLED: f64 = 0.25;

/// The weighted mean of the valid normals near a position.
fn blend(neighbours: &Neighbours, normals: &[Vec3], index: usize, k: usize) -> Option<Vec3> {
    let near = neighbours.nearest(index, k);
    let nearest = near.first()?.distance;
    let (sum, weights) = near
        .iter()
        .filter(|n| normals.get(n.index).is_some_and(|&normal| is_valid(normal)))
        .map(|n| (nearest / n.distance, normalised(normals[n.index]).as_dvec3()))
        .fold((DVec3::ZERO, 0.0), |(sum, weights), (w, n)| (sum + w * n, weights + w));
    let mean = sum / weights;
    (weights > 0.0 && mean.length() > CANCELLED).then(|| mean.normalize_or(DVec3::Z).as_vec3())
}

#[cfg(test)]
mod tests;
