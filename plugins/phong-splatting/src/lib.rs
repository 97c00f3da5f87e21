//! # Phong splatting: few elliptical splats whose normals vary linearly
//!
//! | unit     | kind | what it does                                                         |
//! |----------|------|----------------------------------------------------------------------|
//! | `splats` | tool | stands few ellipses in for many samples, within a tolerance          |
//!
//! The tool's file opens with its parameters, method, limits and sources.

mod choice;
mod cover;
mod creases;
mod edges;
mod ellipse;
mod exchange;
mod field;
mod finish;
mod graph;
mod output;
mod plane;
mod regions;
mod samples;
mod splats;
#[cfg(test)]
mod tests;

use surfelshop_api::export_plugin;

export_plugin! {
    id: "org.surfelshop.phong-splatting",
    tools: [splats::Splats],
}
