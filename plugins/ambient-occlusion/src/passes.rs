//! Passes of form factors: eq. 10 and 11 of the thesis.

use crate::form_factor::{Emitter, Reach, Sums};
use crate::hierarchy::Hierarchy;
use crate::lanes::WIDTH;
use crate::settings::{Method, Settings, Side};
use crate::surfels::{Occlusion, Surfels};
use crate::{brute_force, octree};
use std::ops::Range;
use surfelshop_api::prelude::*;

/// What covers each surfel's sky, by place; sums, that may exceed 1.
pub(crate) struct SkyCoverage {
    /// Fronts of emitters.
    pub(crate) front: Vec<f32>,
    /// Backs of emitters.
    pub(crate) back: Vec<f32>,
    /// Of the fronts and the backs, what single surfels close by cover.
    pub(crate) near: [Vec<f32>; 2],
}

/// Every pass and what the first gathered.
pub(crate) struct Passes {
    /// What the first pass gathered.
    pub(crate) first: SkyCoverage,
    /// What the last pass left, in [0, 1].
    pub(crate) occlusion: Vec<f32>,
}

pub(crate) fn find(
    surfels: &Surfels,
    settings: &Settings,
    share: Range<f64>,
    job: &Job<'_>,
) -> Result<Occlusion> {
    let Passes { occlusion, .. } = run(surfels, settings, share, job, |_| true)?;
    let how = match settings.method {
        Method::BruteForce => "all pairs",
        _ => "an octree",
    };
    Ok((
        occlusion,
        format!("gathered {how} of {} surfels, passes: {}", surfels.len(), settings.passes),
    ))
}

/// Passes, after the first as long as what it gathered says so.
pub(crate) fn run(
    surfels: &Surfels,
    settings: &Settings,
    share: Range<f64>,
    job: &Job<'_>,
    goes_on: impl Fn(&SkyCoverage) -> bool,
) -> Result<Passes> {
    let step = (share.end - share.start) / f64::from(settings.passes);
    let mut first = None;
    let mut occlusion = vec![0.0f32; surfels.len()];
    for i in 0..settings.passes {
        let start = share.start + f64::from(i) * step;
        job.progress(start, &format!("pass {} of {}", i + 1, settings.passes));
        // What the first one finds of all skies tells the hybrid whether the scene is open.
        let tells = i == 0 && settings.method == Method::Hybrid;
        let is_last = i + 1 == settings.passes && !tells;
        let gathered = gather(surfels, settings, (&occlusion, is_last), start..start + step, job)?;
        let cast = match settings.cast_from {
            Side::Back => &gathered.back,
            Side::Front => &gathered.front,
        };
        // Eq. 10 and 11 with min for max (erratum T1).
        occlusion = cast.iter().map(|sum| sum.clamp(0.0, 1.0)).collect();
        if !goes_on(first.get_or_insert(gathered)) {
            break;
        }
    }
    let nothing =
        SkyCoverage { front: Vec::new(), back: Vec::new(), near: [Vec::new(), Vec::new()] };
    Ok(Passes { first: first.unwrap_or(nothing), occlusion })
}

/// What the first pass gathers for some of the surfels that are asked for: their places, fronts and backs.
pub(crate) fn sample(surfels: &Surfels, settings: &Settings) -> Vec<(usize, f32, f32)> {
    let reach = Reach::new(surfels.max_distance(settings), settings.cone);
    let hierarchy = Hierarchy::new(surfels, emitters(surfels, None));
    let groups = groups(surfels);
    let step = groups.len().div_ceil(SAMPLED).max(1);
    let mut found = Vec::new();
    for group in groups.iter().step_by(step) {
        let [mut sums, far] = octree::gather(&hierarchy, group.clone(), settings.tolerance, reach);
        sums.add(far);
        let sides = sums.front().into_iter().zip(sums.back());
        let asked = group.clone().zip(sides).filter(|(place, _)| !surfels.is_context(*place));
        found.extend(asked.map(|(place, (front, back))| (place, front, back)));
    }
    found
}

/// Groups that [`sample`] looks at, at most about.
const SAMPLED: usize = 64;

/// Every surfel, less what the pass before found to be covered.
fn emitters(surfels: &Surfels, occlusion: Option<&[f32]>) -> Vec<Emitter> {
    let open = |place: usize| occlusion.map_or(1.0, |occlusion| 1.0 - occlusion[place]);
    (0..surfels.len())
        .map(|place| Emitter {
            at: surfels.positions[place].to_array(),
            normal: surfels.normals[place].to_array(),
            area: surfels.areas[place],
            weight: surfels.areas[place] * open(place),
        })
        .collect()
}

/// One pass: what covers each sky where an emitter counts by the share of it that is open. The last does not look at
/// skies that nobody asks for; the others do, since the next pass shades by them.
fn gather(
    surfels: &Surfels,
    settings: &Settings,
    (occlusion, is_last): (&[f32], bool),
    share: Range<f64>,
    job: &Job<'_>,
) -> Result<SkyCoverage> {
    let reach = Reach::new(surfels.max_distance(settings), settings.cone);
    let emitters = emitters(surfels, Some(occlusion));
    let groups = groups(surfels);
    let is_idle =
        |group: &Range<usize>| is_last && group.clone().all(|place| surfels.is_context(place));
    let sums: Vec<[Sums; 2]> = if settings.method == Method::BruteForce {
        job.map(groups.len(), share, |i| match is_idle(&groups[i]) {
            true => [Sums::ZERO; 2],
            false => {
                [brute_force::gather(surfels, &emitters, groups[i].clone(), reach), Sums::ZERO]
            }
        })?
    } else {
        let hierarchy = Hierarchy::new(surfels, emitters);
        job.map(groups.len(), share, |i| match is_idle(&groups[i]) {
            true => [Sums::ZERO; 2],
            false => octree::gather(&hierarchy, groups[i].clone(), settings.tolerance, reach),
        })?
    };
    let all = |of: &dyn Fn(&[Sums; 2]) -> [f32; WIDTH]| -> Vec<f32> {
        let found = groups.iter().zip(&sums);
        found.flat_map(|(group, sums)| of(sums).into_iter().take(group.len())).collect()
    };
    let whole = |[near, far]: &[Sums; 2]| {
        let mut whole = *near;
        whole.add(*far);
        whole
    };
    Ok(SkyCoverage {
        front: all(&|sums| whole(sums).front()),
        back: all(&|sums| whole(sums).back()),
        near: [all(&|[near, _]| near.front()), all(&|[near, _]| near.back())],
    })
}

/// Surfels of a node whose receivers are gathered for together. Groups of sixteen that cross the
/// border of larger nodes may reach from one end of the cloud to the other, and open all nodes
/// between: one group in twenty took a fifth of the time.
const TOGETHER: usize = 512;

/// Ranges of at most sixteen receivers that lie close together, in their order.
fn groups(surfels: &Surfels) -> Vec<Range<usize>> {
    let nodes = surfels.tree.nodes();
    let mut groups = Vec::with_capacity(surfels.len() / WIDTH * 5 / 4 + 1);
    let mut open: Vec<u32> = if nodes.is_empty() { Vec::new() } else { vec![0] };
    while let Some(next) = open.pop() {
        let node = &nodes[next as usize];
        let places = node.surfels.start as usize..node.surfels.end as usize;
        if node.children.is_empty() || places.len() <= TOGETHER {
            let starts = places.clone().step_by(WIDTH);
            groups.extend(starts.map(|start| start..(start + WIDTH).min(places.end)));
        } else {
            // Taken from the end, so that places stay in order.
            open.extend(node.children.clone().rev());
        }
    }
    groups
}
