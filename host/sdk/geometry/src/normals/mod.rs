//! Surface normals from positions, and repair of single ones.

mod fit;
mod orientation;
mod plane;
mod repair;
mod sharpen;
pub(crate) mod signs;

use crate::neighbours::{Neighbours, SEARCH_SHARE};
use crate::progress::{Cancelled, Progress, each, map, part};
use glam::{DVec3, Vec3};
pub use repair::{Repair, repair};

/// Neighbours a normal is fitted to where nobody says otherwise: two rings of a hexagonal
/// sampling, enough to average noise and few enough to follow curvature.
pub const DEFAULT_NEIGHBOURS: usize = 16;

/// Normals of a whole cloud.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Estimate {
    /// One finite unit vector per position.
    pub normals: Vec<Vec3>,
    /// For each position how flat its surroundings are, in [0, 1]: 1 less the standard deviation across the
    /// fitted plane over that along the shorter side in it. 1 on a plane, less at edges
    /// and in noise, least where points fill space; 0 for what is degenerate.
    pub planarity: Vec<f32>,
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
    let fits = fit::all(neighbours, k, &part(progress, 0.0..0.6))?;
    let mut normals = map(fits.len(), &part(progress, 0.6..0.61), |place| fits[place].normal)?;
    let orienting = part(progress, 0.61..0.88);
    let n_components = orientation::orient(neighbours, &mut normals, &fits, &orienting)?;
    let edges = sharpen::edges(neighbours, &fits, &part(progress, 0.88..0.98))?;
    let n_sharpened = edges.len();
    for edge in edges {
        // Signs pass over an edge more surely by what is rounded off.
        let alike = edge.normal.dot(normals[edge.face as usize]) >= 0.0;
        normals[edge.place as usize] = if alike { edge.normal } else { -edge.normal };
    }
    let count = neighbours.len();
    let mut found = Estimate { n_sharpened, n_components, ..Estimate::default() };
    found.normals.reserve_exact(count);
    found.planarity.reserve_exact(count);
    each(count, &part(progress, 0.98..1.0), |index| {
        let place = neighbours.place_of(index);
        let fit = place.map(|place| &fits[place]).filter(|fit| !fit.degenerate);
        found.n_degenerate += usize::from(fit.is_none());
        found.planarity.push(fit.map_or(0.0, |fit| 1.0 - fit.roughness));
        found.normals.push(place.map_or(Vec3::Z, |place| normals[place]));
    })?;
    Ok(found)
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
