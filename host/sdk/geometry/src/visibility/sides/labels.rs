//! Signs of surfels: found up to turning all, judged, and refined.

use super::couplings::{self, fields, of_surfels};
use super::evidence::{self, Evidence};
use super::hints::Hints;
use super::rays::{self, Ray, Sky};
use super::regions;
use super::verdict::{Verdict, decide};
use super::viewpoints::{self, Search, Viewpoint};
use crate::discs::Discs;
use crate::normals::signs::{self, gathered};
use crate::progress::{Cancelled, Progress, part};
use crate::visibility::surfels::Surfels;
use glam::{DVec3, Vec3};
use std::ops::Range;

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

    /// Looks from these places instead of others; what they see is in front, if that is known.
    fn look_from(
        &mut self,
        surfels: &Surfels,
        signs: &mut Vec<bool>,
        (places, weight): (&[Vec3], f32),
        progress: Progress<'_>,
    ) -> Result<(), Cancelled> {
        let first = self.n_surfels + Sky::PARTS;
        self.rays.retain(|ray| (ray.to as usize) < first);
        signs.truncate(first);
        signs.resize(first + places.len(), true);
        let places = (places, first);
        let rays = viewpoints::rays(surfels, &self.discs, places, weight, progress)?;
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
    let found = Search::new(&surfels, &network.discs, None).find(&part(progress, 0.52..0.57))?;
    let places = viewpoints::covering(&found);
    let viewed = (&places[..], VIEWED[0]);
    network.look_from(&surfels, &mut signs, viewed, &part(progress, 0.57..0.62))?;
    let (member, n_groups) = solve(&network, &mut signs, &part(progress, 0.62..0.75))?;
    network.sweep(&mut signs);
    let judging = part(progress, 0.75..0.9);
    let groups = (&member[..n + Sky::PARTS], n_groups);
    let (evidence, verdict, places) = judge(&network, &surfels, groups, &signs, hints, &judging)?;
    if verdict.turn {
        for sign in &mut signs {
            *sign = !*sign;
        }
    }
    let viewed = (&places[..], VIEWED[1]);
    network.look_from(&surfels, &mut signs, viewed, &part(progress, 0.9..0.97))?;
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

/// Whether the front is in front, and good places to see it from.
fn judge(
    network: &Network,
    surfels: &Surfels,
    groups: (&[(u32, bool)], usize),
    signs: &[bool],
    hints: &Hints,
    progress: Progress<'_>,
) -> Result<(Evidence, Verdict, Vec<Vec3>), Cancelled> {
    let n = network.n_surfels;
    let at = |index: u32| surfels.all[index as usize].position;
    let length = |ray: &Ray| f64::from(at(ray.from).distance(at(ray.to)));
    let mut evidence = evidence::judge(n, &network.rays, signs, length);
    let small = |front: bool, range: Range<f64>| {
        regions::small(groups, &network.rays, signs, front, &part(progress, range))
    };
    evidence.enclosed = small(false, 0.0..0.2)? - small(true, 0.2..0.4)?;
    let turned: Vec<bool> = signs[..n].iter().map(|sign| !sign).collect();
    let [front, back] =
        [&signs[..n], &turned[..]].map(|signs| Search::new(surfels, &network.discs, Some(signs)));
    let fronts = front.find(&part(progress, 0.4..0.7))?;
    let backs = back.find(&part(progress, 0.7..1.0))?;
    let best = |found: &[Viewpoint]| found.first().map_or(0.0, |place| f64::from(place.worth));
    evidence.viewed = best(&fronts) - best(&backs);
    let look = |device| f64::from(front.look(surfels.frame.inside(device)).worth);
    evidence.device = hints.device.filter(|device| device.is_finite()).map_or(0.0, look);
    let mean: DVec3 = surfels
        .all
        .iter()
        .zip(signs)
        .map(
            |(surfel, &sign)| {
                if sign { surfel.normal.as_dvec3() } else { -surfel.normal.as_dvec3() }
            },
        )
        .sum();
    let largest = |most: f64, x: f64| if x.abs() > most.abs() { x } else { most };
    evidence.positive = mean.to_array().into_iter().fold(0.0, largest) / n.max(1) as f64;
    let verdict = decide(&evidence, hints, surfels.frame.scale);
    let places = viewpoints::covering(if verdict.turn { &backs } else { &fronts });
    Ok((evidence, verdict, places))
}
