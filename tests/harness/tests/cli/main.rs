//! The program as a user runs it: what it prints, what it writes and how it ends.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod bake;
mod bench;
mod check;
mod compare;
mod environments;
mod explain;
mod faulty;
mod graphs;
mod interrupted;
mod lights;
mod links;
mod listing;
mod machines;
mod memory;
mod messages;
mod mutations;
mod outputs;
mod pictures;
mod plugins;
mod program;
mod report;
mod scenes;
