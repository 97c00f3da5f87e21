//! Splats with normal fields and cut edges: their drawing, the renderer `phong-splatting` and the tool
//! `splats`.

mod drawing;
mod light;
mod quality;
mod stage;
