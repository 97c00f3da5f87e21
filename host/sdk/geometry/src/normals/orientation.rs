//! Makes the signs of fitted normals agree.

use super::signed_sets::SignedSets;
use crate::progress::{Cancelled, Progress, each, flat_map, part, sort};
use glam::DVec3;

/// Neighbours that a point passes its sign on to. With ten, random samples of a surface hang
/// together, while a sheet nearby seldom comes among them.
pub(crate) const GRAPH_NEIGHBOURS: usize = 10;

const NOBODY: u32 = u32::MAX;

/// The points nearest to a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Links([u32; GRAPH_NEIGHBOURS]);

impl Default for Links {
    fn default() -> Self {
        Self([NOBODY; GRAPH_NEIGHBOURS])
    }
}

impl Links {
    pub(crate) fn set(&mut self, near: impl Iterator<Item = u32>) {
        for (link, other) in self.0.iter_mut().zip(near) {
            *link = other;
        }
    }

    fn iter(&self) -> impl Iterator<Item = u32> + '_ {
        self.0.iter().copied().filter(|&other| other != NOBODY)
    }
}

/// A pair of neighbours; the order of edges is the order in which they join the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    /// How little the normals agree, as the bits of a non-negative f32, which sort like the number.
    cost: u32,
    a: u32,
    b: u32,
}

/// The cost of passing a sign through a normal that means nothing: above that of any other edge.
const DEGENERATE_COST: f32 = 2.0;

/// Flips normals so that neighbours agree and each connected part faces outwards; gives the number
/// of parts.
///
/// Source: Hoppe et al. 1992, section 3.3: the signs follow a minimum spanning tree of the neighbour
/// graph, whose edges cost 1 - |cosine|. Deviation: as in König and Gumhold, Consistent propagation
/// of normal orientations in point clouds, 2009, one normal is first reflected at the plane between
/// the two points. On a circle it then coincides with the other, so that signs pass over sharp
/// creases and rims where the plain cosine is zero or has the wrong sign.
///
/// # Errors
/// Where `progress` asks to stop; the signs then mean nothing.
pub(crate) fn orient(
    points: &[DVec3],
    normals: &mut [DVec3],
    degenerate: &[bool],
    links: &[Links],
    progress: Progress<'_>,
) -> Result<usize, Cancelled> {
    let edges = flat_map(points.len(), &part(progress, 0.0..0.3), |a| {
        let normals = &*normals;
        links[a].iter().filter_map(move |b| edge(points, normals, degenerate, links, a, b))
    })?;
    let count = edges.len();
    let mut edges = sort(edges, &part(progress, 0.3..0.5))?.into_iter().flatten();
    let mut parts = SignedSets::new(points.len());
    each(count, &part(progress, 0.5..0.95), |_| {
        let Some(Edge { a, b, .. }) = edges.next() else { return };
        let opposite = agreement(points, normals, a as usize, b as usize) < 0.0;
        parts.join(a, b, opposite, u32::MAX);
    })?;
    let mut roots = Vec::with_capacity(points.len());
    each(points.len(), &part(progress, 0.95..0.97), |place| {
        let (root, flipped) = parts.find(place as u32);
        if flipped {
            normals[place] = -normals[place];
        }
        roots.push(root);
    })?;
    turn_outwards(points, normals, &roots, &part(progress, 0.97..1.0))
}

/// The edge from `a` to its neighbour `b`, once for both directions.
fn edge(
    points: &[DVec3],
    normals: &[DVec3],
    degenerate: &[bool],
    links: &[Links],
    a: usize,
    b: u32,
) -> Option<Edge> {
    let place = a as u32;
    if b < place && links[b as usize].iter().any(|back| back == place) {
        return None;
    }
    let (low, high) = (place.min(b), place.max(b));
    let cost = if degenerate[a] || degenerate[b as usize] {
        DEGENERATE_COST
    } else {
        (1.0 - agreement(points, normals, low as usize, high as usize).abs()).max(0.0) as f32
    };
    Some(Edge { cost: cost.to_bits(), a: low, b: high })
}

/// The cosine between one normal and the other's mirror image in the plane between the points.
fn agreement(points: &[DVec3], normals: &[DVec3], a: usize, b: usize) -> f64 {
    let along = (points[b] - points[a]).normalize_or_zero();
    let mirrored = normals[a] - 2.0 * along * along.dot(normals[a]);
    mirrored.dot(normals[b])
}

/// Directions in which extremal points vote: axes, face diagonals and space diagonals of a cube.
/// Thirteen, each both ways, outvote an outlier or a fold at one end.
const DIRECTIONS: [DVec3; 13] = [
    DVec3::X,
    DVec3::Y,
    DVec3::Z,
    DVec3::new(1.0, 1.0, 0.0),
    DVec3::new(1.0, -1.0, 0.0),
    DVec3::new(1.0, 0.0, 1.0),
    DVec3::new(1.0, 0.0, -1.0),
    DVec3::new(0.0, 1.0, 1.0),
    DVec3::new(0.0, 1.0, -1.0),
    DVec3::new(1.0, 1.0, 1.0),
    DVec3::new(1.0, 1.0, -1.0),
    DVec3::new(1.0, -1.0, 1.0),
    DVec3::new(1.0, -1.0, -1.0),
];

/// What is known of a connected part.
#[derive(Clone)]
struct Part {
    /// The farthest points along and against each direction.
    ends: [[(f64, u32); 2]; DIRECTIONS.len()],
    normal_sum: DVec3,
}

/// Share of the votes by which one side must lead. The two ends of an open sheet vote against each
/// other and differ by noise only; a closed surface reaches 1.
const LEAD: f64 = 0.1;

/// Turns each part so that its extremal points face away from it; gives the number of parts.
fn turn_outwards(
    points: &[DVec3],
    normals: &mut [DVec3],
    roots: &[u32],
    progress: Progress<'_>,
) -> Result<usize, Cancelled> {
    let mut number = vec![NOBODY; points.len()];
    let mut parts: Vec<Part> = Vec::new();
    let nothing = Part {
        ends: [[(f64::NEG_INFINITY, NOBODY); 2]; DIRECTIONS.len()],
        normal_sum: DVec3::ZERO,
    };
    each(roots.len(), &part(progress, 0.0..0.8), |place| {
        let number = &mut number[roots[place] as usize];
        if *number == NOBODY {
            *number = parts.len() as u32;
            parts.push(nothing.clone());
        }
        let part = &mut parts[*number as usize];
        part.normal_sum += normals[place];
        for (direction, ends) in DIRECTIONS.iter().zip(&mut part.ends) {
            let along = points[place].dot(*direction);
            for (end, distance) in ends.iter_mut().zip([along, -along]) {
                if distance > end.0 {
                    *end = (distance, place as u32);
                }
            }
        }
    })?;
    let inwards: Vec<bool> = parts.iter().map(|part| faces_inwards(part, normals)).collect();
    each(roots.len(), &part(progress, 0.8..1.0), |place| {
        if inwards[number[roots[place] as usize] as usize] {
            normals[place] = -normals[place];
        }
    })?;
    Ok(parts.len())
}

/// Whether the votes of a part's extremal points say that it must be flipped.
fn faces_inwards(part: &Part, normals: &[DVec3]) -> bool {
    let (mut sum, mut total) = (0.0, 0.0);
    for (direction, ends) in DIRECTIONS.iter().zip(&part.ends) {
        let direction = direction.normalize_or_zero();
        for (end, outwards) in ends.iter().zip([direction, -direction]) {
            let vote = normals.get(end.1 as usize).map_or(0.0, |normal| normal.dot(outwards));
            sum += vote;
            total += vote.abs();
        }
    }
    if sum.abs() > LEAD * total {
        return sum < 0.0;
    }
    let mean = part.normal_sum.to_array();
    mean.into_iter().fold(0.0, |most: f64, x| if x.abs() > most.abs() { x } else { most }) < 0.0
}
