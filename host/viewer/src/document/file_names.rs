//! Endings of files that are written: with another one a file could not be opened again.

use std::path::{Path, PathBuf};

/// The path of a scene, with its ending added where it has none.
pub(crate) fn scene_file_name(path: &Path) -> PathBuf {
    match surfelshop_cloud::scene::is_scene(path) {
        true => path.to_owned(),
        false => path.with_added_extension("scene.toml"),
    }
}

/// The path of a cloud, with its ending added where it has none.
pub(crate) fn cloud_file_name(path: &Path) -> PathBuf {
    let is_ply = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("ply"));
    if is_ply { path.to_owned() } else { path.with_added_extension("ply") }
}
