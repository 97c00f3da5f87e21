//! The renderer `global-illumination`: light that bounces, against what is known of it in closed form,
//! and in scenes that have nothing of it.

#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]
#![allow(clippy::print_stdout, reason = "the tables are what the tests measure")]

mod bench;
mod furnace;
mod motion;
mod nothing;
mod room;
mod still;
