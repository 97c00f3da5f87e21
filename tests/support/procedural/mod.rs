//! Patterns computed in f64, and the plugin's own through its tool.

mod bench;
pub mod filtered;
pub mod noise;
pub mod patterns;
pub mod places;
pub mod plane;

pub use bench::{Bench, Spot};
