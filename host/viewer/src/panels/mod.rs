//! The panels around the views, and the windows over them.
//!
//! `outliner` lists what the scene consists of, and `properties` shows those of what is selected there; `actions` is
//! what commands do with it. `sides` arranges the panels, and `windows` shows the windows that commands open.

mod about;
mod actions;
mod manual;
mod outliner;
pub(crate) mod parameters;
mod properties;
pub(crate) mod row;
mod selected;
mod selection;
pub(crate) mod sides;
mod state;
pub(crate) mod status;
pub(crate) mod windows;

pub(crate) use outliner::Dragged;
pub(crate) use properties::color_choices;
pub(crate) use selection::Selection;
pub(crate) use state::Panels;
