//! The octree of a COPC file: its nodes, each a chunk of compressed points.
//!
//! Source: "COPC Specification 1.0", 2021, sections "info VLR" and "hierarchy VLR".

use crate::compressed::{self, Chunk, Chunks, Compression, PLAUSIBLE};
use crate::layout::Layout;
use crate::numbers::{f64_at, u32_at, u64_at};
use crate::points::Points;
use surfelshop_api::format::{CloudSink, FileSource, PointNode, PointTree};
use surfelshop_api::glam::DVec3;
use surfelshop_api::{Error, Job, Result};

/// Bytes of the record that says where the octree is.
const INFO: usize = 160;
/// Bytes of an entry of a page.
const ENTRY: u64 = 32;
/// Most halvings of the root's cube.
const DEEPEST: u32 = 30;

/// What to do about a damaged hierarchy.
const INSTEAD: &str = "read the file as a whole (without --in-place), or write it again";

/// The octree; its nodes only where they are wanted, which must have so many points together.
///
/// # Errors
/// Where the record or a page is damaged, or the system refuses.
pub(crate) fn tree(
    file: &FileSource,
    info: &[u8],
    with_nodes: bool,
    n_points: u64,
) -> Result<PointTree> {
    if info.len() < INFO {
        let found = info.len();
        return Err(Error::new(format!("expected a COPC record of {INFO} bytes, found {found}")));
    }
    let [x, y, z, half, spacing] = [0, 8, 16, 24, 32].map(|at| f64_at(info, at));
    let centre = DVec3::new(x, y, z);
    let is_length = |x: f64| x.is_finite() && x > 0.0;
    if !centre.is_finite() || !is_length(half) || !is_length(spacing) {
        return Err(Error::new(format!(
            "expected a COPC cube with a centre, a half side and a spacing above 0, found {centre}, {half} and \
             {spacing}; {INSTEAD}"
        )));
    }
    let (low, side) = (centre - half, 2.0 * half);
    let nodes = match with_nodes {
        true => nodes(file, (u64_at(info, 40), u64_at(info, 48)))?,
        false => Vec::new(),
    };
    let found: u64 = nodes.iter().map(|node| node.points).sum();
    if with_nodes && found != n_points {
        return Err(Error::new(format!(
            "expected a COPC hierarchy of {n_points} points, found one of {found}; {INSTEAD}"
        )));
    }
    Ok(PointTree { low, side, spacing, nodes })
}

/// The nodes of all pages, from the first on.
fn nodes(file: &FileSource, first: (u64, u64)) -> Result<Vec<PointNode>> {
    let mut nodes: Vec<PointNode> = Vec::new();
    let mut pages = vec![first];
    // Pages share no bytes, so all of them are no longer than the file.
    let mut left = file.length();
    while let Some((at, len)) = pages.pop() {
        let is_within = at.checked_add(len).is_some_and(|end| end <= file.length());
        if len % ENTRY != 0 || !is_within || len > left {
            return Err(Error::new(format!(
                "expected a page of the COPC hierarchy of whole entries in the file, found {len} bytes at {at}; {INSTEAD}"
            )));
        }
        left -= len;
        let page = file.bytes_at(at, len)?;
        for entry in page.chunks_exact(ENTRY as usize) {
            let signed = |at: usize| u32_at(entry, at).cast_signed();
            let key = [0, 4, 8, 12].map(|at| u32_at(entry, at));
            let ([level, cell @ ..], place) = (key, u64_at(entry, 16));
            let (size, points) = (signed(24), signed(28));
            if points == -1 {
                pages.push((place, u64::from(size.unsigned_abs())));
                continue;
            }
            let is_cell =
                level <= DEEPEST && cell.iter().all(|&at| u64::from(at) < 1 << level.min(DEEPEST));
            let is_within = size >= 0
                && place
                    .checked_add(u64::from(size.unsigned_abs()))
                    .is_some_and(|end| end <= file.length());
            if !is_cell || points < 0 || (points > 0 && !is_within) {
                return Err(Error::new(format!(
                    "expected nodes of the COPC hierarchy with points in the file, found level {level}, cell {cell:?}, \
                     {points} points in {size} bytes at {place}; {INSTEAD}"
                )));
            }
            nodes.try_reserve(1)?;
            let (points, size) = (u64::from(points.unsigned_abs()), u64::from(size.unsigned_abs()));
            nodes.push(PointNode { level, cell, points, place: [place, size] });
        }
    }
    Ok(nodes)
}

/// Hands over the points of nodes.
///
/// # Errors
/// Where a node does not lie in the file, the host or the system refuses, or the user asked to stop.
pub(crate) fn read(
    file: &FileSource,
    compression: &Compression,
    nodes: &[PointNode],
    (layout, clouds, job): (&Layout, &mut CloudSink<'_>, &Job<'_>),
) -> Result<()> {
    let all = nodes.iter().map(|node| node.points).sum();
    let (n_read, fault) = Default::default();
    let mut points = Points { layout, clouds, job, expected: all, n_read, fault };
    for node in nodes {
        let [at, len] = node.place;
        let is_within = at.checked_add(len).is_some_and(|end| end <= file.length());
        if !is_within || node.points > len.saturating_mul(PLAUSIBLE) {
            return Err(Error::new(format!(
                "expected a node of {} points in the file, found {len} bytes at {at}; {INSTEAD}",
                node.points
            )));
        }
        if node.points > 0 {
            let chunks = vec![Chunk { at, len, points: node.points }];
            let chunks = Chunks::Known { chunks, points: Some(node.points) };
            compressed::read(file, compression, &chunks, &mut points)?;
        }
    }
    points.finish(Some(all))
}
