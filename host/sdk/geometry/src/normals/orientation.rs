//! Makes the signs of fitted normals agree.

use super::fit::{Fit, Fits};
use super::outwards::{self, Ring};
use super::signs::{self, Coupling, SignedSets, merged, summed};
use crate::neighbours::Neighbours;
use crate::progress::{Cancelled, Progress, each, part, report, silent};
use std::ops::Range;

/// Neighbours that a point passes its sign on to. With eight, random samples of a surface hang
/// together, while a sheet nearby seldom comes among them.
pub(super) const LINKS: usize = 8;

/// Agreement of neighbours above which they join a patch: 30 degrees.
const SURE: f64 = 0.87;

/// Weight of neighbours that agree fully.
const WEIGHT: f64 = 1000.0;

/// Points that follow each other, before their signs agree.
pub(super) struct Run<'a> {
    pub(super) neighbours: &'a Neighbours,
    pub(super) places: Range<usize>,
    pub(super) fits: &'a [Fit],
    /// For each point its nearest; its own place where there are fewer.
    pub(super) links: &'a [[u32; LINKS]],
}

/// The patches of a run: points whose signs agree.
pub(super) struct RunPatches {
    /// For each point twice the number of its patch within the run, and 1 more where its sign differs from the patch's.
    member: Vec<u32>,
    n_patches: usize,
    /// What neighbours say of patches, by their numbers within the run, sorted.
    couplings: Vec<Coupling>,
    /// Neighbours of which the second is of another run.
    across: Vec<(u32, u32)>,
    /// For each point how far its links reach.
    rings: Vec<Ring>,
}

impl RunPatches {
    /// Joins neighbours that agree, the surest first.
    pub(super) fn of(run: &Run<'_>) -> Self {
        let first = run.places.start;
        let mut sure: Vec<u64> = Vec::with_capacity(4 * run.fits.len());
        let mut within: Vec<(u32, u32, i16)> = Vec::new();
        let mut across = Vec::new();
        let mut rings = Vec::with_capacity(run.fits.len());
        for (a, links) in run.places.clone().zip(run.links) {
            let [.., last] = *links;
            let point = |place: usize| run.neighbours.point(place);
            rings.push(Ring::reaching(point(a).distance(point(last as usize))));
            for &other in links.iter().filter(|&&other| other as usize != a) {
                let b = other as usize;
                if !run.places.contains(&b) {
                    across.push((a as u32, other));
                    continue;
                }
                // Neighbours that count each other among their nearest say it twice.
                let is_mutual = run.links[b - first].contains(&(a as u32));
                if is_mutual && b < a {
                    continue;
                }
                let (low, high) = (a.min(b), a.max(b));
                let agreement = agreement(
                    run.neighbours,
                    [low, high],
                    [&run.fits[low - first], &run.fits[high - first]],
                );
                let (low, high) = ((low - first) as u32, (high - first) as u32);
                if agreement.abs() > SURE {
                    sure.push(sure_key(agreement, low, high));
                }
                let net = evidence(agreement);
                within.push((low, high, if is_mutual { 2 * net } else { net }));
            }
        }
        sure.sort_unstable();
        let mut sets = SignedSets::new(run.fits.len());
        for key in sure {
            let place = |shift: u32| (key >> shift) as u32 & ((1 << PLACE_BITS) - 1);
            sets.join(place(1 + PLACE_BITS), place(1), key & 1 == 1, u32::MAX);
        }
        let (member, n_patches) = sets.numbered();
        let coupled = within.into_iter().filter_map(|(a, b, net)| {
            let ((a, flips_a), (b, flips_b)) = (member[a as usize], member[b as usize]);
            let net = i64::from(net);
            let turned = if flips_a == flips_b { net } else { -net };
            (a != b).then_some(Coupling { a: a.min(b), b: a.max(b), net: turned, total: net.abs() })
        });
        let mut couplings: Vec<Coupling> = coupled.collect();
        couplings.sort_unstable();
        let couplings = merged(couplings.into_iter());
        let member = member.iter().map(|&(patch, flips)| patch << 1 | u32::from(flips)).collect();
        Self { member, n_patches, couplings, across, rings }
    }
}

/// The patches of all runs, numbered one after the other.
pub(super) struct Patches {
    /// By place, as in [`RunPatches`].
    member: Vec<u32>,
    n_patches: u32,
    couplings: Vec<Coupling>,
    across: Vec<(u32, u32)>,
    rings: Vec<Ring>,
}

impl Patches {
    /// No patches yet, of so many points.
    pub(super) fn with_room(n_points: usize) -> Self {
        let (mut member, mut rings) = (Vec::new(), Vec::new());
        member.reserve_exact(n_points);
        rings.reserve_exact(n_points);
        Self { member, n_patches: 0, couplings: Vec::new(), across: Vec::new(), rings }
    }

    /// Adds the patches of the run that comes next.
    pub(super) fn take(&mut self, run: RunPatches) {
        let first = self.n_patches;
        self.member.extend(run.member.iter().map(|member| member + 2 * first));
        let moved = |coupling: &Coupling| Coupling {
            a: coupling.a + first,
            b: coupling.b + first,
            ..*coupling
        };
        self.couplings.extend(run.couplings.iter().map(moved));
        self.across.extend(run.across);
        self.rings.extend(run.rings);
        self.n_patches += run.n_patches as u32;
    }

    /// The patch of a point, and whether its sign differs from the patch's.
    fn of(&self, place: usize) -> (u32, bool) {
        (self.member[place] >> 1, self.member[place] & 1 == 1)
    }
}

/// Couplings that are gathered before those of the same patches are added up.
const GATHERED: usize = 1 << 18;

/// Bits for the place of a point within its run.
pub(super) const PLACE_BITS: u32 = 12;

/// Sorts pairs of neighbours that agree, the surest first: how sure, their places, and whether their signs differ.
fn sure_key(agreement: f64, low: u32, high: u32) -> u64 {
    let doubt = (1.0 - agreement.abs()).max(0.0) / (1.0 - SURE);
    let steps = ((1u64 << (63 - 2 * PLACE_BITS)) - 1) as f64;
    let doubt = (doubt.min(1.0) * steps) as u64;
    let places = u64::from(low) << PLACE_BITS | u64::from(high);
    (doubt << (2 * PLACE_BITS) | places) << 1 | u64::from(agreement < 0.0)
}

/// The evidence of two neighbours for equal signs.
fn evidence(agreement: f64) -> i16 {
    let evidence = WEIGHT * agreement * agreement.abs();
    // The cast cuts off; to round is a call on machines that have no instruction for it.
    (evidence + 0.5f64.copysign(evidence)) as i16
}

/// How well the normals of two points agree: next to nothing where one means nothing. Points count as near
/// where they are no farther apart than both are off their planes.
fn agreement(neighbours: &Neighbours, [a, b]: [usize; 2], fits: [&Fit; 2]) -> f64 {
    let along = neighbours.point(b) - neighbours.point(a);
    let noise = 2.0 * f64::from(fits[0].error.max(fits[1].error));
    let agreement = signs::agreement(along, fits.map(|fit| fit.normal), noise);
    if fits.iter().any(|fit| fit.is_degenerate()) {
        return DEGENERATE * agreement.signum();
    }
    agreement.clamp(-1.0, 1.0)
}

/// Flips normals so that neighbours agree and each connected part faces outwards; gives the number
/// of parts.
///
/// Neighbours that agree have joined into patches within runs of points that lie together.
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
    fits: &mut Fits,
    mut patches: Patches,
    progress: Progress<'_>,
) -> Result<usize, Cancelled> {
    let across = std::mem::take(&mut patches.across);
    let mut couplings = std::mem::take(&mut patches.couplings);
    let n_patches = patches.n_patches as usize;
    let of_place = |place: usize| patches.of(place);
    let gathering = part(progress, 0.0..0.3);
    let mut most = couplings.len() + GATHERED;
    for (i, &(a, b)) in across.iter().enumerate() {
        let (low, high) = (a.min(b) as usize, a.max(b) as usize);
        let pair = [&fits.at(low), &fits.at(high)];
        let net = i64::from(evidence(agreement(neighbours, [low, high], pair)));
        let ((a, flips_a), (b, flips_b)) = (of_place(low), of_place(high));
        let turned = if flips_a == flips_b { net } else { -net };
        if a != b {
            couplings.push(Coupling { a: a.min(b), b: a.max(b), net: turned, total: net.abs() });
        }
        if couplings.len() >= most {
            report(&gathering, i as f64 / across.len() as f64)?;
            couplings = summed(couplings, &silent)?;
            most = 2 * couplings.len() + GATHERED;
        }
    }
    drop(across);
    let couplings = summed(couplings, &part(progress, 0.3..0.4))?;
    let mut parts = SignedSets::new(n_patches);
    for coupling in &couplings {
        parts.join(coupling.a, coupling.b, false, u32::MAX);
    }
    let signs = signs::solve(n_patches, couplings, &part(progress, 0.4..0.7))?;
    let (parts, n_parts) = parts.numbered();
    let normals = &mut fits.normals;
    each(normals.len(), &part(progress, 0.7..0.8), |place| {
        let (patch, flips) = of_place(place);
        if signs[patch as usize] == flips {
            normals[place] = -normals[place];
        }
    })?;
    let part_of = |place: usize| parts[of_place(place).0 as usize].0;
    let cloud = outwards::Cloud { neighbours, rings: &patches.rings, n_parts, part_of: &part_of };
    outwards::turn(&cloud, normals, &part(progress, 0.8..1.0))?;
    Ok(n_parts)
}

/// The agreement of normals of which one means nothing: parts hang together, but by nothing else.
const DEGENERATE: f64 = 0.04;
