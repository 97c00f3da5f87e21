//! The frame graph: what it compiles, counts, refuses, and which devices run it.

mod cameras;
mod counters;
mod device;
mod needs;
mod opengl;
mod primitives;
mod refused;
mod resident;
mod sandboxed;
mod uniform_members;
