//! Measurements in the window: the pictures of a view against a reference, and a renderer's error
//! against its time for several values of a parameter.
//!
//! `form` holds what is chosen, `choices` and `planning` derive a `plan` from it. `run` takes one step
//! of a `measurement` after the other: a picture by the render thread, or a `background` job. `panel`
//! shows the results, with a `table` and a `plot`.
//!
//! Invariants: no step blocks the window; pictures of views go before measured ones; the numbers are
//! those of `compare` and `report`; a measurement that has ended holds nothing but its numbers and, for
//! the next one, the reference.

mod background;
mod card;
mod choices;
mod fields;
mod form;
mod measurement;
pub(crate) mod panel;
mod pictures;
mod plan;
mod planning;
mod plot;
mod reference;
mod run;
mod state;
mod table;
mod words;

#[cfg(test)]
pub(crate) use form::ReferenceChoice;
#[cfg(test)]
pub(crate) use measurement::{Measurement, Status};
pub(crate) use panel::copy_numbers;
#[cfg(test)]
pub(crate) use plan::Kind;
pub(crate) use run::{advance, take_reply};
pub(crate) use state::Measure;
