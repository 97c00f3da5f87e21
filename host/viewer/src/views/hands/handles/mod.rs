//! A box or a plane in the scene that selects what is in it or before it, and is changed by its handles.
//!
//! `shape` is its geometry, `state` what the window keeps of it, `actions` selects by it, `show` draws it and its handles,
//! and `options` has its numbers.

mod actions;
mod options;
mod shape;
mod show;
mod state;

pub(super) use options::show as show_options;
pub(in crate::views) use show::{click_plane, show};
pub(super) use state::Handles;
