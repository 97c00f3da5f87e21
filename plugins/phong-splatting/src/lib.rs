//! # Phong splatting: few large splats with normals that vary over them
//!
//! | unit              | kind     | what it does                                                         |
//! |-------------------|----------|----------------------------------------------------------------------|
//! | `phong-splatting` | renderer | draws splats with their normal fields, and as other techniques would  |
//! | `splats`          | tool     | stands few ellipses in for many samples, within a tolerance          |
//!
//! Each unit's folder, `renderer` and `tool`, opens with its parameters, method, limits and sources.
//!
//! Source: Botsch, Spornat & Kobbelt 2004, "Phong Splatting".

mod renderer;
#[cfg(test)]
mod tests;
mod tool;

use surfelshop_api::export_plugin;

export_plugin! {
    id: "org.surfelshop.phong-splatting",
    renderers: [renderer::PhongSplatting],
    tools: [tool::Splats],
}
