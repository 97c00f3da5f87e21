//! What graphs have of their own besides passes: cameras, the scene's surfels as data, buffers that are
//! kept from frame to frame, and how much is drawn.

mod bench;
mod counted;
mod history;
mod own;
mod refused;
mod strided;
mod surfels;
