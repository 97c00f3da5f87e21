//! Surfel drawing: what is covered, filtered, blended and merged, in every way to draw.

mod degenerate;
mod detail;
mod drawing;
mod ewa;
mod extremes;
mod painting;
mod preview;
mod pyramids;
mod scale;
mod stopping;
mod strategies;
