//! The panels around the views, and the windows over them.
//!
//! `side` stacks the panels at the left; `windows` shows the windows that commands open.

mod about;
mod background;
mod breakdown;
mod camera;
mod clouds;
mod colors;
mod environment_map;
mod lights;
mod manual;
pub(crate) mod parameters;
mod passes;
mod picture;
mod renderer;
mod row;
pub(crate) mod side;
mod state;
pub(crate) mod status;
pub(crate) mod windows;

pub(crate) use state::Panels;
