//! What the desktop sees of the window: its title, and its place on the screen.

pub(crate) mod screen;
pub(crate) mod title;
