//! Tests of pictures: what is drawn, in every way to draw, and what it costs in passes and uploads.

#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]
#![allow(clippy::print_stdout, reason = "figures are part of what tests say")]

mod ablation;
mod antialias;
mod environment;
mod eye_dome;
mod gaussians;
mod gi;
mod graph;
mod lights;
mod occlusion;
mod precision;
mod procedural;
mod splats;
mod surfels;
mod tools;
