//! Signs of surfels: found up to turning all, judged, and refined.

use super::Hints;
use super::couplings::{self, fields, gathered, of_surfels};
use super::evidence::{self, Evidence};
use super::rays::{self, Ray, Sky};
use super::surfels::{Choice, Surfels};
use super::verdict::{Verdict, decide};
use super::viewpoints::{self, Search};
use super::{regions, signs};
use crate::discs::Discs;
use crate::progress::{Cancelled, Progress, part};

/// Surfels of a patch, at most: many patches find the sides of small things, few are quick.
const PATCH: usize = 64;

/// Patches of a cloud, about, of which patches become larger with the cloud.
const PATCHES: usize = 2000;

/// How heavy a line of sight to a viewpoint is, before its side is known and after.
const VIEWED: [f32; 2] = [4.0, 12.0];

/// Share of the evidence on a surfel that must be against its sign to turn it.
const AGAINST: f64 = 0.2;

/// Rounds in which surfels turn.
const SWEEPS: usize = 6;

/// Evidence that makes half of a surfel's confidence.
const FEW: f64 = 64.0;

/// The surfels of a cloud with their signs.
pub(super) struct Labels {
    pub(super) surfels: Surfels,
    /// Whether the front of a surfel is the side of its normal.
    pub(super) signs: Vec<bool>,
    /// For each surfel how much of the evidence agrees, in [0, 1].
    pub(super) confidence: Vec<f32>,
    pub(super) evidence: Evidence,
    pub(super) verdict: Verdict,
}

/// Evidence between surfels.
struct Network {
    discs: Discs,
    pairs: Vec<(u32, u32, f32)>,
    rays: Vec<Ray>,
    n_surfels: usize,
}

impl Network {
    /// Turns surfels that most evidence is against; gives what agrees and all evidence of each.
    fn sweep(&self, signs: &mut [bool]) -> Vec<(i64, i64)> {
        let mut last = fields(of_surfels(&self.pairs, &self.rays), signs);
        for _ in 0..SWEEPS {
            let mut turned = false;
            for (sign, field) in signs[..self.n_surfels].iter_mut().zip(&last) {
                let agrees = if *sign { field.0 } else { -field.0 };
                if (agrees as f64) < -AGAINST * field.1 as f64 {
                    *sign = !*sign;
                    turned = true;
                }
            }
            if !turned {
                break;
            }
            last = fields(of_surfels(&self.pairs, &self.rays), signs);
        }
        last
    }

    /// Looks from other places than before, whose sign is that of the front where it is known.
    fn look_from(
        &mut self,
        surfels: &Surfels,
        signs: &mut Vec<bool>,
        known: bool,
        progress: Progress<'_>,
    ) -> Result<(), Cancelled> {
        let labels = known.then_some(&signs[..self.n_surfels]);
        let found = Search::new(&surfels.all, &self.discs, labels).find(&part(progress, 0.0..0.5))?;
        let places = viewpoints::covering(&found);
        let first = self.n_surfels + Sky::PARTS;
        self.rays.retain(|ray| (ray.to as usize) < first);
        signs.truncate(first);
        signs.resize(first + places.len(), true);
        let weight = VIEWED[usize::from(known)];
        let looking = part(progress, 0.5..1.0);
        let rays = viewpoints::rays(&surfels.all, &self.discs, (&places, first), weight, &looking)?;
        self.rays.extend(rays);
        Ok(())
    }
}

/// Finds the signs of the surfels of a cloud.
pub(super) fn find(
    surfels: Surfels,
    hints: &Hints,
    progress: Progress<'_>,
) -> Result<Labels, Cancelled> {
    let n = surfels.all.len();
    let discs = surfels.discs(&part(progress, 0.0..0.1))?;
    let sky = Sky::above(hints.up);
    let rays = rays::trace(&surfels.all, &discs, &sky, &part(progress, 0.1..0.5))?;
    let pairs = couplings::neighbours(&surfels.all, &part(progress, 0.5..0.52))?;
    let mut network = Network { discs, pairs, rays, n_surfels: n };
    let mut signs = vec![true; n + Sky::PARTS];
    network.look_from(&surfels, &mut signs, false, &part(progress, 0.52..0.62))?;
    let (member, n_groups) = solve(&network, &mut signs, &part(progress, 0.62..0.75))?;
    network.sweep(&mut signs);
    let judging = part(progress, 0.75..0.8);
    let groups = (&member[..n + Sky::PARTS], n_groups);
    let (evidence, verdict) = judge(&network, &surfels, groups, &signs, hints, &judging)?;
    if verdict.turn {
        for sign in &mut signs {
            *sign = !*sign;
        }
    }
    network.look_from(&surfels, &mut signs, true, &part(progress, 0.8..0.95))?;
    let fields = network.sweep(&mut signs);
    signs.truncate(n);
    let confidence = signs.iter().zip(fields).map(|(&sign, (net, total))| {
        let agrees = if sign { net } else { -net };
        (agrees.max(0) as f64 / (total as f64 + FEW)) as f32
    });
    let confidence = confidence.collect();
    Ok(Labels { surfels, signs, confidence, evidence, verdict })
}

/// Finds the signs of surfels, sky and viewpoints; gives the group of each, and the number of groups
/// that are patches of surfels.
fn solve(
    network: &Network,
    signs: &mut [bool],
    progress: Progress<'_>,
) -> Result<(Vec<(u32, bool)>, usize), Cancelled> {
    let n = network.n_surfels;
    let most = (n / PATCHES).clamp(4, PATCH) as u32;
    let grouping = part(progress, 0.0..0.2);
    let (mut member, n_patches) = couplings::patches(n, &network.pairs, most, &grouping)?;
    let others = signs.len() - n;
    member.extend((0..others).map(|other| ((n_patches + other) as u32, false)));
    let all = of_surfels(&network.pairs, &network.rays);
    let grouped = gathered(all, &member, &part(progress, 0.2..0.6))?;
    let found = signs::solve(n_patches + others, grouped, &part(progress, 0.6..1.0))?;
    for (sign, &(group, opposite)) in signs.iter_mut().zip(&member) {
        *sign = found[group as usize] != opposite;
    }
    Ok((member, n_patches))
}

/// Whether the front is in front.
fn judge(
    network: &Network,
    surfels: &Surfels,
    groups: (&[(u32, bool)], usize),
    signs: &[bool],
    hints: &Hints,
    progress: Progress<'_>,
) -> Result<(Evidence, Verdict), Cancelled> {
    let n = network.n_surfels;
    let at = |index: u32| surfels.all[index as usize].position;
    let length = |ray: &Ray| f64::from(at(ray.from).distance(at(ray.to)));
    let evidence = evidence::judge(n, &network.rays, signs, length);
    let share = |front: bool, range: std::ops::Range<f64>| {
        regions::largest(groups, &network.rays, signs, front, &part(progress, range))
    };
    let connected = share(true, 0.0..0.5)? - share(false, 0.5..1.0)?;
    let search = Search::new(&surfels.all, &network.discs, Some(&signs[..n]));
    let worths = search.find(&part(&crate::progress::silent, 0.0..1.0))?;
    let best = worths.first().map_or(0.0, |place| f64::from(place.worth));
    let turned: Vec<bool> = signs[..n].iter().map(|sign| !sign).collect();
    let search = Search::new(&surfels.all, &network.discs, Some(&turned));
    let worths = search.find(&part(&crate::progress::silent, 0.0..1.0))?;
    let viewed = best - worths.first().map_or(0.0, |place| f64::from(place.worth));
    let device = hints.device.map_or(0.0, |device| {
        -f64::from(search.look(surfels.frame.inside(device)).worth)
    });
    let free_path = hints.metres.map(|m| evidence.free_path * surfels.frame.scale * f64::from(m));
    Ok((evidence, decide(&evidence, connected, viewed, device, free_path, hints)))
}
