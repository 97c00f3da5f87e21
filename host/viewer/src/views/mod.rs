//! The views in the middle of the window.
//!
//! `state` holds them, `requests` sends what they lack to the render thread, and `events` takes in its
//! replies. `canvas` shows the panes and moves cameras, `paint` draws their pictures, and
//! `light_handles` draws draggable lights over them. `hands` selects surfels and leads tools, and `measuring` measures by
//! clicks.

pub(crate) mod arrangement;
mod camera_mode;
pub(crate) mod canvas;
mod compare;
mod events;
pub(crate) mod hands;
pub(crate) mod layout;
mod legend;
mod light_handles;
pub(crate) mod measuring;
pub(crate) mod messages;
pub(crate) mod navigation;
mod paint;
pub(crate) mod pane;
pub(crate) mod picking;
mod render_state;
mod requests;
mod state;
mod timings;

pub(crate) use camera_mode::CameraMode;
#[cfg(test)]
pub(crate) use canvas::surfel::{describe as describe_surfel, nearest_of as nearest_surfel};
pub(crate) use paint::caption;
pub(crate) use render_state::Render;
pub(crate) use state::{Views, camera_in, initial_camera};
