//! Tests through `Format`, with files in memory.

mod clouds;
mod damaged;
mod files;
mod links;
mod normals;
mod placing;
mod reading;
mod trees;
mod writing;
