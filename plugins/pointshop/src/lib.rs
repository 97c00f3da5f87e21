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
mod holes;
mod icp;
mod lattice;
mod linear;
mod patch;
mod ply;
mod register;
mod rims;
mod seam;
mod search;
mod smooth;
mod sphere_fit;
mod surfels;
#[cfg(test)]
mod tests;
mod thin_plate;
mod transform;
mod winding;

use surfelshop_api::export_plugin;

export_plugin! {
    id: "org.surfelshop.pointshop",
    tools: [smooth::Smooth, boolean::Boolean, register::Register, holes::FillHoles, transform::Transform, deform::Deform],
}
