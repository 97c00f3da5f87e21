//! Reads bodies of lines in blocks on all threads, and hands the columns over in order.

mod block;
mod hand_over;
mod line;
mod number;
mod unreadable;

pub(crate) use block::{Mark, NoReturn, Options};
pub(crate) use hand_over::{Body, Taken};
pub(crate) use unreadable::Unreadable;
