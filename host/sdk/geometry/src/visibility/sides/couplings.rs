//! What says that two surfels face the same free space, or opposite ones.

use super::rays::{Ray, STRAIGHT};
use crate::normals::signs::{self, Coupling, SignedSets};
use crate::progress::{Cancelled, Progress, each, flat_map, part, sort};
use crate::visibility::surfels::Surfel;
use glam::Vec3;

/// Weight of a neighbour whose normal agrees fully.
const NEIGHBOUR: f64 = 2.0 * STRAIGHT as f64;

/// Agreement of neighbours above which they join a patch: 30 degrees.
const SURE: f64 = 0.87;

/// How well two points with unit normals agree, of which those nearer than about `noise` are compared as they are.
pub(super) fn agreement(a: (Vec3, Vec3), b: (Vec3, Vec3), noise: f32) -> f64 {
    signs::agreement((b.0 - a.0).as_dvec3(), [a.1, b.1], f64::from(noise))
}

/// Distances below this share of a disc's radius are noise.
pub(super) const NOISE: f32 = 0.5;

/// Pairs of neighbours, each once, with their agreement.
pub(super) fn neighbours(
    surfels: &[Surfel],
    progress: Progress<'_>,
) -> Result<Vec<(u32, u32, f32)>, Cancelled> {
    let oriented = |i: u32| (surfels[i as usize].position, surfels[i as usize].normal);
    flat_map(surfels.len(), progress, |a| {
        surfels[a].linked().filter_map(move |b| {
            let is_mutual = surfels[b as usize].linked().any(|back| back as usize == a);
            if is_mutual && (b as usize) < a {
                return None;
            }
            let (low, high) = ((a as u32).min(b), (a as u32).max(b));
            let noise = NOISE * surfels[low as usize].radius.min(surfels[high as usize].radius);
            let agreement = agreement(oriented(low), oriented(high), noise);
            Some((low, high, agreement as f32))
        })
    })
}

/// Joins neighbours that agree best into patches of up to `most`: each surfel's patch and whether
/// its sign differs from the patch's, and the number of patches.
pub(super) fn patches(
    count: usize,
    pairs: &[(u32, u32, f32)],
    most: u32,
    progress: Progress<'_>,
) -> Result<(Vec<(u32, bool)>, usize), Cancelled> {
    // Of numbers that are not negative the bits sort like the numbers.
    let cost = |agreement: f32| (1.0 - agreement.abs()).max(0.0).to_bits();
    let sure = pairs.iter().filter(|pair| f64::from(pair.2.abs()) > SURE);
    let edges: Vec<(u32, u32, u32, bool)> =
        sure.map(|&(a, b, agreement)| (cost(agreement), a, b, agreement < 0.0)).collect();
    let n_edges = edges.len();
    let mut edges = sort(edges, &part(progress, 0.0..0.5))?.into_iter().flatten();
    let mut sets = SignedSets::new(count);
    each(n_edges, &part(progress, 0.5..1.0), |_| {
        if let Some((_, a, b, opposite)) = edges.next() {
            sets.join(a, b, opposite, most);
        }
    })?;
    Ok(sets.numbered())
}

/// The weight of a pair of neighbours, signed: weak where normals are far from agreement.
fn neighbour_weight(agreement: f32) -> i64 {
    let agreement = f64::from(agreement);
    (NEIGHBOUR * agreement * agreement.abs()).round() as i64
}

/// Couplings between surfels, and between surfels and parts of the sky, one for each piece of evidence.
pub(super) fn of_surfels<'a>(
    pairs: &'a [(u32, u32, f32)],
    rays: &'a [Ray],
) -> impl Iterator<Item = Coupling> + 'a {
    let near = pairs.iter().map(|&(a, b, agreement)| {
        let net = neighbour_weight(agreement);
        Coupling { a, b, net, total: net.abs() }
    });
    let far = rays.iter().map(|ray| {
        let total = i64::from(ray.weight);
        let net = if ray.leaves_front == ray.arrives_front { total } else { -total };
        Coupling { a: ray.from, b: ray.to, net, total }
    });
    near.chain(far)
}

/// For each node what the others say of its sign, and all evidence there is.
pub(super) fn fields(couplings: impl Iterator<Item = Coupling>, signs: &[bool]) -> Vec<(i64, i64)> {
    let mut fields = vec![(0, 0); signs.len()];
    for Coupling { a, b, net, total } in couplings {
        for (node, other) in [(a, b), (b, a)] {
            let field: &mut (i64, i64) = &mut fields[node as usize];
            field.0 += if signs[other as usize] { net } else { -net };
            field.1 += total;
        }
    }
    fields
}
