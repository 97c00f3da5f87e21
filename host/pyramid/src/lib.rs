//! Pyramids: clouds larger than memory, in one `.surfels` file.
//!
//! A pyramid is a tree of nodes. Leaves have the surfels of the source with all their columns; each inner node has
//! merged surfels that stand for those of its children, by the rule that the rasteriser merges by, so that a view from
//! afar is filtered and not thinned. [`index()`] makes one of files of any size in bounded memory; [`Pyramid`] opens one
//! and reads its nodes; [`Cut`] chooses those that a view is drawn from. The layout of the file is described byte by
//! byte in the manual, page `pyramids`, and in `layout.rs`.
//!
//! Invariants: this crate knows no graphics API; what a view is drawn from follows from the view and the detail alone;
//! nothing of a file is trusted: sizes, checksums and values are checked before they are used.

mod codec;
mod cut;
mod error;
mod in_place;
mod index;
mod layout;
mod nodes;
mod occlusion;
mod pyramid;
mod remake;
mod selected;
#[cfg(test)]
mod tests;

pub use cut::{Cut, CutView};
pub use error::PyramidError;
pub use in_place::NodeReader;
pub use index::nodes::Rule;
pub use index::shared::{IndexShare, IndexStep, ShareSummary, index_share};
pub use index::{IndexOptions, IndexSummary, index};
pub use layout::{Directory, NodeRecord, StoredSource, is_pyramid, is_pyramid_file};
pub use nodes::{NodeLook, Nodes, NodesInMemory};
pub use occlusion::{DepthGrid, ShownNode};
pub use pyramid::Pyramid;
pub use remake::{Change, LeafChange, RemakeOptions, RemakeSummary, remake, remake_leaves};
