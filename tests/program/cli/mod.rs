//! The program as a user runs it: what it prints, what it writes and how it ends.

mod bake;
mod colors;
mod environments;
mod formats;
mod graphs;
mod hostile;
mod lights;
mod listing;
mod machines;
mod measuring;
mod messages;
mod pictures;
mod plugins;
mod potree;
mod program;
mod pyramid_tools;
mod pyramids;
mod readme;
mod scenes;
