//! Surface normals from positions, and repair of single ones.

mod fit;
mod lines;
mod orientation;
mod outwards;
mod plane;
mod repair;
mod sharpen;
pub(crate) mod signs;
mod soften;
mod steps;

use crate::neighbours::{Neighbours, SEARCH_SHARE};
use crate::progress::{Cancelled, Progress, part};
use fit::Fits;
use glam::{DVec3, Vec3};
use orientation::{Patches, RunPatches};
pub use repair::{Repair, repair};
pub use soften::soften;
use std::f32::consts::FRAC_PI_2;

/// Neighbours a normal is fitted to where nobody says otherwise: two rings of a hexagonal
/// sampling, enough to average noise and few enough to follow curvature.
pub const DEFAULT_NEIGHBOURS: usize = 16;

/// Normals of a whole cloud.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Estimate {
    /// One finite unit vector per position.
    pub normals: Vec<Vec3>,
    /// For each position how flat its surroundings are, in [0, 1]: the mean, over some 16 points that lie together, of
    /// 1 less the standard deviation across the fitted plane over that along the shorter side in it. 1 on a
    /// plane, less at edges and in noise, least where points fill space; what is degenerate counts as 0. 1 where there
    /// are at most [`DEFAULT_NEIGHBOURS`] points.
    pub planarity: Vec<f32>,
    /// For each position about the angle by which its normal may be off since its neighbours are scattered about a
    /// plane, radians in [0, π/2]: the standard error of the fit. At edges and where the surface bends it may be off
    /// by more; π/2 for what is degenerate.
    pub errors: Vec<f32>,
    /// Positions whose surroundings do not span a plane and that got a fallback; coincident ones
    /// and those that are not finite are counted each.
    pub n_degenerate: usize,
    /// Distinct positions at edges whose normal is that of the face they lie in.
    pub n_sharpened: usize,
    /// Connected parts that were oriented independently of each other.
    pub n_components: usize,
}

/// Estimates outward unit normals from the points around each position.
///
/// The normal is the direction of least spread of the `k` nearest. Where these are scattered about their plane,
/// as by noise, or lie in a row, more are taken, up to about 800, as long as they lie nearer to a plane
/// for their extent. At an edge the normal is that of the flatter surroundings which the point lies in.
///
/// Signs are made consistent from point to point and turned outwards per connected part. A flat
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
    let fitting = part(progress, 0.0..0.85);
    let mut patches = Patches::with_room(neighbours.n_distinct());
    let mut fits = fit::all(neighbours, k, &fitting, RunPatches::of, |run| patches.take(run))?;
    let flatness = flatness(neighbours, &fits.roughness);
    let orienting = part(progress, 0.85..0.9);
    let n_components = orientation::orient(neighbours, &mut fits, patches, &orienting)?;
    let n_sharpened = sharpen::edges(neighbours, &mut fits, &part(progress, 0.9..0.98))?;
    let Fits { normals, uncertainty, roughness, errors: scatter } = fits;
    drop((roughness, scatter));
    let step = |from: f64, to: f64| part(progress, from..to);
    // The largest first, so that fewer of the others are there twice.
    let by_place = normals;
    let normals = neighbours.by_index(Vec3::Z, &step(0.98, 0.99), |place| by_place[place])?;
    drop(by_place);
    let errors = neighbours.by_index(FRAC_PI_2, &step(0.99, 0.995), |place| uncertainty[place])?;
    drop(uncertainty);
    let planarity = planarity_of(neighbours, &flatness, &step(0.995, 1.0))?;
    let n_degenerate = errors.iter().filter(|&&error| error >= FRAC_PI_2).count();
    Ok(Estimate { normals, planarity, errors, n_degenerate, n_sharpened, n_components })
}

/// How flat the surroundings of positions are whose normals are known: [`Estimate::planarity`].
///
/// # Errors
/// Where `progress` asks to stop.
pub fn planarity(
    neighbours: &Neighbours,
    k: usize,
    progress: Progress<'_>,
) -> Result<Vec<f32>, Cancelled> {
    let fits = fit::all(neighbours, k, &part(progress, 0.0..0.98), |_| (), |()| ())?;
    planarity_of(neighbours, &flatness(neighbours, &fits.roughness), &part(progress, 0.98..1.0))
}

/// The mean planarity of the points of each leaf: that of a single point says little, since of the sizes of its
/// surroundings the flattest was taken. So few points as one neighbourhood has say nothing, and count as flat.
fn flatness(neighbours: &Neighbours, roughness: &[f32]) -> Vec<f32> {
    let tree = neighbours.tree();
    let of_leaf = |leaf: usize| {
        let rough = &roughness[tree.leaf(leaf)];
        let sum: f32 = rough.iter().map(|roughness| 1.0 - roughness).sum();
        sum / rough.len().max(1) as f32
    };
    let is_little = neighbours.n_distinct() <= DEFAULT_NEIGHBOURS;
    (0..tree.n_leaves()).map(|leaf| if is_little { 1.0 } else { of_leaf(leaf) }).collect()
}

/// The flatness of the leaf of each position.
fn planarity_of(
    neighbours: &Neighbours,
    flatness: &[f32],
    progress: Progress<'_>,
) -> Result<Vec<f32>, Cancelled> {
    let missing = if neighbours.n_distinct() <= DEFAULT_NEIGHBOURS { 1.0 } else { 0.0 };
    let tree = neighbours.tree();
    neighbours.by_index(missing, progress, |place| flatness[tree.leaf_of(place)])
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

#[cfg(test)]
mod tests;
