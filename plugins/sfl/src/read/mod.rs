//! Reading: every surfel set of a file becomes a cloud.

mod batch;
mod columns;
mod geometry;
mod placement;
mod scene;
mod set;
mod streamed;

use crate::surfel::property;
use batch::{Records, decode, has_opacity};
#[cfg(test)]
pub(crate) use columns::Buffer;
use columns::Plan;
use geometry::Geometry;
use placement::Placement;
use scene::{Facts, Scene};
use set::SurfelSet;
use surfelshop_api::format::{CloudHeader, CloudSink, FileSource};
use surfelshop_api::{Job, Result};

/// Reads all surfel sets of a file.
///
/// # Errors
/// Where the file is damaged so that no set can be read, the sink refuses, or the user asked to stop.
pub(crate) fn read(file: &FileSource, clouds: &mut CloudSink<'_>, job: &Job<'_>) -> Result<()> {
    let scene = Scene::open(file)?;
    for line in &scene.warnings {
        clouds.warn(line);
    }
    let total: u64 = scene.sets.iter().map(|set| set.rows).sum();
    let mut progress = Progress { job, done: 0, total };
    for set in &scene.sets {
        for line in &set.warnings {
            clouds.warn(&format!("surfel set `{}`: {line}", set.name));
        }
        read_set(file, &scene.facts, set, clouds, &mut progress)?;
    }
    Ok(())
}

/// How far the whole file is read.
struct Progress<'a> {
    job: &'a Job<'a>,
    done: u64,
    total: u64,
}

impl Progress<'_> {
    fn add(&mut self, rows: usize) -> Result<()> {
        self.done += rows as u64;
        self.job.progress(self.done as f64 / self.total.max(1) as f64, "");
        self.job.check()
    }
}

fn read_set(
    file: &FileSource,
    facts: &Facts,
    set: &SurfelSet,
    clouds: &mut CloudSink<'_>,
    progress: &mut Progress<'_>,
) -> Result<()> {
    let name = &set.name;
    let (placement, lines) = Placement::of(facts.axes, set.transform);
    for line in &lines {
        clouds.warn(&format!("surfel set `{name}`: {line}"));
    }
    let mut records = Records::new(file, set)?;
    let with_alpha = clouds.wants(surfelshop_api::columns::COLOR)
        && has_opacity(&mut records, &set.layout, progress.job)?;
    let plan = Plan::of(&set.layout, &placement, with_alpha, |column| clouds.wants(column));
    let header = cloud_header(facts, set, &placement, &plan);
    if !clouds.begin(&header)? {
        return Ok(());
    }
    let geometry = Geometry { layout: &set.layout, placement: &placement };
    let mut buffers = plan.buffers();
    let (mut n_invalid, mut n_translucent) = (0, 0);
    records.rewind();
    while let Some(bytes) = records.next_batch()? {
        let doubtful = decode(bytes, &plan, &geometry, &mut buffers);
        n_invalid += doubtful.invalid_normals;
        n_translucent += doubtful.opacities_left_out;
        let values: Vec<_> = buffers.iter().map(|buffer| buffer.values()).collect();
        clouds.batch(&values)?;
        progress.add(bytes.len() / set.layout.record)?;
    }
    if n_invalid > 0 {
        clouds.warn(&format!(
            "surfel set `{name}`: {n_invalid} normals have invalid codes and count as missing"
        ));
    }
    if n_translucent > 0 {
        clouds.warn(&format!(
            "surfel set `{name}`: the opacity of {n_translucent} ambient or specular colours is left out"
        ));
    }
    Ok(())
}

fn cloud_header(facts: &Facts, set: &SurfelSet, placement: &Placement, plan: &Plan) -> CloudHeader {
    let mut format = format!("SFL, surfel format {}", set.version);
    if set.layout.place(property::NORMAL).is_some() {
        format.push_str(&format!(", {} normals", set.layout.normals.name()));
    }
    if let Some(model) = set.layout.colors {
        format.push_str(&format!(", {} colours", model.name()));
    }
    let own = placement.comment().map(str::to_owned);
    CloudHeader {
        format,
        name: set.name.clone(),
        rows: Some(set.rows),
        columns: plan.file_columns(),
        bounds: set.bounds.map(|bounds| placement.bounds(bounds)),
        pose: placement.pose,
        up: facts.up,
        metres_per_unit: facts.metres_per_unit,
        time: facts.date.clone(),
        comments: facts.comments.iter().chain(&set.comments).cloned().chain(own).collect(),
        ..CloudHeader::default()
    }
}
