//! # Pointshop: nine tools that edit clouds
//!
//! | tool         | what it does                                                        |
//! |--------------|---------------------------------------------------------------------|
//! | `smooth`     | filters positions and normals: smooths, or makes sharper             |
//! | `boolean`    | joins, intersects or subtracts two closed clouds                     |
//! | `register`   | moves a cloud onto another one of the same thing                     |
//! | `fill-holes` | closes holes with smooth patches of surfels                          |
//! | `transform`  | moves, turns, scales and mirrors                                     |
//! | `deform`     | bends by a lattice of control points                                 |
//! | `texture`    | lays a picture on the surface by pairs of places                     |
//! | `image-brush` | paints a picture along a stroke                                     |
//! | `emboss`     | moves surfels out by a picture along a stroke                        |
//!
//! Each tool's file opens with its parameters, method, limits and sources. Tools with a second cloud read
//! it from a PLY file, by `ply`.
//!
//! All of them: the same result on any number of threads; sums in f64; a cloud without surfels is
//! refused in a line; stopped, they leave the cloud as it was.
//!
//! ```text
//! surfelshop bake scan.ply -t smooth -o smooth.ply
//! surfelshop bake block.ply -t boolean --set with=drill.ply --set operation=difference -o part.ply
//! ```

mod boolean;
mod columns;
mod deform;
mod holes;
mod linear;
mod ply;
mod register;
mod search;
mod smooth;
mod sphere_fit;
mod stamp;
mod surfels;
#[cfg(test)]
mod tests;
mod texture;
mod transform;
mod typed;

use surfelshop_api::export_plugin;

export_plugin! {
    id: "org.surfelshop.pointshop",
    tools: [smooth::Smooth, boolean::Boolean, register::Register, holes::FillHoles, transform::Transform, deform::Deform, texture::Texture, stamp::ImageBrush, stamp::Emboss],
}
