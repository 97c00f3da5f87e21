//! File formats: each is read into a [`Table`](crate::table::Table), PLY is written too.

mod body;
pub(crate) mod lines;
pub(crate) mod obj;
pub(crate) mod off;
pub(crate) mod ply;

pub(crate) use body::Body;
