//! Commands that are ended, starved, misled, or given hostile plugins and files.

pub(crate) mod faulty;
mod formats;
mod interrupted;
mod links;
mod memory;
mod mutations;
pub(crate) mod outputs;
