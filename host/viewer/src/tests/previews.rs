//! Files that are shown while they are read.

use super::Screen;
use glam::DVec3;
use std::path::{Path, PathBuf};
use surfelshop_cloud::PREVIEW_POINTS;
use surfelshop_session::options::UpAxis;

/// Points enough that they are shown before all of them are there.
const POINTS: usize = 4 * PREVIEW_POINTS;

/// Bare points of a wavy square; a file of 5 MB, read and estimated in about two seconds.
fn bare(folder: &Path) -> PathBuf {
    let path = folder.join("bare.ply");
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {POINTS}\nproperty float x\nproperty \
         float y\nproperty float z\nend_header\n"
    )
    .into_bytes();
    let side = (POINTS as f64).sqrt() as usize + 1;
    for i in 0..POINTS {
        let [x, z] = [i % side, i / side].map(|step| step as f32 / side as f32);
        for number in [x, 0.1 * (9.0 * x).sin() * (7.0 * z).cos(), z] {
            bytes.extend(number.to_le_bytes());
        }
    }
    std::fs::write(&path, bytes).unwrap();
    path
}

/// Invariant: what is shown of a file that is still being read is no document: nothing of it is saved, and the whole takes its place under the same camera
#[test]
fn large_files_are_shown_while_they_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut screen = Screen::sample();
    let context = screen.harness.ctx.clone();
    let file = bare(folder.path());
    screen.window().open(&context, vec![file]);
    screen.until("some of the points", |window| window.document.preview.is_some());
    let window = screen.window();
    let n = window.document.clouds.as_ref().unwrap().clouds.facts.n_surfels;
    assert!(n > 1000 && n <= PREVIEW_POINTS as u64, "{n}");
    assert!(window.document.complete_clouds().is_none());
    let scene = folder.path().join("early.scene.toml");
    window.save_scene(&scene);
    assert!(!scene.exists());
    assert!(window.messages.last().unwrap().contains("files are still being read"));
    window.messages.dismiss_all();
    window.views.camera.eye += DVec3::Y;
    let camera = window.views.camera;
    screen.until("all points", |window| window.document.preview.is_none());
    let window = screen.window();
    assert_eq!(window.document.clouds.as_ref().unwrap().clouds.facts.n_surfels, POINTS as u64);
    assert_eq!(window.views.camera, camera);
}

/// Costs 3 s.
#[test]
fn a_preview_in_place_of_a_saved_scene_is_no_change_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut screen = Screen::sample();
    let context = screen.harness.ctx.clone();
    screen.window().save_scene(&folder.path().join("a.scene.toml"));
    let file = bare(folder.path());
    screen.window().open(&context, vec![file]);
    screen.until("some of the points", |window| window.document.preview.is_some());
    assert!(!screen.window().has_unsaved() && !screen.window().replacing_loses());
    screen.until("all points", |window| window.document.preview.is_none());
    let document = &screen.window().document;
    assert!(document.unsaved_prompt.is_none() && document.scene_path.is_none());
    // What is remembered of an axis is so of the files that are open now.
    screen.window().document.files = vec![PathBuf::from("former.pcd")];
    screen.window().set_up(UpAxis::Z);
    let kept = &screen.window().preferences.up;
    assert!(kept.contains_key("ply") && !kept.contains_key("pcd"), "{kept:?}");
}

#[test]
fn what_was_open_comes_back_where_reading_is_cancelled() {
    let folder = tempfile::tempdir().unwrap();
    let mut screen = Screen::sample();
    let context = screen.harness.ctx.clone();
    let camera = screen.window().views.camera;
    let file = bare(folder.path());
    screen.window().open(&context, vec![file]);
    screen.until("some of the points", |window| window.document.preview.is_some());
    screen.window().document.loader.as_ref().unwrap().cancel();
    screen.until("the end", |window| window.document.loader.is_none());
    let window = screen.window();
    assert!(window.document.preview.is_none());
    assert_eq!(window.document.clouds.as_ref().unwrap().clouds.facts.n_surfels, 119_051);
    assert_eq!(window.views.camera, camera);
}
