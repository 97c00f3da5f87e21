//! The plugin `procedural`: its noise and patterns against twins in f64, what filtering leaves,
//! extremes, and how it behaves.

#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]

mod agreement;
mod conduct;
mod extremes;
mod filter;
mod light;
mod statistics;
