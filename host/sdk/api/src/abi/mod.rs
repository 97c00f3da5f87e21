//! The plugin boundary: one C table, outputs written to host sinks, msgpack with named fields.
//!
//! [`table`] declares the C structures, [`plugin_side`] the shims that run inside a plugin (they
//! catch panics, so nothing unwinds across the boundary). The calls a host makes are the host's
//! (`surfelshop-runtime`). All `unsafe` code of a plugin is in this module and in what
//! [`export_plugin!`](crate::export_plugin!) expands to.
//!
//! Lifecycle: the host reads the manifest from the file; loads the library; takes the address of
//! [`table::SYMBOL`]; checks magic, size and versions; asks each unit to describe itself; creates
//! instances; calls them from one thread at a time (tracers from several); destroys them. The
//! library stays loaded until the process ends.
//!
//! The boundary is the same from other languages: `host/sdk/c/surfelshop.h` declares it for C and C++, with
//! a renderer in C beside it. A graph can be kept in a file and drawn without its plugin
//! ([`EncodedGraph::to_file`]).

#![expect(
    unsafe_code,
    reason = "the C boundary itself: raw pointers are turned into checked slices and back here"
)]

mod bytes;
mod description;
mod encoded_graph;
pub mod format_table;
#[cfg(target_family = "wasm")]
mod last_words;
mod needed_minor;
pub mod plugin_format;
mod plugin_job;
pub mod plugin_side;
pub mod table;

pub use encoded_graph::EncodedGraph;
