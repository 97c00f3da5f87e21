//! Commands that measure.

mod bench;
mod check;
mod compare;
mod explain;
mod report;
