//! # Preparation: five tools that make a cloud ready
//!
//! | tool       | what it does                                                     |
//! |------------|------------------------------------------------------------------|
//! | `normals`  | estimates normals and turns them outwards or towards a place     |
//! | `radii`    | estimates radii at which discs cover the surface                  |
//! | `outliers` | removes points that do not belong                                |
//! | `thin`     | keeps fewer surfels, evenly, that still cover the surface         |
//! | `sample`   | makes surfels on the triangles of a mesh                          |
//!
//! Each tool's file opens with its parameters, method, limits and sources. The methods themselves
//! are functions of `surfelshop-geometry`; a tool reads columns, tells how far it is and stages
//! what comes of it.
//!
//! All of them: the same result on any number of threads, and for the same seed; a cloud without
//! surfels is refused in a line; stopped, they leave the cloud as it was.
//!
//! ```text
//! surfelshop bake scan.ply -t outliers -o clean.ply
//! surfelshop bake bunny.ply -t sample --set count=100000 -o surfels.ply
//! ```

mod blend;
mod normals;
mod outliers;
mod radii;
mod sample;
mod surfels;
#[cfg(test)]
mod tests;
mod thin;

use surfelshop_api::export_plugin;

export_plugin! {
    id: "org.surfelshop.preparation",
    tools: [normals::Normals, radii::Radii, outliers::Outliers, thin::Thin, sample::Sample],
}
