//! What graphs have of their own besides passes: cameras, the scene's surfels as data, buffers that are
//! kept from frame to frame, and how much is drawn.

#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]

mod bench;
mod cameras;
mod counted;
mod history;
mod refused;
mod strided;
mod surfels;
