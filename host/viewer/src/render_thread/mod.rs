//! The thread that draws pictures, and the messages between it and the window.
//!
//! The window sends commands and view requests through a queue and receives events; neither side waits
//! for the other. The thread owns a graphics device apart from the window's: a slow frame or a lost
//! device does not stop the window.

mod abandoned;
mod cloud_upload;
mod command;
mod event;
mod level_of_detail;
mod rendered_view;
mod thread;
mod view_request;
mod worker;

pub(crate) use abandoned::{any_abandoned, mark_abandoned};
#[cfg(test)]
pub(crate) use command::CommandQueue;
pub(crate) use command::RenderCommand;
pub(crate) use event::{RenderEvent, UnitHealth};
pub(crate) use level_of_detail::{Detail, Governor};
#[cfg(test)]
pub(crate) use rendered_view::TracedState;
pub(crate) use rendered_view::{RenderedView, ViewReply};
pub(crate) use thread::RenderThread;
pub(crate) use view_request::{EXPORT_SLOT, MEASURE_PANE, ViewRequest, ViewSlot};
