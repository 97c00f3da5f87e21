//! File formats: those that are built in are read into a [`Table`](crate::table::Table); those of plugins hand
//! over batches, which become one. PLY is written here, all others by plugins.

pub(crate) mod batches;
pub(crate) mod beside;
mod body;
pub(crate) mod facts;
pub(crate) mod lent_table;
pub(crate) mod lines;
pub(crate) mod obj;
pub(crate) mod off;
pub(crate) mod parts;
pub(crate) mod plugins;
pub(crate) mod ply;
pub(crate) mod positioned;
pub(crate) mod stream;
pub(crate) mod table_sink;
pub(crate) mod unpacked;

pub(crate) use body::Body;
