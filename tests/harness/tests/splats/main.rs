//! Splats with normal fields and cut edges: their drawing, the renderer `phong-splatting` and the tool
//! `splats`.

#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]
#![allow(clippy::print_stdout, reason = "the tables are what the tests measure")]

mod drawing;
mod light;
mod quality;
mod stage;
