//! The commands of the window: each is described once, and menus, toolbar, palette, keys and the list of
//! shortcuts are made from that.
//!
//! `table` lists them. `keymap` holds the shortcuts, to which `assign` adds the user's own; `keys` runs what is pressed.

mod assign;
mod button;
mod command;
mod help;
mod keymap;
pub(crate) mod keys;
pub(crate) mod menus;
mod palette;
mod palette_state;
mod search;
mod shortcut;
mod table;
pub(crate) mod toolbar;

pub(crate) use assign::check_shortcut;
pub(crate) use button::icon_button;
pub(crate) use command::{Command, run, shortcuts, why_not};
pub(crate) use help::show as show_help;
pub(crate) use keymap::Keymap;
#[cfg(test)]
pub(crate) use palette::entries as palette_entries;
#[cfg(test)]
pub(crate) use palette::name_alone;
pub(crate) use palette::show as show_palette;
pub(crate) use palette_state::Palette;
pub(crate) use shortcut::text as shortcut_text;
pub(crate) use table::{COMMANDS, find};
