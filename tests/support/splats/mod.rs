//! Splats made by the tool `splats`, and how far pictures of them are from those of the samples.

mod bench;
mod edges;
mod torso;

pub use bench::{Bench, MODES, Quality, bytes_each};
pub use edges::{AtEdges, EdgeBench, ell, sampled};
pub use torso::torso;

use crate::stage;
use anyhow::{Context as _, Result, bail};
use glam::DVec3;
use std::time::{Duration, Instant};
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{UnitKind, View};
use surfelshop_cloud::Cloud;
use surfelshop_runtime::plugins::LoadedUnit;
use surfelshop_runtime::tools::{Ended, Running, ToolOptions};

/// Splats, and how they came about.
#[derive(Clone, Debug)]
pub struct Baked {
    /// The splats.
    pub cloud: Cloud,
    /// What the tool said of them.
    pub told: String,
    /// Elapsed time, seconds.
    pub seconds: f64,
}

/// Longest time that the tool is given.
const PATIENCE: Duration = Duration::from_secs(600);

/// Views of all of a cloud from these directions.
fn views_around(cloud: &Cloud, directions: [[f64; 3]; 3], size: u32) -> Vec<View> {
    let facts = cloud.facts();
    let center = 0.5 * (facts.bounds_min + facts.bounds_max);
    let reach = (facts.bounds_max - facts.bounds_min).length();
    let view = |direction| {
        let direction = DVec3::from_array(direction).normalize_or(DVec3::Z);
        let view = stage::view(center + direction * (1.25 * reach), center, size);
        View { near: 1e-4 * reach, far: 9.0 * reach, ..view }
    };
    directions.map(view).to_vec()
}

/// Runs the tool `splats`.
///
/// # Errors
/// Those of the tool.
pub fn bake(cloud: &Cloud, values: &[(&str, Value)]) -> Result<Baked> {
    let tool = stage::built_unit("surfelshop-phong-splatting", UnitKind::Tool, "splats");
    bake_with(&tool, cloud, values)
}

fn bake_with(tool: &LoadedUnit, cloud: &Cloud, values: &[(&str, Value)]) -> Result<Baked> {
    let values: Values = values.iter().map(|(id, v)| ((*id).to_owned(), v.clone())).collect();
    let started = Instant::now();
    let running = Running::start(tool, &values, cloud, &ToolOptions::default());
    let mut running = running.context("the tool does not start")?;
    let mut ended = None;
    while ended.is_none() && started.elapsed() < PATIENCE {
        ended = running.wait(Duration::from_secs(1));
    }
    match ended {
        Some(Ended::Done(done)) => Ok(Baked {
            told: done.said.clone(),
            cloud: done.edited.context("the tool made nothing")?.cloud,
            seconds: started.elapsed().as_secs_f64(),
        }),
        Some(Ended::Failed(fault)) => bail!("{fault}"),
        other => bail!("the tool ended as {other:?}"),
    }
}

/// The same with a tolerance alone.
///
/// # Errors
/// Those of the tool.
pub fn splats(cloud: &Cloud, tolerance: f64) -> Result<Baked> {
    bake(cloud, &[("tolerance", Value::Float(tolerance))])
}
