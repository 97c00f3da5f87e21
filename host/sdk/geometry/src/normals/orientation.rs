//! Makes the signs of fitted normals agree.

use super::fit::Fit;
use super::signs::{self, Coupling, SignedSets, gathered};
use crate::neighbours::{Neighbours, Scratch};
use crate::progress::{Cancelled, Progress, each, map_runs, part};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Neighbours that a point passes its sign on to. With eight, random samples of a surface hang
/// together, while a sheet nearby seldom comes among them.
const LINKS: usize = 8;

/// Agreement of neighbours above which they join a patch: 30 degrees.
const SURE: f64 = 0.87;

/// Leaves of a run, whose patches are found by one thread: large enough that few links lead out of it.
const RUN: usize = 256;

/// Weight of neighbours that agree fully.
const WEIGHT: f64 = 1000.0;

const NOBODY: u32 = u32::MAX;

/// Two neighbours that are not of one patch, and the evidence of each for equal signs.
#[derive(Clone, Copy, Debug)]
struct Link {
    a: u32,
    b: u32,
    net: i16,
}

/// The patches of a run of points that follow each other.
struct Run {
    /// For each point its patch, numbered within the run, and whether its sign differs from the patch's.
    member: Vec<(u32, bool)>,
    n_patches: usize,
    links: Vec<Link>,
}

/// Flips normals so that neighbours agree and each connected part faces outwards; gives the number
/// of parts. Normals and fits are by place.
///
/// Neighbours that agree join into patches, the surest first, each within a run of points that lie together.
/// The signs of patches are those that fulfil most of what links between them say; then each connected part is
/// turned as its farthest points say.
///
/// Source: Hoppe et al. 1992, section 3.3, whose tree of neighbours grows by 1 - |cosine|. Deviations: the
/// evidence on two patches is summed rather than its best piece taken, and as in König and Gumhold, Consistent
/// propagation of normal orientations in point clouds, 2009, one normal is first reflected at the plane between
/// the two points. On a circle it then coincides with the other, so that signs pass over sharp
/// creases and rims where the plain cosine is zero or has the wrong sign.
///
/// # Errors
/// Where `progress` asks to stop; the signs then mean nothing.
pub(super) fn orient(
    neighbours: &Neighbours,
    normals: &mut [Vec3],
    fits: &[Fit],
    progress: Progress<'_>,
) -> Result<usize, Cancelled> {
    let tree = neighbours.tree();
    let n_runs = tree.n_leaves().div_ceil(RUN);
    let last = tree.n_leaves() - 1;
    let surfaces = Surfaces { neighbours, normals, fits };
    let runs = map_runs(n_runs, &part(progress, 0.0..0.6), Scratch::default, |scratch, run| {
        let last = (run * RUN + RUN - 1).min(last);
        surfaces.run(tree.leaf(run * RUN).start..tree.leaf(last).end, scratch)
    })?;
    let mut member = Vec::with_capacity(normals.len());
    let mut links = Vec::new();
    let mut n_patches = 0;
    for run in runs {
        member.extend(run.member.iter().map(|&(patch, flips)| (n_patches + patch, flips)));
        links.push(run.links);
        n_patches += run.n_patches as u32;
    }
    let n_patches = n_patches as usize;
    let of_points = links.iter().flatten().map(|link| {
        let net = i64::from(link.net);
        Coupling { a: link.a, b: link.b, net, total: net.abs() }
    });
    let couplings = gathered(of_points, &member, &part(progress, 0.6..0.75))?;
    drop(links);
    let mut parts = SignedSets::new(n_patches);
    for coupling in &couplings {
        parts.join(coupling.a, coupling.b, false, u32::MAX);
    }
    let signs = signs::solve(n_patches, couplings, &part(progress, 0.75..0.9))?;
    let (parts, n_parts) = parts.numbered();
    each(normals.len(), &part(progress, 0.9..0.93), |place| {
        let (patch, flips) = member[place];
        if signs[patch as usize] == flips {
            normals[place] = -normals[place];
        }
    })?;
    let part_of = |place: usize| parts[member[place].0 as usize].0;
    turn_outwards(neighbours, normals, (n_parts, &part_of), &part(progress, 0.93..1.0))?;
    Ok(n_parts)
}

/// What is oriented.
struct Surfaces<'a> {
    neighbours: &'a Neighbours,
    normals: &'a [Vec3],
    fits: &'a [Fit],
}

impl Surfaces<'_> {
    /// The patches of the points of a run.
    fn run(&self, range: Range<usize>, scratch: &mut Scratch) -> Run {
        let mut sure = Vec::new();
        let mut links = Vec::new();
        for a in range.clone() {
            for found in self.neighbours.around(a, LINKS, scratch) {
                let b = found.place as usize;
                let agreement = self.agreement(a.min(b), a.max(b));
                let is_within = range.contains(&b);
                if is_within && agreement.abs() > SURE {
                    let cost = (1.0 - agreement.abs()).max(0.0) as f32;
                    // Of numbers that are not negative the bits sort like the numbers.
                    sure.push((cost.to_bits(), a.min(b) as u32, a.max(b) as u32, agreement < 0.0));
                }
                let net = (WEIGHT * agreement * agreement.abs()).round() as i16;
                links.push(Link { a: a.min(b) as u32, b: a.max(b) as u32, net });
            }
        }
        sure.sort_unstable();
        sure.dedup();
        let first = range.start as u32;
        let mut sets = SignedSets::new(range.len());
        for (_, a, b, opposite) in sure {
            sets.join(a - first, b - first, opposite, u32::MAX);
        }
        let (member, n_patches) = sets.numbered();
        let patch = |place: u32| member.get(place.wrapping_sub(first) as usize).map(|m| m.0);
        links.retain(|link| patch(link.a) != patch(link.b));
        links.shrink_to_fit();
        Run { member, n_patches, links }
    }

    /// How well the normals of two points agree: next to nothing where one means nothing. Points count as near
    /// where they are no farther apart than both are off their planes.
    fn agreement(&self, a: usize, b: usize) -> f64 {
        let along = self.neighbours.point(b) - self.neighbours.point(a);
        let noise = 2.0 * f64::from(self.fits[a].error.max(self.fits[b].error));
        let agreement = signs::agreement(along, [self.normals[a], self.normals[b]], noise);
        if self.fits[a].degenerate || self.fits[b].degenerate {
            return DEGENERATE * agreement.signum();
        }
        agreement.clamp(-1.0, 1.0)
    }
}

/// The agreement of normals of which one means nothing: parts hang together, but by nothing else.
const DEGENERATE: f64 = 0.04;

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

/// Turns each part so that its extremal points face away from it.
fn turn_outwards(
    neighbours: &Neighbours,
    normals: &mut [Vec3],
    (n_parts, part_of): (usize, &dyn Fn(usize) -> u32),
    progress: Progress<'_>,
) -> Result<(), Cancelled> {
    let nothing = Part {
        ends: [[(f64::NEG_INFINITY, NOBODY); 2]; DIRECTIONS.len()],
        normal_sum: DVec3::ZERO,
    };
    let mut parts = vec![nothing; n_parts];
    each(normals.len(), &part(progress, 0.0..0.8), |place| {
        let part = &mut parts[part_of(place) as usize];
        let point = neighbours.point(place);
        part.normal_sum += normals[place].as_dvec3();
        for (direction, ends) in DIRECTIONS.iter().zip(&mut part.ends) {
            let along = point.dot(*direction);
            for (end, distance) in ends.iter_mut().zip([along, -along]) {
                if distance > end.0 {
                    *end = (distance, place as u32);
                }
            }
        }
    })?;
    let inwards: Vec<bool> = parts.iter().map(|part| faces_inwards(part, normals)).collect();
    each(normals.len(), &part(progress, 0.8..1.0), |place| {
        if inwards[part_of(place) as usize] {
            normals[place] = -normals[place];
        }
    })
}

/// Whether the votes of a part's extremal points say that it must be flipped.
fn faces_inwards(part: &Part, normals: &[Vec3]) -> bool {
    let (mut sum, mut total) = (0.0, 0.0);
    for (direction, ends) in DIRECTIONS.iter().zip(&part.ends) {
        let direction = direction.normalize_or_zero();
        for (end, outwards) in ends.iter().zip([direction, -direction]) {
            let vote =
                normals.get(end.1 as usize).map_or(0.0, |normal| normal.as_dvec3().dot(outwards));
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
