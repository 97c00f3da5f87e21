//! The panels around the views, the menus, and the keyboard shortcuts.
//!
//! `side` stacks the panels at the left; `windows` shows the windows that menus open.

mod actions;
mod breakdown;
mod camera;
mod clouds;
mod colors;
mod environment_map;
mod lights;
mod manual;
pub(crate) mod menus;
pub(crate) mod parameters;
mod passes;
mod picture;
mod renderer;
pub(crate) mod shortcuts;
pub(crate) mod side;
mod state;
pub(crate) mod status;
pub(crate) mod windows;

pub(crate) use state::Panels;
