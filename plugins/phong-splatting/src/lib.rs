//! # Phong splatting: few large splats with normals that vary over them
//!
//! | unit              | kind     | what it does                                                         |
//! |-------------------|----------|----------------------------------------------------------------------|
//! | `phong-splatting` | renderer | draws splats with their normal fields, and as other techniques would  |
//! | `splats`          | tool     | stands few ellipses in for many samples, within a tolerance          |
//!
//! Each unit's file opens with its parameters, method, limits and sources.
//!
//! Source: Botsch, Spornat & Kobbelt 2004, "Phong Splatting".

mod choice;
mod colors;
mod cover;
mod creases;
mod edges;
mod ellipse;
mod exchange;
mod field;
mod finish;
mod graph;
mod output;
mod overhang;
mod plane;
mod regions;
mod renderer;
mod samples;
mod splats;
#[cfg(test)]
mod tests;

use surfelshop_api::export_plugin;

export_plugin! {
    id: "org.surfelshop.phong-splatting",
    renderers: [renderer::PhongSplatting],
    tools: [splats::Splats],
}
