//! From a cloud to its column `ao`.

use crate::rays::{Budget, Tracing};
use crate::settings::{Method, Settings};
use crate::surfels::{Occlusion, Surfels};
use crate::{hybrid, passes};
use std::ops::Range;
use surfelshop_api::columns::{AO, Values};
use surfelshop_api::prelude::*;
use surfelshop_api::tool::NewColumn;

/// Microseconds that a surfel's preparation takes, a ray that is traced alone, a pass over an octree and
/// the form factor of a pair: measured on a million surfels, for the progress.
const PREPARATION: f64 = 3.5;
const RAY: f64 = 0.5;
const PASS: f64 = 1.1;
const PAIR: f64 = 0.0002;

/// Share of the time that is preparation. Of `hybrid`, whether rays are traced is not known yet: it
/// is 0.4 where none are and 0.2 where all surfels' are.
fn prepared(settings: &Settings, n: usize) -> f64 {
    let passes = f64::from(settings.passes);
    let rest = match settings.method {
        Method::Hybrid => return 0.3,
        Method::Rays => RAY * f64::from(settings.rays),
        Method::Octree => PASS * passes,
        Method::BruteForce => PAIR * n as f64 * passes,
    };
    PREPARATION / (PREPARATION + rest)
}

pub(crate) fn bake(cloud: &CloudView<'_>, settings: &Settings, job: &Job<'_>) -> Result<()> {
    let prepared = prepared(settings, cloud.len);
    let surfels = Surfels::of(cloud, prepared, job)?;
    let share = prepared..1.0;
    let (occlusion, how) = match settings.method {
        Method::Hybrid => hybrid::find(&surfels, settings, share, job)?,
        Method::Rays => rays(&surfels, settings, share, job)?,
        Method::BruteForce | Method::Octree => passes::find(&surfels, settings, share, job)?,
    };
    // What has no direction or no place sees everything.
    let mut accessibility = vec![1.0; cloud.len];
    for (&index, occlusion) in surfels.order.iter().zip(occlusion) {
        accessibility[index as usize] = 1.0 - occlusion.clamp(0.0, 1.0);
    }
    let values = Values::F32(&accessibility);
    job.edit(&Edit::Columns(vec![NewColumn { name: AO, components: 1, values }]))?;
    let left_open = |n: usize, why: &str| match n {
        0 => String::new(),
        n => format!("; left open: {n} {why}"),
    };
    let refused = left_open(surfels.n_refused, "without a position or normal");
    let strays = left_open(surfels.n_strays, "far outside (`outliers` removes them)");
    job.progress(1.0, &format!("{how}{refused}{strays}"));
    Ok(())
}

fn rays(
    surfels: &Surfels,
    settings: &Settings,
    share: Range<f64>,
    job: &Job<'_>,
) -> Result<Occlusion> {
    let tracing = Tracing::of(surfels, settings, &share, job)?;
    let start = share.start + 0.1 * (share.end - share.start);
    job.progress(start, "tracing rays");
    let budget = Budget::fixed(settings.rays);
    let occlusion =
        job.map(surfels.len(), start..share.end, |place| match surfels.is_context(place) {
            true => 0.0,
            false => tracing.occlusion(place, budget).0,
        })?;
    let n = (0..surfels.len()).filter(|&place| !surfels.is_context(place)).count();
    Ok((occlusion, format!("traced {} rays for each of {n} surfels", settings.rays)))
}
