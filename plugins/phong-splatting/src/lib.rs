//! # Phong splatting: few large splats with normals that vary over them
//!
//! | unit              | what it does                                                          |
//! |-------------------|-----------------------------------------------------------------------|
//! | `phong-splatting` | draws splats with their normal fields, and as older techniques would   |
//!
//! Each unit's file opens with its parameters, method, limits and sources.
//!
//! Source: Botsch, Spornat & Kobbelt 2004, "Phong Splatting".

mod renderer;

use surfelshop_api::export_plugin;

export_plugin! {
    id: "org.surfelshop.phong-splatting",
    renderers: [renderer::PhongSplatting],
}
