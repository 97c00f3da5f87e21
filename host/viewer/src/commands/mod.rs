//! The commands of the window: each is described once, and menus, toolbar, palette, keys and the list of
//! shortcuts are made from that.
//!
//! `table` lists them. `keymap` holds the shortcuts, with the user's own; `keys` runs what is pressed.

mod button;
mod command;
mod help;
mod keymap;
pub(crate) mod keys;
pub(crate) mod menus;
mod palette;
mod search;
mod shortcut;
mod table;
pub(crate) mod toolbar;

pub(crate) use button::item;
pub(crate) use command::{Command, run};
pub(crate) use help::{HelpWindow, show as show_help};
pub(crate) use keymap::Keymap;
#[cfg(test)]
pub(crate) use palette::entries as palette_entries;
pub(crate) use palette::{Palette, show as show_palette};
pub(crate) use table::{COMMANDS, find};
