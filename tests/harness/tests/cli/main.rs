//! The program as a user runs it: what it prints, what it writes and how it ends.

mod listing;
mod machines;
mod messages;
mod pictures;
mod program;
