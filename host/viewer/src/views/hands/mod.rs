//! Hands on the cloud: surfels are selected in a picture, and tools are led over it.
//!
//! `state` holds what a hand does and what is selected, `actions` changes it, `gesture` follows the pointer, `place` finds what lies under
//! it, `select` and `stroke` do what a gesture means, `handles` selects by a box or a plane, `pairs` clicks places for a tool, `take_color` gives it the colour of what is there, `edits` does something with what is selected, `hide` hides it, `layers` does the same over pyramids, and `options` and
//! `cursor` show it.
//!
//! Invariants: a gesture changes nothing in settings; a stroke is one step of undo; what fails leaves the cloud as it
//! was before the gesture.

mod actions;
mod cursor;
mod edits;
mod gesture;
mod handles;
mod hide;
mod layers;
mod options;
mod pairs;
mod place;
mod select;
mod state;
mod stroke;
mod stroke_layers;
mod stroke_run;
mod take_color;

pub(crate) use edits::{status, unused};
pub(super) use gesture::over_picture;
pub(super) use handles::{click_plane, show as show_handles};
pub(crate) use options::show as show_options;
pub(crate) use pairs::can_be_picked;
pub(super) use pairs::{figures as pair_figures, over_picture as click_pairs};
pub(crate) use state::{HandMode, Hands, hint};
