//! Geometry of point clouds: bounds, neighbours, normals, radii and areas, discs to trace rays at,
//! outliers and even subsets; of triangle meshes; and light on the sphere in spherical harmonics.
//!
//! Everything works on a slice of positions in any unit and at any scale: distances are computed
//! in f64 in a box of unit size, so that neither 1e-20 nor 1e28 underflows or overflows. Positions
//! that are not finite are nobody's neighbour and get a stated fallback; no input panics.
//!
//! Invariants: this crate knows no file, no graphics API and no user interface; its results do
//! not depend on the number of threads (`results_do_not_depend_on_the_number_of_threads`).

pub mod areas;
pub mod bounds;
mod cell;
pub mod discs;
pub mod eigen;
mod grid;
pub mod harmonics;
pub mod hashing;
pub mod mesh;
mod neighbours;
pub mod normals;
pub mod octree;
pub mod outliers;
mod progress;
pub mod radii;
#[cfg(test)]
mod samples;
pub mod spread;
pub mod thinning;
mod visibility;

pub use bounds::Bounds;
pub use neighbours::{Neighbour, Neighbours};
pub use progress::{Cancelled, Progress, part, silent};
pub use visibility::{free_space, sides};
