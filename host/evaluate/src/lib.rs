//! Evidence: how far renderers and tools are from the truth, how long they take, and what they do.
//!
//! [`compare`] puts renderers side by side, [`report`] turns their knobs, [`mod@bench`] measures speed,
//! [`explain`] says what a frame is made of and [`check`] runs the cases of [`conformance`]. They
//! write tables, plots and self-contained pages.
//!
//! Invariants: measured programs take turns, so that what the machine does besides meets all alike;
//! error of a method and error of its numbers are kept apart; every error of this crate is one line
//! for the user: which file or plugin, what was expected, what was found, what to do.

#![allow(
    clippy::missing_errors_doc,
    reason = "errors are lines for the user, as the crate's documentation says"
)]

pub mod bench;
pub mod chart;
pub mod check;
pub mod compare;
pub mod comparison_page;
pub mod conformance;
mod csv;
pub mod demo;
pub mod explain;
pub mod merge;
pub mod report;
pub mod share;
