//! Plugins in the window: their list and trust, crashes, and tools.

pub(crate) mod crash;
pub(crate) mod plugin_list;
mod previews;
mod state;
pub(crate) mod tool_window;
mod tools;
pub(crate) mod trust;
mod unit_loader;

pub(crate) use state::Plugins;
pub(crate) use tool_window::title_and_summary;
pub(crate) use unit_loader::{Readiness, UnitLoader, mark_in_use};
