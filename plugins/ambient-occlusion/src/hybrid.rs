//! Form factors where they can know, rays where they cannot.
//!
//! A line of sight leaves every closed body that it enters, so the fronts of emitters cover as much
//! of a sky as their backs do (Gauss). Where the two sums differ, something is open: a sheet casts
//! nothing from its back, the wall of a room nothing from its front. Those surfels are traced.

use crate::passes::{self, Passes};
use crate::rays::{Budget, Tracing};
use crate::settings::{Settings, Side};
use crate::surfels::{Occlusion, Surfels};
use std::ops::Range;
use surfelshop_api::prelude::*;

/// Difference of the sums, as a share of the sky, that uneven sampling makes at closed bodies.
/// Measured on an open sheet: half of it traces 6 % more for 15 % less error.
const DIFFERENCE: f32 = 0.03;

/// The same, as a share of the larger sum.
const RELATIVE: f32 = 0.1;

/// Where more than one of so many surfels is doubtful, the scene is open and all are traced: on two
/// scans of buildings the others were off by 0.05, on closed bodies at most one in eight is doubtful.
const OPEN: usize = 3;

/// Rays that each doubtful surfel gets.
const LEAST_RAYS: u32 = 64;

/// Standard error, a share of the sky, at which a doubtful surfel gets no more rays: about that of
/// the form factors elsewhere, since stratified rays err by a third of it.
const ENOUGH: f32 = 0.03;

pub(crate) fn find(
    surfels: &Surfels,
    settings: &Settings,
    share: Range<f64>,
    job: &Job<'_>,
) -> Result<Occlusion> {
    let half = 0.5 * (share.start + share.end);
    let settings = Settings { cast_from: Side::Back, ..settings.clone() };
    let Passes { first, mut occlusion } = passes::run(surfels, &settings, share.start..half, job)?;
    let asked: Vec<usize> =
        (0..surfels.len()).filter(|&place| !surfels.is_context(place)).collect();
    let mut doubtful: Vec<usize> = asked
        .iter()
        .copied()
        .filter(|&place| {
            let (front, back) = (first.front[place], first.back[place]);
            (front - back).abs() > DIFFERENCE + RELATIVE * front.max(back)
        })
        .collect();
    // What is open casts wrong shadows on the rest, too.
    if doubtful.len() > asked.len() / OPEN {
        doubtful = asked;
    }
    let mut n_rays = 0;
    let env = |name: &str| std::env::var(name).ok().and_then(|v| v.parse::<f32>().ok());
    if env("AO_NEW").is_some() {
        let t = std::time::Instant::now();
        let radii = crate::rays::radii(surfels);
        let tracer = crate::bundles::Tracer {
            surfels,
            radii: &radii,
            beams: crate::beams::Beams::of(surfels, &radii),
            reach: crate::form_factor::Reach::new(surfels.max_distance(&settings), settings.cone),
            seed: settings.seed,
            least: env("AO_LEAST").unwrap_or(32.0) as u32,
            most: env("AO_MOST").unwrap_or(256.0) as u32,
            error: env("AO_ERR").unwrap_or(0.01),
        };
        eprintln!("build {:?}", t.elapsed());
        let bundles = crate::bundles::bundles(surfels, &doubtful);
        eprintln!("bundles {} {:?}", bundles.len(), t.elapsed());
        let found = job.map(bundles.len(), half..share.end, |i| tracer.trace(&bundles[i]))?;
        eprintln!("traced {:?}", t.elapsed());
        let smoothing = crate::smoothing::Smoothing { surfels, coverage: &first, bundles: &bundles, found: &found };
        let corrections = if env("AO_RAW").is_some() {
            found.iter().map(|f| (f.occlusion, f.variance)).collect()
        } else {
            smoothing.run(share.end..share.end, job)?
        };
        eprintln!("smoothed {:?}", t.elapsed());
        let mut variance = 0.0;
        let mut n_dirs = 0u64;
        for ((bundle, found), (smooth, left)) in bundles.iter().zip(&found).zip(corrections) {
            for (lane, place) in bundle.places().enumerate() {
                occlusion[place] = smooth[lane];
            }
            variance += f64::from(left) * bundle.n as f64;
            n_rays += u64::from(found.n_rays);
            n_dirs += u64::from(found.n_directions);
        }
        return Ok((occlusion, format!("NEW {} bundles of {}, {n_rays} rays, dirs {n_dirs}, est {}", bundles.len(), doubtful.len(), (variance / doubtful.len() as f64).sqrt())));
    }
    if !doubtful.is_empty() {
        let share = half..share.end;
        let tracing = Tracing::of(surfels, &settings, &share, job)?;
        let start = share.start + 0.1 * (share.end - share.start);
        job.progress(start, &format!("tracing rays for {} surfels", doubtful.len()));
        let budget = Budget { least: LEAST_RAYS, most: settings.rays, error: ENOUGH };
        let found =
            job.map(doubtful.len(), start..share.end, |i| tracing.occlusion(doubtful[i], budget))?;
        for (&place, (share, rays)) in doubtful.iter().zip(found) {
            occlusion[place] = share;
            n_rays += u64::from(rays);
        }
    }
    let how = format!(
        "gathered an octree of {} surfels, and traced {n_rays} rays for {} of them",
        surfels.len(),
        doubtful.len()
    );
    Ok((occlusion, how))
}
