//! What is written and said: files that appear whole, lines, and JSON.

pub mod command_line;
pub mod files;
pub mod json;
pub mod legend;
pub mod measures;
pub mod overlay;
pub mod provenance;
pub mod terminal;
