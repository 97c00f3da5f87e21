//! Pairs of places for a parameter of a tool: clicked on the cloud, and on another one or in a picture.
//!
//! `state` holds the pair that is begun, `actions` begins with pairs and keeps them, `text` reads and writes what the parameter holds, `click` adds places, `picture` is the
//! picture that places are of, `options` shows it and all pairs, `figures` are their dots on the surface.
//!
//! Invariants: the parameter's text is all that is kept of pairs; drags move the camera, as always.

mod actions;
mod click;
mod figures;
mod options;
mod picture;
mod state;
mod text;

pub(crate) use actions::can_be_picked;
pub(in crate::views) use click::over_picture;
pub(in crate::views) use figures::figures;
pub(super) use options::show as show_options;
pub(crate) use state::Pairing;
