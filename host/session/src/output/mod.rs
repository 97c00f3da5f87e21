//! What is written and said: files that appear whole, lines, and JSON.

pub mod command_line;
pub mod digest;
pub mod files;
pub mod json;
pub mod legend;
pub mod machine;
pub mod measures;
pub mod overlay;
pub mod part_file;
pub mod provenance;
pub mod terminal;
