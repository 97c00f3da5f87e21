//! The work of the render thread: it owns the engine's device and the renderers in use.
//!
//! No plugin ends the thread: each renderer runs on a thread of its own with a deadline, and one that
//! does not answer or fails three times in a row is switched off. A rebuilt renderer takes over after
//! its first picture, and a lost device is opened again.

mod beside;
mod draw;
mod frames;
mod refine;
mod refining_view;
mod release;
mod reload;
mod run;
mod state;
mod traced;

pub(super) use state::RenderWorker;
