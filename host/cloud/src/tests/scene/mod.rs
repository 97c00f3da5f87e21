//! Scenes: what is read, what is refused, and that nothing is lost between reading and writing.

mod reading;
mod refusals;
mod refused_files;
mod round_trip;

use crate::scene::{OpenedScene, SceneFile, read};
use std::path::PathBuf;
use tempfile::TempDir;

/// A folder with a scene of these bytes.
fn file(bytes: impl AsRef<[u8]>) -> (TempDir, PathBuf) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.scene.toml");
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

fn open(text: &str) -> OpenedScene {
    let (_folder, path) = file(text);
    read(path).unwrap_or_else(|error| panic!("{error}"))
}

/// The scene written as if it had been read from there, and the file's text.
fn written(scene: &SceneFile) -> (TempDir, PathBuf, String) {
    let (folder, path) = file("");
    let scene = SceneFile { folder: folder.path().to_owned(), ..scene.clone() };
    scene.write(&path).unwrap_or_else(|error| panic!("{error}"));
    let text = std::fs::read_to_string(&path).unwrap();
    (folder, path, text)
}
