//! Makes a pyramid of files of any size in bounded memory.
//!
//! The points of all files are read once and put on the disk by the cells of an octree. Then one chunk after the other,
//! a cell with as many points as fit into memory, is made surfels, with the points around it so that estimates are the
//! same as in memory, and divided into leaves; above them come nodes of merged surfels. At the end the nodes above the
//! chunks are merged, and all are copied into the file, the coarsest first.
//!
//! What is done stays in a folder beside the file until it is whole, `NAME.index`: an index that was ended goes on where
//! it was, and makes the same bytes.

mod around;
pub(crate) mod cells;
pub(crate) mod chunk;
pub(crate) mod finish;
mod guide;
pub(crate) mod merged;
pub(crate) mod nodes;
mod plan;
pub(crate) mod shared;
pub(crate) mod spool;
pub(crate) mod tree;
pub(crate) mod work;

use crate::error::PyramidError;
use cells::{Cell, Cube};
use chunk::{Chunks, Counts};
use nodes::Made;
use plan::Plan;
use spool::{Spool, Spooler};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use surfelshop_api::columns::{COLOR, Element};
use surfelshop_api::format::CloudHeader;
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

/// Levels of the cells that points are put into first: 8 to 64 to a side.
const FIRST_LEVELS: std::ops::RangeInclusive<u32> = 3..=6;

/// Points of a cell that are written together, at least, so that there are not too many pieces to keep in mind.
const TOGETHER: u64 = 64;

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
    let most = most_points(options.memory);
    let progress = options.read.progress;
    let collection = collected(inputs, options)?;
    let paths: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
    let mut work = Work::find(output, &paths, how(&collection.header, options), most)?;
    if progress(0.0).is_break() {
        return Err(PyramidError::Cancelled(work.folder.clone()));
    }
    let spooling = part(progress, 0.0..0.2);
    let (cube, spools, read) = placed(inputs, &collection, &mut work, options, &spooling)?;
    let header = (&collection.header, cube);
    let plan = Plan::of(spools, header, &work.folder, work.most, budget(options))?;
    let looking = part(progress, 0.2..0.25);
    let chunks = Chunks {
        plan: &plan,
        collection: &collection,
        cube,
        folder: &work.folder,
        guide: guide::kept_or_made(&plan, &collection, &work, &options.read, &looking)?,
        read: options.read,
    };
    let (made, counts) = worked(&chunks, &part(progress, 0.25..0.95))?;
    let mut summary = IndexSummary {
        n_read: read.iter().map(|read| read.n_read).sum(),
        n_not_finite: read.iter().map(|read| read.n_not_finite).sum(),
        n_surfels: counts.n_surfels,
        n_chunks: plan.chunks.len() as u64,
        ..IndexSummary::default()
    };
    summary.warnings = work.warning.iter().cloned().collect();
    summary.warnings.extend(read.into_iter().flat_map(|read| read.warnings));
    let lost = summary.n_read.saturating_sub(summary.n_not_finite + summary.n_surfels);
    if lost > 0 {
        summary.warnings.push(format!(
            "{lost} points were left out: their coordinates exceed 8.5e37; scale the files"
        ));
    }
    for warning in &counts.warnings {
        if !summary.warnings.contains(warning) {
            summary.warnings.push(warning.clone());
        }
    }
    let finishing = part(progress, 0.95..1.0);
    let done = finish::finish(made, (&collection, &counts), output, &work.folder, &finishing)?;
    (summary.n_nodes, summary.n_leaves, summary.bytes) = done;
    work.remove();
    Ok(summary)
}

/// The most points that are worked on together.
pub(crate) fn most_points(memory: u64) -> u64 {
    (memory / 2 / POINT_BYTES).clamp(FEWEST, MOST)
}

/// What is done to the files, by which an earlier run's work is known again.
fn how(header: &CloudHeader, options: &IndexOptions<'_>) -> String {
    let ReadOptions { n_neighbours, radius, format, values, color_bits, .. } = &options.read;
    format!(
        "index, guided {n_neighbours} {radius:?} {format:?} {values:?} {color_bits:?} {header:?}"
    )
}

/// Bytes that wait for the disk.
fn budget(options: &IndexOptions<'_>) -> usize {
    usize::try_from(options.memory / 8).unwrap_or(usize::MAX).clamp(1 << 20, 1 << 29)
}

/// What the files are.
fn collected(inputs: &[PathBuf], options: &IndexOptions<'_>) -> Result<Collection, PyramidError> {
    let silent = surfelshop_cloud::silent;
    let read = ReadOptions { progress: &silent, ..options.read };
    let collection = Collection::of(inputs, &read)?;
    let color = collection.header.column(COLOR).map(|(_, column)| column.element);
    if let Some(Element::I8 | Element::I16 | Element::I32 | Element::U32) = color {
        return Err(PyramidError::Points(
            "expected colours of 8 or 16 bits or floats, found whole numbers of another type; \
             convert the files first"
                .to_owned(),
        ));
    }
    Ok(collection)
}

/// A cube around all points, as the files say.
fn announced(
    inputs: &[PathBuf],
    options: &IndexOptions<'_>,
    progress: Progress<'_>,
) -> Result<Cube, PyramidError> {
    let mut bounds: Option<[glam::DVec3; 2]> = None;
    for (number, input) in inputs.iter().enumerate() {
        // Files that do not say where their points are have all of them read.
        let share = |number: usize| number as f64 / inputs.len() as f64;
        let looking = part(progress, share(number)..share(number + 1));
        let read = ReadOptions { progress: &looking, ..options.read };
        let contents = surfelshop_cloud::inspect(input, &read)
            .map_err(surfelshop_cloud::convert::ConvertError::from)?;
        for [low, high] in contents.clouds.into_iter().filter_map(|cloud| cloud.bounds) {
            let [all_low, all_high] = bounds.get_or_insert([low, high]);
            (*all_low, *all_high) = (all_low.min(low), all_high.max(high));
        }
    }
    bounds.map(Cube::around).ok_or_else(|| {
        PyramidError::Points("expected points with finite coordinates, found none".to_owned())
    })
}

/// Points that lie apart from all others, at most one for so many: the cube need not hold them.
const ONE_APART: u64 = 1000;

/// A cube so many times as large as what is in it wastes cells; there are 21 levels of them.
const TOO_LARGE: f64 = 64.0;

/// Cubes that are tried: where even the last does not fit, points lie as far apart as f64 allows.
const CUBES: u32 = 8;

/// The cube that the points of files need, where it is another: their heads may be wrong, and single points may lie
/// far from all others.
fn better(cube: &Cube, spools: &[Spool]) -> Option<Cube> {
    let mut cells: BTreeMap<Cell, (u64, [glam::DVec3; 2])> = BTreeMap::new();
    for segment in spools.iter().flat_map(|spool| &spool.segments) {
        let (rows, bounds) = cells.entry(segment.cell).or_insert((0, segment.bounds));
        *rows += u64::from(segment.rows);
        *bounds = [bounds[0].min(segment.bounds[0]), bounds[1].max(segment.bounds[1])];
    }
    let all: u64 = cells.values().map(|(rows, _)| rows).sum();
    let mut by_rows: Vec<(u64, [glam::DVec3; 2])> = cells.into_values().collect();
    // Of equally full ones the first along the curve.
    by_rows.sort_by_key(|(rows, _)| std::cmp::Reverse(*rows));
    let (mut held, mut bounds) = (0, None::<[glam::DVec3; 2]>);
    for (rows, [low, high]) in by_rows {
        if held + all / ONE_APART >= all && held > 0 {
            break;
        }
        held += rows;
        let [all_low, all_high] = bounds.get_or_insert([low, high]);
        (*all_low, *all_high) = (all_low.min(low), all_high.max(high));
    }
    let [low, high] = bounds?;
    let (fitting, slack) = (Cube::around([low, high]), 1e-6 * cube.side);
    let is_within =
        (low + slack).cmpge(cube.low).all() && high.cmple(cube.low + cube.side + slack).all();
    (!is_within || fitting.side * TOO_LARGE < cube.side).then_some(fitting)
}

/// All points on the disk by the cells of a cube that fits them, with the cube.
fn placed(
    inputs: &[PathBuf],
    collection: &Collection,
    work: &mut Work,
    options: &IndexOptions<'_>,
    progress: Progress<'_>,
) -> Result<(Cube, Vec<Spool>, Vec<Collected>), PyramidError> {
    let (mut cube, mut n_tried) = match work.known("cube") {
        Some(known) => known,
        None => {
            let found = announced(inputs, options, &part(progress, 0.0..0.2));
            let found = found.map_err(|error| match error {
                PyramidError::Source(error) if error.is_cancelled() => {
                    PyramidError::Cancelled(work.folder.clone())
                }
                error => error,
            });
            (found?, 0u32)
        }
    };
    work.begin()?;
    loop {
        work.keep("cube", &(cube, n_tried))?;
        let spooling = part(progress, 0.2..1.0);
        let (spools, read) = spooled(inputs, (collection, cube), work, options, &spooling)?;
        n_tried += 1;
        match better(&cube, &spools).filter(|_| n_tried < CUBES) {
            Some(fitting) => {
                cube = fitting;
                drop(spools);
                work.clear()?;
                work.begin()?;
            }
            None => return Ok((cube, spools, read)),
        }
    }
}

/// The level of the cells that points are put into first: so fine that many wait for the disk together even where all
/// space is filled. It follows from the size of chunks, which an index that goes on keeps.
fn first_level(header: &CloudHeader, most: u64) -> u32 {
    let row: u64 = header.columns.iter().map(|column| column.point_bytes() as u64).sum();
    let waiting = most * POINT_BYTES / 4;
    let n_cells = waiting / (row.max(1) * TOGETHER);
    FIRST_LEVELS.rev().find(|level| 1 << (3 * level) <= n_cells).unwrap_or(*FIRST_LEVELS.start())
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
        let share = |number: usize| number as f64 / inputs.len() as f64;
        let reading = part(progress, share(number)..share(number + 1));
        let read = ReadOptions { progress: &reading, ..options.read };
        let options = IndexOptions { read, ..*options };
        let (spool, collected) = spooled_file((number, input), (collection, cube), work, &options)?;
        spools.push(spool);
        all.push(collected);
    }
    Ok((spools, all))
}

/// The file in which the points of an input lie by cells.
fn spool_path(work: &Work, number: usize) -> PathBuf {
    work.folder.join(format!("points-{number}.bin"))
}

/// What an earlier run put on the disk of an input.
fn known_spool(work: &Work, number: usize) -> Option<(Spool, Collected)> {
    let (spool, (n_read, n_not_finite, warnings)) = Spool::sealed(&spool_path(work, number))?;
    Some((spool, Collected { n_read, n_not_finite, warnings }))
}

/// The points of an input on the disk, by cells.
fn spooled_file(
    (number, input): (usize, &PathBuf),
    (collection, cube): (&Collection, Cube),
    work: &Work,
    options: &IndexOptions<'_>,
) -> Result<(Spool, Collected), PyramidError> {
    if let Some(known) = known_spool(work, number) {
        return Ok(known);
    }
    let level = first_level(&collection.header, work.most);
    let path = spool_path(work, number);
    let mut spooler = Spooler::new(&collection.header, cube, level, &path, budget(options))?;
    let mut fault = None;
    let mut take = |batch: &surfelshop_api::CloudView<'_>| {
        spooler.take(batch).map_err(|error| {
            let line = error.to_string();
            fault = Some(error);
            line
        })
    };
    let collected = collection.read((number, input), &options.read, &mut take);
    let collected = match (collected, fault) {
        (_, Some(fault)) => return Err(fault),
        (Err(error), None) if error.is_cancelled() => {
            return Err(PyramidError::Cancelled(work.folder.clone()));
        }
        (collected, None) => collected?,
    };
    let spool = spooler.finish()?;
    spool.seal(&(collected.n_read, collected.n_not_finite, &collected.warnings))?;
    Ok((spool, collected))
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
