//! Files that are no scenes, are too long, or cannot hold a scene. Costs 1 s.

use super::refusals::refusal;
use super::{file, open};
use crate::scene::{Keyed, LARGEST_FILE, SceneCloud, SceneFault, SceneFile, SceneWriteError, read};
use glam::DVec3;
use surfelshop_api::{Camera, Projection};

#[test]
fn what_cannot_be_opened_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let line = |name: &str| read(folder.path().join(name)).unwrap_err().to_string();
    assert!(line("missing.scene.toml").contains("missing.scene.toml: cannot be read: "));
    std::fs::create_dir(folder.path().join("folder.toml")).unwrap();
    let found = line("folder.toml");
    assert!(found.ends_with(": expected a scene, found a folder; name the file itself"), "{found}");
    #[cfg(unix)]
    {
        let found = read("/dev/zero").unwrap_err().to_string();
        assert!(found.contains("found a pipe or device"), "{found}");
    }
}

#[test]
fn huge_files_are_not_read() {
    let (_folder, path) = file("format = 1\n");
    std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(100 << 20).unwrap();
    let error = read(&path).unwrap_err();
    assert!(matches!(error.fault, SceneFault::TooLarge));
    let expected = format!("at most {LARGEST_FILE} bytes, found more; is it a scene?");
    assert!(error.to_string().contains(&expected), "{error}");
}

#[test]
fn the_largest_files_are_read_in_time() {
    // Whatever took time in proportion to lines times bytes would take minutes.
    let clouds = "[[clouds]]\npath = 'a'\n".repeat(180_000);
    let (keys, most) = ((0..250_000).map(|i| format!("k{i} = 0\n")), (4 << 20) - 100);
    let keys: String = keys.collect();
    let numbers = format!("layout.x = [{}]\n", "1,".repeat(most / 2 - 10));
    let text = format!("name = '{}'\n", "x".repeat(most));
    for rest in [numbers, text] {
        assert!(open(&format!("format = 1\n{rest}")).cloud_lines.is_empty());
    }
    for (rest, expected) in [
        (clouds, "2:1: `clouds`: expected at most 4096 clouds, found 180000; remove some"),
        (keys, ": expected at most 10000 unknown keys, found 10001; remove some"),
    ] {
        let line = refusal(format!("format = 1\n{rest}"));
        assert!(line.contains(expected), "{line}");
    }
}

#[test]
fn more_than_is_meant_is_refused_with_what_is_allowed() {
    let most = |n: usize| "[[clouds]]\npath = 'a'\n".repeat(n);
    assert_eq!(open(&format!("format = 1\n{}", most(4096))).cloud_lines.len(), 4096);
    let values: String = (0..1001).map(|i| format!("k{i} = 0\n")).collect();
    for (text, expected) in [
        (most(4097), "expected at most 4096 clouds, found 4097"),
        ("[[views]]\nrenderer = 'a'\n".repeat(65), "expected at most 64 views, found 65"),
        (
            format!("[[views]]\nrenderer = 'a'\n[views.values]\n{values}"),
            "`views[1].values`: expected at most 1000 parameters, found 1001",
        ),
    ] {
        let line = refusal(format!("format = 1\n{text}"));
        assert!(line.contains(expected), "{line}");
    }
}

#[test]
fn every_changed_byte_is_read_or_refused_in_one_line() {
    let text = "format = 1\ncamera = { eye = [0, 0, 1], target = [0, 0, 0] }\n[[clouds]]\n\
                path = 'a'\ntransform.rotation = [1, 2, 3]\n[layout]\nx = [1, { y = 2 }]\n";
    let (_folder, path) = file(text);
    for at in 0..text.len() {
        for byte in [0, b'"', b'\'', b'[', b'{', b'=', b'\n', b'9', b'.', b'#', 0xff] {
            let mut bytes = text.as_bytes().to_vec();
            bytes[at] = byte;
            std::fs::write(&path, bytes).unwrap();
            if let Err(error) = read(&path) {
                assert!(!error.to_string().contains('\n'), "{error}");
            }
        }
    }
}

#[test]
fn scenes_that_could_not_be_read_are_not_written() {
    let (folder, path) = file("old");
    let refused = |scene: &SceneFile, words: &str| {
        let error = scene.write(&path).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
    };
    let eye = DVec3::new(f64::NAN, 0.0, 0.0);
    let projection = Projection::Perspective { fov_y: 1.0 };
    let camera = Camera { eye, target: DVec3::ZERO, up: DVec3::Y, projection };
    let nowhere = SceneFile { camera: Some(camera.into()), ..SceneFile::default() };
    refused(&nowhere, "cannot be written: `camera.eye`: expected three numbers");
    let mut nested = toml::Value::Integer(1);
    for _ in 0..50 {
        nested = toml::Value::Array(vec![nested]);
    }
    let mut deep = SceneFile::default();
    deep.layout.insert("deep".to_owned(), nested);
    refused(&deep, "at most 32 tables and arrays");
    let mut large = SceneFile::default();
    let text = "x".repeat(LARGEST_FILE as usize);
    large.layout.insert("large".to_owned(), text.into());
    refused(&large, "bytes, found more");
    #[cfg(unix)]
    {
        use std::os::unix::ffi::OsStrExt as _;
        let name = std::ffi::OsStr::from_bytes(b"gr\xfcn.ply");
        let mut unnamed = SceneFile::default();
        unnamed.clouds.push(Keyed::from(SceneCloud::new(name)));
        refused(&unnamed, "its path is not UTF-8; rename it");
    }
    assert_eq!(folder.path().read_dir().unwrap().count(), 1);
}

#[test]
fn names_and_folders_that_cannot_hold_a_scene_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let scene = open("format = 1").scene;
    for (name, found) in [("a.ply", "found `.ply`"), ("a", "found no ending")] {
        let error = scene.write(folder.path().join(name)).unwrap_err();
        assert!(matches!(error, SceneWriteError::Name { .. }));
        assert!(error.to_string().contains(found), "{error}");
    }
    let error = scene.write(folder.path().join("missing/a.scene.toml")).unwrap_err().to_string();
    assert!(error.contains("cannot be written") && !error.contains('\n'), "{error}");
}
