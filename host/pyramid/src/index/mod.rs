//! Makes a pyramid of files of any size in bounded memory.
//!
//! The points of all files are read once and put on the disk by the cells of an octree. Then one chunk after the other,
//! a cell with as many points as fit into memory, is made surfels, with the points around it so that estimates are the
//! same as in memory, and divided into leaves; above them come nodes of merged surfels. At the end the nodes above the
//! chunks are merged, and all are copied into the file, the coarsest first.
//!
//! What is done stays in a folder beside the file until it is whole, `NAME.index`: an index that was ended goes on where
//! it was, and makes the same bytes.

mod cells;
mod chunk;
mod finish;
mod merged;
mod nodes;
mod plan;
mod spool;
mod work;

use crate::error::PyramidError;
use cells::Cube;
use chunk::{Chunks, Counts};
use nodes::Made;
use plan::Plan;
use spool::{Spool, Spooler};
use std::path::{Path, PathBuf};
use surfelshop_api::columns::{COLOR, Element};
use surfelshop_cloud::convert::{Collected, Collection};
use surfelshop_cloud::{Progress, ReadOptions};
use surfelshop_geometry::part;
use work::Work;

/// How a pyramid is made.
#[derive(Clone, Copy)]
pub struct IndexOptions<'a> {
    /// How files are read, and what they lack is estimated.
    pub read: ReadOptions<'a>,
    /// Memory that it takes at most, bytes, beside the program itself.
    pub memory: u64,
}

/// What was made.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct IndexSummary {
    /// Points of all files.
    pub n_read: u64,
    /// Of these, those left out since their coordinates are not finite.
    pub n_not_finite: u64,
    /// Surfels of the leaves.
    pub n_surfels: u64,
    /// Nodes, and leaves among them.
    pub n_nodes: u64,
    /// See there.
    pub n_leaves: u64,
    /// Parts that were worked on by themselves.
    pub n_chunks: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// What the user should know, one sentence each.
    pub warnings: Vec<String>,
}

/// Level of the cells that points are put into first: 64 to a side.
const FIRST_LEVEL: u32 = 6;

/// Bytes that a point of a chunk takes while what it lacks is estimated, those around it counted; measured.
const POINT_BYTES: u64 = 700;

/// Fewer points of a chunk make the seams between chunks count.
const FEWEST: u64 = 1 << 16;
/// More make no difference.
const MOST: u64 = 1 << 22;

/// Makes a pyramid of the points of all `inputs`.
///
/// # Errors
/// One line that names the file, what was expected and what was found. What was done until then stays in the folder
/// `NAME.index` beside the output, and the same call goes on from there.
pub fn index(
    inputs: &[PathBuf],
    output: &Path,
    options: &IndexOptions<'_>,
) -> Result<IndexSummary, PyramidError> {
    let most = (options.memory / 2 / POINT_BYTES).clamp(FEWEST, MOST);
    let work = Work::open(output, inputs, options, most)?;
    let progress = options.read.progress;
    let folder = work.folder.clone();
    let watched = |fraction: f64| progress(fraction);
    let cancelled = || PyramidError::Cancelled(folder.clone());
    if progress(0.0).is_break() {
        return Err(cancelled());
    }
    let (collection, cube) = collected(inputs, &work, options)?;
    let spooling = part(&watched, 0.02..0.2);
    let (spools, read) = spooled(inputs, (&collection, cube), &work, options, &spooling)?;
    let budget = budget(options);
    let plan = Plan::of(spools, (&collection.header, cube), &work.folder, most, budget)?;
    let chunks = Chunks {
        plan: &plan,
        collection: &collection,
        cube,
        folder: &work.folder,
        read: options.read,
    };
    let (made, counts) = worked(&chunks, &part(&watched, 0.2..0.95))?;
    let mut summary = IndexSummary {
        n_read: read.iter().map(|read| read.n_read).sum(),
        n_not_finite: read.iter().map(|read| read.n_not_finite).sum(),
        n_surfels: counts.n_surfels,
        n_chunks: plan.chunks.len() as u64,
        ..IndexSummary::default()
    };
    summary.warnings = read.into_iter().flat_map(|read| read.warnings).collect();
    for warning in &counts.warnings {
        if !summary.warnings.contains(warning) {
            summary.warnings.push(warning.clone());
        }
    }
    let finishing = part(&watched, 0.95..1.0);
    let done = finish::finish(made, (&collection, &counts), output, &work.folder, &finishing)?;
    (summary.n_nodes, summary.n_leaves, summary.bytes) = done;
    work.remove();
    Ok(summary)
}

/// Bytes that wait for the disk.
fn budget(options: &IndexOptions<'_>) -> usize {
    usize::try_from(options.memory / 8).unwrap_or(usize::MAX).clamp(1 << 20, 1 << 29)
}

/// What the files are, and a cube around all of their points.
fn collected(
    inputs: &[PathBuf],
    work: &Work,
    options: &IndexOptions<'_>,
) -> Result<(Collection, Cube), PyramidError> {
    let silent = surfelshop_cloud::silent;
    let read = ReadOptions { progress: &silent, ..options.read };
    let collection = Collection::of(inputs, &read)?;
    chunk::check(&collection.header).map_err(PyramidError::Points)?;
    let color = collection.header.column(COLOR).map(|(_, column)| column.element);
    if let Some(Element::I8 | Element::I16 | Element::I32 | Element::U32) = color {
        return Err(PyramidError::Points(
            "expected colours of 8 or 16 bits or floats, found whole numbers of another type; \
             convert the files first"
                .to_owned(),
        ));
    }
    if let Some(cube) = work.known("cube") {
        return Ok((collection, cube));
    }
    let mut bounds: Option<[glam::DVec3; 2]> = None;
    for input in inputs {
        let contents = surfelshop_cloud::inspect(input, &read)
            .map_err(surfelshop_cloud::convert::ConvertError::from)?;
        for [low, high] in contents.clouds.into_iter().filter_map(|cloud| cloud.bounds) {
            let [all_low, all_high] = bounds.get_or_insert([low, high]);
            (*all_low, *all_high) = (all_low.min(low), all_high.max(high));
        }
    }
    let Some(bounds) = bounds else {
        return Err(PyramidError::Points(
            "expected points with finite coordinates, found none".to_owned(),
        ));
    };
    let cube = Cube::around(bounds);
    work.keep("cube", &cube)?;
    Ok((collection, cube))
}

/// All points on the disk, by cells.
fn spooled(
    inputs: &[PathBuf],
    (collection, cube): (&Collection, Cube),
    work: &Work,
    options: &IndexOptions<'_>,
    progress: Progress<'_>,
) -> Result<(Vec<Spool>, Vec<Collected>), PyramidError> {
    let (mut spools, mut all) = (Vec::new(), Vec::new());
    for (number, input) in inputs.iter().enumerate() {
        let path = work.folder.join(format!("points-{number}.bin"));
        if let Some((spool, (n_read, n_not_finite, warnings))) = Spool::sealed(&path) {
            spools.push(spool);
            all.push(Collected { n_read, n_not_finite, warnings });
            continue;
        }
        let mut spooler =
            Spooler::new(&collection.header, cube, FIRST_LEVEL, &path, budget(options))?;
        let share = |number: usize| number as f64 / inputs.len() as f64;
        let reading = part(progress, share(number)..share(number + 1));
        let read = ReadOptions { progress: &reading, ..options.read };
        let mut fault = None;
        let mut take = |batch: &surfelshop_api::CloudView<'_>| {
            spooler.take(batch).map_err(|error| {
                let line = error.to_string();
                fault = Some(error);
                line
            })
        };
        let collected = collection.read((number, input), &read, &mut take);
        let collected = match (collected, fault) {
            (_, Some(fault)) => return Err(fault),
            (Err(error), None) if error.is_cancelled() => {
                return Err(PyramidError::Cancelled(work.folder.clone()));
            }
            (collected, None) => collected?,
        };
        let spool = spooler.finish()?;
        spool.seal(&(collected.n_read, collected.n_not_finite, &collected.warnings))?;
        spools.push(spool);
        all.push(collected);
    }
    Ok((spools, all))
}

/// The nodes of all chunks.
fn worked(
    chunks: &Chunks<'_>,
    progress: Progress<'_>,
) -> Result<(Vec<Made>, Counts), PyramidError> {
    let rows = |range: &std::ops::Range<usize>| -> u64 {
        chunks.plan.cells[range.clone()].iter().map(|cell| cell.rows).sum()
    };
    let all: u64 = chunks.plan.chunks.iter().map(|(_, range)| rows(range)).sum();
    let (mut made, mut counts, mut done) = (Vec::new(), Counts::default(), 0);
    for (number, (_, range)) in chunks.plan.chunks.iter().enumerate() {
        let share = |done: u64| done as f64 / all.max(1) as f64;
        let next = done + rows(range);
        let step = part(progress, share(done)..share(next));
        if step(0.0).is_break() {
            return Err(PyramidError::Cancelled(chunks.folder.to_owned()));
        }
        let (node, of_chunk) = chunks.made(number, &step)?;
        made.extend(node);
        counts.n_surfels += of_chunk.n_surfels;
        counts.normals_estimated += of_chunk.normals_estimated;
        counts.radii_estimated += of_chunk.radii_estimated;
        counts.scattered += of_chunk.scattered;
        counts.of_unsure_side += of_chunk.of_unsure_side;
        counts.largest_radius = counts.largest_radius.max(of_chunk.largest_radius);
        for warning in of_chunk.warnings {
            if !counts.warnings.contains(&warning) {
                counts.warnings.push(warning);
            }
        }
        done = next;
    }
    Ok((made, counts))
}
