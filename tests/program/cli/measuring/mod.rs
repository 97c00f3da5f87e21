//! Commands that measure.

mod bench;
mod check;
mod compare;
mod explain;
mod own_cases;
mod own_renderers;
mod papers;
mod report;
