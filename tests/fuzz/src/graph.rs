//! Graphs: the file that one is captured in, its structure, and all that is checked, compiled and
//! recorded of it.

use crate::device::draw;
use surfelshop_api::abi::EncodedGraph;

/// Takes a captured graph, or else the bytes as the structure of one without data.
pub fn graph(bytes: &[u8]) {
    let structure_alone = || EncodedGraph { structure: bytes.to_vec(), data: Vec::new() };
    draw(&EncodedGraph::from_file(bytes).unwrap_or_else(|_| structure_alone()));
}
