//! Ambient occlusion against known answers, and on clouds that are hard.

#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]

mod answers;
mod hard;
mod stage;
