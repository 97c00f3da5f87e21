//! The frame graph: what it compiles, counts, refuses, and which devices run it.

mod cameras;
mod counters;
mod device;
mod opengl;
mod refused;
mod uniform_members;
