//! What is open: clouds, scene and settings, with their history and files.
//!
//! `settings` and `open_clouds` are what undo covers. `open` reads files, `save` writes them, and
//! `recovery` keeps unsaved edits on disk for the case of a crash.

mod cloud_writer;
mod display;
mod environment_map;
pub(crate) mod file_names;
mod history;
mod one_cloud;
mod open;
mod open_clouds;
mod packed_clouds;
mod presets;
pub(crate) mod recovery;
mod save;
mod scene_file;
mod settings;
mod state;
mod state_folder;
pub(crate) mod undo;
pub(crate) mod unsaved_prompt;
mod visible_clouds;

pub(crate) use environment_map::{set_environment_file, set_environment_map};
pub(crate) use history::Snapshot;
pub(crate) use one_cloud::OneCloud;
pub(crate) use open_clouds::{OpenCloud, OpenClouds, generations};
pub(crate) use scene_file::bookmarks::{Bookmark, MOST_BOOKMARKS, PICTURE, Thumbnail};
pub(crate) use settings::{
    Mode, PaneSettings, Settings, USUAL_BACKGROUND, USUAL_RENDERER, has_direction,
};
pub(crate) use state::Document;
pub(crate) use state_folder::StateFolder;
