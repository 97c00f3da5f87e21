//! From a cloud to its column `ao`.

use crate::brute_force;
use crate::form_factor::{Reach, Sums};
use crate::hierarchy::Hierarchy;
use crate::lanes::WIDTH;
use crate::octree;
use crate::rays::{Budget, Tracing};
use crate::surfels::Surfels;
use crate::{Method, Settings, Side};
use std::ops::ControlFlow;
use surfelshop_api::columns::{AO, Values};
use surfelshop_api::prelude::*;
use surfelshop_api::tool::NewColumn;
use surfelshop_geometry::Cancelled;

/// cos^2 of half the thesis's cone of 150 degrees (section 4.1, erratum T23).
const CONE: f32 = 0.066_987_3;

/// What is known of each surfel after a pass.
struct Gathered {
    front: Vec<f32>,
    back: Vec<f32>,
}

pub(crate) fn bake(cloud: &CloudView<'_>, settings: &Settings, job: &Job<'_>) -> Result<()> {
    let t = std::time::Instant::now();
    let surfels = Surfels::of(cloud, 0.2, job)?;
    eprintln!("prep {:.3}", t.elapsed().as_secs_f64());
    let occlusion = match settings.method {
        Method::Rays => rays(&surfels, settings, job)?,
        Method::BruteForce | Method::Octree => form_factors(&surfels, settings, job)?,
        Method::Hybrid => hybrid(&surfels, settings, job)?,
    };
    let mut accessibility = vec![1.0; cloud.len];
    for (&index, occlusion) in surfels.order.iter().zip(occlusion) {
        accessibility[index as usize] = 1.0 - occlusion.clamp(0.0, 1.0);
    }
    let values = Values::F32(&accessibility);
    job.edit(&Edit::Columns(vec![NewColumn { name: AO, components: 1, values }]))
}

fn reach(surfels: &Surfels, settings: &Settings) -> Reach {
    let distance = max_distance(surfels, settings);
    Reach {
        distance_squared: distance * distance,
        cosine_squared: if settings.cone { CONE } else { 0.0 },
    }
}

fn max_distance(surfels: &Surfels, settings: &Settings) -> f32 {
    match settings.max_distance {
        0.0 => f32::INFINITY,
        distance => (f64::from(distance) / surfels.unit) as f32,
    }
}

fn tracing<'a>(surfels: &'a Surfels, settings: &Settings, job: &Job<'_>) -> Result<Tracing<'a>> {
    let progress =
        |_| if job.cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
    Tracing::new(surfels, max_distance(surfels, settings), settings.seed, &progress)
        .map_err(|Cancelled| Error::new(surfelshop_api::job::CANCELLED))
}

fn rays(surfels: &Surfels, settings: &Settings, job: &Job<'_>) -> Result<Vec<f32>> {
    let tracing = tracing(surfels, settings, job)?;
    job.progress(0.25, "tracing rays");
    let budget = Budget { least: settings.rays, most: settings.rays, error: 0.0 };
    job.map(surfels.len(), 0.25..1.0, |place| tracing.occlusion(place, budget).0)
}

/// One pass; `left` is what is left of each surfel to cast a shadow.
fn pass(
    surfels: &Surfels,
    settings: &Settings,
    share: std::ops::Range<f64>,
    left: impl Fn(usize) -> f32,
    job: &Job<'_>,
) -> Result<Gathered> {
    let reach = reach(surfels, settings);
    let n_groups = surfels.len().div_ceil(WIDTH);
    let places = |group: usize| group * WIDTH..((group + 1) * WIDTH).min(surfels.len());
    let sums: Vec<Sums> = if settings.method == Method::BruteForce {
        let emitters = brute_force::emitters(surfels, left);
        job.map(n_groups, share, |group| {
            brute_force::gather(surfels, &emitters, places(group), reach)
        })?
    } else {
        let t = std::time::Instant::now();
        let hierarchy = Hierarchy::new(surfels, left);
        eprintln!("hierarchy {:.3}", t.elapsed().as_secs_f64());
        job.map(n_groups, share, |group| {
            octree::gather(&hierarchy, places(group), settings.tolerance, reach).0
        })?
    };
    let all = |of: fn(&Sums) -> [f32; WIDTH]| {
        let values = sums.iter().flat_map(of);
        values.take(surfels.len()).collect()
    };
    Ok(Gathered { front: all(Sums::front), back: all(Sums::back) })
}

fn form_factors(surfels: &Surfels, settings: &Settings, job: &Job<'_>) -> Result<Vec<f32>> {
    let mut occlusion = vec![0.0f32; surfels.len()];
    let step = 0.8 / f64::from(settings.passes);
    for i in 0..settings.passes {
        let start = 0.2 + f64::from(i) * step;
        job.progress(start, &format!("pass {} of {}", i + 1, settings.passes));
        let left = |place: usize| 1.0 - occlusion[place];
        let gathered = pass(surfels, settings, start..start + step, left, job)?;
        let cast = match settings.cast_from {
            Side::Back => gathered.back,
            Side::Front => gathered.front,
        };
        // Eq. 10 with min for max (erratum T1).
        occlusion = cast.into_iter().map(|sum| sum.clamp(0.0, 1.0)).collect();
    }
    Ok(occlusion)
}

fn hybrid(surfels: &Surfels, settings: &Settings, job: &Job<'_>) -> Result<Vec<f32>> {
    let first = pass(surfels, settings, 0.2..0.4, |_| 1.0, job)?;
    let doubtful = |place: usize| {
        let (front, back) = (first.front[place], first.back[place]);
        (front - back).abs() > 0.03 + 0.1 * front.max(back)
    };
    let traced: Vec<usize> = (0..surfels.len()).filter(|&place| doubtful(place)).collect();
    let mut occlusion: Vec<f32> = first.back.iter().map(|back| back.clamp(0.0, 1.0)).collect();
    if !traced.is_empty() {
        let tracing = tracing(surfels, settings, job)?;
        let budget = Budget { least: 64, most: settings.rays, error: 0.02 };
        let found = job.map(traced.len(), 0.4..0.7, |i| tracing.occlusion(traced[i], budget))?;
        job.progress(
            0.7,
            &format!(
                "{} of {} surfels traced, {} rays",
                traced.len(),
                surfels.len(),
                found.iter().map(|f| u64::from(f.1)).sum::<u64>()
            ),
        );
        for (&place, (share, _)) in traced.iter().zip(&found) {
            occlusion[place] = *share;
        }
    }
    let kept: Vec<Option<f32>> =
        (0..surfels.len()).map(|p| doubtful(p).then(|| occlusion[p])).collect();
    for _ in 1..settings.passes {
        let left = |place: usize| 1.0 - occlusion[place];
        let gathered = pass(surfels, settings, 0.7..1.0, left, job)?;
        occlusion = gathered
            .back
            .iter()
            .zip(&kept)
            .map(|(sum, kept)| kept.unwrap_or(sum.clamp(0.0, 1.0)))
            .collect();
    }
    Ok(occlusion)
}
