//! GFF, the container of SFL files: directories of tagged values, linked by offsets to a tree.
//!
//! All numbers are big-endian. A directory is a run of entries of 12 bytes (tag, type, count, value) up to one that
//! links it to its next sibling, its first child, or says that there is no sibling more.

mod build;
mod directory;
pub(crate) mod kind;
pub(crate) mod tags;

pub(crate) use build::{Block, ENTRY_BYTES, HEADER_BYTES, Link, closing, header};
pub(crate) use directory::{Directory, Gff, MAX_CHILDREN, root_offset};
