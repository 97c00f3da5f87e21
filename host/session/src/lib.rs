//! What commands and the window share: options, the clouds and scenes that are opened, the device,
//! the renderer with its parameters, and what is written and said.
//!
//! Invariants: what is typed counts before what a scene says, and that before the usual; every error
//! of this crate is one line for the user: which file or plugin, what was expected, what was found,
//! what to do; what is written appears whole or not at all.

#![allow(
    clippy::missing_errors_doc,
    reason = "errors are lines for the user, as the crate's documentation says"
)]

pub mod antialias;
pub mod captured_graph;
pub mod cloud_renderers;
pub mod cpu_time;
pub mod eye_dome;
pub mod input;
pub mod interrupt;
pub mod manual;
pub mod options;
pub mod output;
pub mod parameters;
pub mod plugin_facts;
pub mod render;
pub mod session;
pub mod setup;
pub mod timing;
pub mod tool_run;
pub mod trust_file;
