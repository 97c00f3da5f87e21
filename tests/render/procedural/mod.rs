//! The plugin `procedural`: its noise and patterns against twins in f64, what filtering leaves,
//! extremes, and how it behaves.

mod agreement;
mod behavior;
mod extremes;
mod filter;
mod light;
mod statistics;
