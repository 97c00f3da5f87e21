//! Writes clouds as lines of text.

mod columns;
mod lines;
mod words;

pub(crate) use columns::write_table;
pub(crate) use lines::{FixedFormat, write_fixed};
