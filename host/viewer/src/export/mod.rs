//! Pictures written to files: the view at any size, a turn around the object, or a path of cameras.
//!
//! The render thread draws them one after another, and another thread encodes and writes them, so that
//! the window never waits.

mod form;
mod job;
mod plan;
mod run;
pub(crate) mod window;

pub(crate) use form::ExportForm;
pub(crate) use job::ExportJob;
pub(crate) use run::{advance, take_reply};
