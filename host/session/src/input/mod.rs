//! What is opened: clouds, scenes, environment maps, the sample.

pub mod bare_land;
pub mod budget;
pub mod clouds;
pub mod displayed;
pub mod drawn;
pub mod environment_map;
pub mod formats;
pub mod inside;
pub mod layers;
pub mod led_tools;
pub mod plausibility;
pub mod probe_info;
mod pyramid_cut;
pub mod pyramids;
pub mod sample;
pub mod scenes;
pub mod strokes;
mod tinted_nodes;
