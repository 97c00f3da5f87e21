//! Commands that measure.

mod bench;
mod check;
mod compare;
mod explain;
mod jobs;
mod own_cases;
mod own_renderers;
mod papers;
mod parts;
mod python;
mod report;
mod share;
