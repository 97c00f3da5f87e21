//! Endings of files that are written: with another one a file could not be opened again.

use std::path::{Path, PathBuf};
use surfelshop_session::input::layers;

/// The path of a scene, with its ending added where it has none.
pub(crate) fn scene_file_name(path: &Path) -> PathBuf {
    match surfelshop_cloud::scene::is_scene(path) {
        true => path.to_owned(),
        false => path.with_added_extension("scene.toml"),
    }
}

/// The path of a cloud, with the ending of PLY added where it has none of PLY or of the formats that are
/// written.
pub(crate) fn cloud_file_name(path: &Path, written: &[String]) -> PathBuf {
    let is_known = path.extension().is_some_and(|ending| {
        let is = |known: &str| ending.eq_ignore_ascii_case(known);
        is("ply") || written.iter().any(|known| is(known))
    });
    if is_known { path.to_owned() } else { path.with_added_extension("ply") }
}

/// The file for the edits of a pyramid that was named so.
pub(crate) fn layer_file_name(path: &Path) -> PathBuf {
    match layers::is_layer(path) {
        true => path.to_owned(),
        false => path.with_extension(layers::ENDING),
    }
}
