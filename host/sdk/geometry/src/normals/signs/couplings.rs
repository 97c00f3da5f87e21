//! What says that two nodes have equal signs, or opposite ones.

use crate::progress::{Cancelled, Progress, sort};
use glam::{DVec3, Vec3};

/// How well the unit normals of two points agree, in [-1, 1]: the cosine between one and the other's
/// mirror image in the plane between the points, which is 1 for those of a circle that face outwards
/// and -1 for those of the two sides of a sheet. `along` leads from one to the other; points nearer than about
/// `noise` are compared as they are, since the direction between them means nothing.
///
/// Source: König and Gumhold, Consistent propagation of normal orientations in point clouds, 2009;
/// the bound on noise is ours.
pub(crate) fn agreement(along: DVec3, normals: [Vec3; 2], noise: f64) -> f64 {
    let [a, b] = normals.map(|normal| normal.as_dvec3());
    let squared = along.length_squared() + noise * noise;
    let moved = if squared > 0.0 { 2.0 * along.dot(a) / squared } else { 0.0 };
    (a - moved * along).dot(b)
}

/// Evidence on two nodes: above 0 where both normals face what the other's does, or neither.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Coupling {
    pub(crate) a: u32,
    pub(crate) b: u32,
    /// Evidence for equal signs less that for opposite ones.
    pub(crate) net: i64,
    /// All evidence.
    pub(crate) total: i64,
}

/// Couplings of groups from those of their members: one for each pair of groups, sorted.
pub(crate) fn gathered(
    couplings: impl Iterator<Item = Coupling>,
    member: &[(u32, bool)],
    progress: Progress<'_>,
) -> Result<Vec<Coupling>, Cancelled> {
    let grouped: Vec<Coupling> = couplings
        .filter_map(|coupling| {
            let (a, flips_a) = member[coupling.a as usize];
            let (b, flips_b) = member[coupling.b as usize];
            let net = if flips_a == flips_b { coupling.net } else { -coupling.net };
            (a != b).then_some(Coupling { a: a.min(b), b: a.max(b), net, ..coupling })
        })
        .collect();
    summed(grouped, progress)
}

/// One coupling for each pair of nodes, sorted.
pub(crate) fn summed(
    couplings: Vec<Coupling>,
    progress: Progress<'_>,
) -> Result<Vec<Coupling>, Cancelled> {
    Ok(merged(sort(couplings, progress)?.into_iter().flatten()))
}

/// One coupling for each pair of nodes of couplings that are sorted.
pub(crate) fn merged(sorted: impl Iterator<Item = Coupling>) -> Vec<Coupling> {
    let mut sums: Vec<Coupling> = Vec::new();
    for coupling in sorted {
        match sums.last_mut() {
            Some(last) if (last.a, last.b) == (coupling.a, coupling.b) => {
                last.net += coupling.net;
                last.total += coupling.total;
            }
            _ => sums.push(coupling),
        }
    }
    sums
}
