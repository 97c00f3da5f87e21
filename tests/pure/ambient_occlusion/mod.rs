//! Ambient occlusion against known answers, and on clouds that are hard.

mod answers;
mod hard;
mod open;
mod stage;
