//! An index that several processes or machines make together, step by step, in one folder that all of them see.
//!
//! Tasks of a step share no file that they write. What is left when all steps are done, [`index`](super::index) does:
//! it goes on with what is there.

use super::cells::Cube;
use super::chunk::Chunks;
use super::guide;
use super::plan::Plan;
use super::spool::Spool;
use super::work::Work;
use super::{
    CUBES, IndexOptions, announced, better, budget, collected, how, known_spool, most_points,
    spooled_file,
};
use crate::error::PyramidError;
use std::path::{Path, PathBuf};
use surfelshop_cloud::ReadOptions;
use surfelshop_cloud::convert::Collection;
use surfelshop_geometry::part;

/// A step of an index; each begins when the one before is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IndexStep {
    /// Looks for a cube around all points, as files say; one task. Where the points turned out to lie elsewhere, again.
    Extent,
    /// Reads files, and puts their points on the disk by place.
    Points,
    /// Divides points among chunks; one task.
    Plan,
    /// Makes surfels and nodes of chunks.
    Surfels,
}

impl IndexStep {
    fn name(self) -> &'static str {
        match self {
            Self::Extent => "extent",
            Self::Points => "points",
            Self::Plan => "plan",
            Self::Surfels => "surfels",
        }
    }
}

/// A part of a step: the pieces of work whose number, from 0 on, leaves `number` when divided by `of`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IndexShare {
    /// The step.
    pub step: IndexStep,
    /// From 0 to less than `of`.
    pub number: usize,
    /// 1 or more.
    pub of: usize,
}

/// What was done in a share.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct ShareSummary {
    /// Pieces of work of the share: files or chunks.
    pub n_own: u64,
    /// Those of all shares of the step.
    pub n_all: u64,
}

/// The name of what says that points are divided.
const PLANNED: &str = "planned";

/// Does a share of an index.
///
/// # Errors
/// One line: what the files are, or which step has to be done first.
pub fn index_share(
    inputs: &[PathBuf],
    output: &Path,
    options: &IndexOptions<'_>,
    share: IndexShare,
) -> Result<ShareSummary, PyramidError> {
    let collection = collected(inputs, options)?;
    let paths: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
    let how = how(&collection.header, options);
    let most = most_points(options.memory);
    let step = share.step;
    let mut work = match step {
        IndexStep::Extent => Work::find(output, &paths, how, most)?,
        _ => Work::join(output, &paths, how, most)?,
    };
    let shared = Shared { inputs, collection: &collection, options };
    match step {
        IndexStep::Extent => shared.extent(&mut work),
        IndexStep::Points => shared.points(&work, share),
        IndexStep::Plan => shared.plan(&work),
        IndexStep::Surfels => shared.surfels(&work, share),
    }
}

/// What all steps work on.
struct Shared<'a> {
    inputs: &'a [PathBuf],
    collection: &'a Collection,
    options: &'a IndexOptions<'a>,
}

impl Shared<'_> {
    fn extent(&self, work: &mut Work) -> Result<ShareSummary, PyramidError> {
        let Self { inputs, options, .. } = *self;
        let one = ShareSummary { n_own: 1, n_all: 1 };
        let Some((cube, n_tried)) = work.known::<(Cube, u32)>("cube") else {
            let cube = announced(inputs, options, options.read.progress)?;
            work.begin()?;
            work.keep("cube", &(cube, 0u32))?;
            return Ok(one);
        };
        let Ok(spools) = self.spools(work) else { return Ok(one) };
        if let Some(fitting) = better(&cube, &spools).filter(|_| n_tried + 1 < CUBES) {
            drop(spools);
            work.clear()?;
            work.begin()?;
            work.keep("cube", &(fitting, n_tried + 1))?;
        }
        Ok(one)
    }

    fn points(&self, work: &Work, share: IndexShare) -> Result<ShareSummary, PyramidError> {
        let Self { inputs, collection, options } = *self;
        let (cube, _) = known_cube(work)?;
        let own: Vec<usize> = pieces(share, inputs.len());
        for (i, &number) in own.iter().enumerate() {
            let done = |i: usize| i as f64 / own.len() as f64;
            let reading = part(options.read.progress, done(i)..done(i + 1));
            let read = ReadOptions { progress: &reading, ..options.read };
            let options = IndexOptions { read, ..*options };
            spooled_file((number, &inputs[number]), (collection, cube), work, &options)?;
        }
        Ok(summary(&own, inputs.len()))
    }

    fn plan(&self, work: &Work) -> Result<ShareSummary, PyramidError> {
        let (cube, n_tried) = known_cube(work)?;
        let spools = self.spools(work)?;
        if better(&cube, &spools).is_some() && n_tried + 1 < CUBES {
            return Err(PyramidError::file(
                &work.folder,
                "the points lie elsewhere than the heads of files say; do the steps `extent` and `points` again, or \
                 leave --step and --part out",
            ));
        }
        let plan = self.divided(work, (cube, spools))?;
        let read = &self.options.read;
        guide::kept_or_made(&plan, self.collection, work, read, read.progress)?;
        work.keep(PLANNED, &plan.chunks.len())?;
        Ok(ShareSummary { n_own: 1, n_all: 1 })
    }

    fn surfels(&self, work: &Work, share: IndexShare) -> Result<ShareSummary, PyramidError> {
        let (cube, _) = known_cube(work)?;
        let n_chunks =
            work.known::<usize>(PLANNED).ok_or_else(|| not_done(work, IndexStep::Plan))?;
        let plan = self.divided(work, (cube, self.spools(work)?))?;
        if plan.chunks.len() != n_chunks {
            return Err(not_done(work, IndexStep::Plan));
        }
        let Self { collection, options, .. } = *self;
        let (folder, read) = (work.folder.as_path(), options.read);
        let guide = guide::kept_or_made(&plan, collection, work, &read, read.progress)?;
        let chunks = Chunks { plan: &plan, collection, cube, folder, guide, read };
        let own = pieces(share, n_chunks);
        for (i, &number) in own.iter().enumerate() {
            let done = |i: usize| i as f64 / own.len() as f64;
            let step = part(options.read.progress, done(i)..done(i + 1));
            if step(0.0).is_break() {
                return Err(PyramidError::Cancelled(work.folder.clone()));
            }
            chunks.made(number, &step)?;
        }
        Ok(summary(&own, n_chunks))
    }

    fn divided(
        &self,
        work: &Work,
        (cube, spools): (Cube, Vec<Spool>),
    ) -> Result<Plan, PyramidError> {
        let header = (&self.collection.header, cube);
        Plan::of(spools, header, &work.folder, work.most, budget(self.options))
    }

    /// What the step `points` made of all files.
    fn spools(&self, work: &Work) -> Result<Vec<Spool>, PyramidError> {
        let of = |number: usize| {
            let known = known_spool(work, number).map(|(spool, _)| spool);
            known.ok_or_else(|| {
                let name = self.inputs[number].display();
                let line =
                    format!("the points of {name} are not there; do the step `points` first");
                PyramidError::file(&work.folder, line)
            })
        };
        (0..self.inputs.len()).map(of).collect()
    }
}

fn known_cube(work: &Work) -> Result<(Cube, u32), PyramidError> {
    work.known("cube").ok_or_else(|| not_done(work, IndexStep::Extent))
}

fn not_done(work: &Work, step: IndexStep) -> PyramidError {
    let line = format!("the step `{}` is not done; do it first", step.name());
    PyramidError::file(&work.folder, line)
}

fn pieces(share: IndexShare, n: usize) -> Vec<usize> {
    (share.number..n).step_by(share.of.max(1)).collect()
}

fn summary(own: &[usize], n_all: usize) -> ShareSummary {
    ShareSummary { n_own: own.len() as u64, n_all: n_all as u64 }
}
