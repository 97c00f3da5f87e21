//! Measures over the pictures: places are clicked, lines and numbers are drawn.
//!
//! `state` holds the places that were clicked so far, `pick` finds what lies under the pointer, `click` adds places,
//! `surveyed` keeps what is measured of surfels, `draw` shows all of it, and `actions` are the commands.
//!
//! Invariants: clicks measure and drags move the camera, as always; a measure is one step of undo; numbers are of places
//! on surfels in f64, and not of depths of a picture (`clicks_measure_between_surfels`).

mod actions;
mod click;
mod draw;
mod options;
mod pick;
mod state;
mod surveyed;

pub(super) use click::over_picture;
pub(super) use draw::show;
pub(super) use options::show as show_options;
pub(super) use pick::place_of;
pub(crate) use state::{Measuring, hint, icon};
pub(crate) use surveyed::Surveyed;
