//! Tests of the program as its users run it: the command line, the window, and plugins of third parties.

#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]
#![allow(clippy::print_stdout, reason = "figures are part of what tests say")]

mod cli;
mod session;
mod third_party;
mod window;
