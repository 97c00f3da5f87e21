//! # Pointshop: tools that edit clouds
//!
//! | tool         | what it does                                                       |
//! |--------------|--------------------------------------------------------------------|
//! | `smooth`     | filters positions and normals: smooths, or makes sharper            |
//!
//! Each tool's file opens with its parameters, method, limits and sources.
//!
//! All of them: the same result on any number of threads; sums in f64; a cloud without surfels is
//! refused in a line; stopped, they leave the cloud as it was.
//!
//! ```text
//! surfelshop bake scan.ply -t smooth -o smooth.ply
//! ```

mod boolean;
mod columns;
mod deform;
mod icp;
mod lattice;
mod linear;
mod ply;
mod register;
mod seam;
mod search;
mod smooth;
mod sphere_fit;
mod surfels;
#[cfg(test)]
mod tests;
mod transform;
mod winding;

use surfelshop_api::export_plugin;

export_plugin! {
    id: "org.surfelshop.pointshop",
    tools: [smooth::Smooth, boolean::Boolean, register::Register, transform::Transform, deform::Deform],
}
