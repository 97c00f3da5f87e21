//! The file `hierarchy.bin`: the nodes of the octree, chunk by chunk.
//!
//! A chunk holds nodes level by level, from one that is its root down; of each, which of its eight cells have
//! nodes, too, and where in `octree.bin` its points are. A node that stands for another chunk says instead where
//! that one is, whose root it is.

use crate::metadata::INSTEAD;
use std::collections::VecDeque;
use surfelshop_api::format::{FileSource, PointNode};
use surfelshop_api::{Error, Result};

/// The file's name.
pub(crate) const NAME: &str = "hierarchy.bin";
/// Bytes of a node.
const NODE: u64 = 22;
/// Most halvings of the root's cube.
const DEEPEST: u32 = 30;
/// What stands for another chunk.
const PROXY: u8 = 2;

/// Which cell a node has.
#[derive(Clone, Copy, Default)]
struct Place {
    level: u32,
    cell: [u32; 3],
}

impl Place {
    /// An eighth of it: bit 2 of its number is x, bit 1 y, bit 0 z.
    fn child(self, eighth: u8) -> Self {
        let bits = [eighth >> 2, eighth >> 1, eighth].map(|bit| u32::from(bit & 1));
        let [x, y, z] = self.cell;
        let cell = [2 * x + bits[0], 2 * y + bits[1], 2 * z + bits[2]];
        Self { level: self.level + 1, cell }
    }
}

/// What is said of a chunk that has fewer nodes than it names.
fn ends_too_early(Place { level, cell }: Place) -> Error {
    Error::new(format!(
        "{NAME}: expected the nodes about level {level}, cell {cell:?} in their chunk, found the chunk's end; {INSTEAD}"
    ))
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    bytes.get(at..at + 8).and_then(|b| b.try_into().ok()).map_or(0, u64::from_le_bytes)
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map_or(0, u32::from_le_bytes)
}

/// All nodes with points, whose bytes lie in a file of `octree_length`; the first chunk has so many bytes.
///
/// # Errors
/// Where a chunk or a node is damaged, or the system refuses.
pub(crate) fn nodes(
    file: &FileSource,
    first_chunk: u64,
    octree_length: u64,
) -> Result<Vec<PointNode>> {
    let mut nodes: Vec<PointNode> = Vec::new();
    let mut chunks = vec![(0u64, first_chunk, Place::default())];
    // Chunks share no bytes, so all of them are no longer than the file.
    let mut left = file.length();
    while let Some((at, len, root)) = chunks.pop() {
        let is_within = at.checked_add(len).is_some_and(|end| end <= file.length());
        if len == 0 || len % NODE != 0 || !is_within || len > left {
            return Err(Error::new(format!(
                "{NAME}: expected a chunk of whole nodes in the file of {} bytes, found {len} bytes at {at}; {INSTEAD}",
                file.length()
            )));
        }
        left -= len;
        let chunk = file.bytes_at(at, len)?;
        let mut places = VecDeque::from([root]);
        let n_nodes = (len / NODE) as usize;
        for (i, node) in chunk.chunks_exact(NODE as usize).enumerate() {
            let (kind, mask, points) = (node[0], node[1], u32_at(node, 2));
            let (at, len) = (u64_at(node, 6), u64_at(node, 14));
            let Some(place) = places.pop_front() else {
                return Err(Error::new(format!(
                    "{NAME}: expected a chunk as long as the nodes that it names, found more; {INSTEAD}"
                )));
            };
            // Each is one of those that are left in the chunk.
            if places.len() >= n_nodes - i {
                return Err(ends_too_early(place));
            }
            if kind == PROXY {
                chunks.try_reserve(1)?;
                chunks.push((at, len, place));
                continue;
            }
            let is_within = at.checked_add(len).is_some_and(|end| end <= octree_length);
            let is_too_deep = place.level >= DEEPEST && mask != 0;
            if is_too_deep || (points > 0 && !is_within) {
                let Place { level, cell } = place;
                return Err(Error::new(format!(
                    "{NAME}: expected nodes of at most {DEEPEST} halvings with points in the octree of {octree_length} \
                     bytes, found level {level}, cell {cell:?}, {points} points in {len} bytes at {at}; {INSTEAD}"
                )));
            }
            places.extend(
                (0..8).filter(|bit| mask >> bit & 1 == 1).map(|eighth| place.child(eighth)),
            );
            if points > 0 {
                nodes.try_reserve(1)?;
                let Place { level, cell } = place;
                nodes.push(PointNode { level, cell, points: points.into(), place: [at, len] });
            }
        }
        if let Some(place) = places.pop_front() {
            return Err(ends_too_early(place));
        }
    }
    Ok(nodes)
}
