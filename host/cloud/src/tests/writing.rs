use super::*;
use crate::{Cloud, Column, WriteError, WriteOptions, write};
use glam::DVec3;
use std::ops::ControlFlow;

/// A cloud with every well-known column and one of each other type.
fn rich(origin: DVec3) -> Cloud {
    let n = 30;
    let ramp = |components: usize, step: f32| -> Buffer {
        Buffer::F32((0..n * components).map(|i| (i as f32 + 0.1).sin() * step).collect())
    };
    let unit: Vec<f32> = (0..n).flat_map(|i| [(i as f32).cos(), (i as f32).sin(), 0.0]).collect();
    let radii = (0..n).map(|i| 0.1 + i as f32 * 1e-3).collect();
    let columns = vec![
        Column::new("position", 3, ramp(3, 10.0)),
        Column::new("normal", 3, Buffer::F32(unit)),
        Column::new("radius", 1, Buffer::F32(radii)),
        Column::new("color", 4, Buffer::U16((0..n as u16 * 4).map(|i| i * 500).collect())),
        Column::new("ao", 1, Buffer::F32((0..n).map(|i| i as f32 / 40.0).collect())),
        Column::new("material", 1, Buffer::U32((0..n as u32).collect())),
        Column::new("tangent_u", 3, ramp(3, 0.5)),
        Column::new("tangent_v", 3, ramp(3, -0.5)),
        Column::new("normal_field", 6, Buffer::F64((0..n * 6).map(|i| i as f64 / 3.0).collect())),
        Column::new("clip", 2, Buffer::I8((0..n as i8 * 2).map(|i| i - 30).collect())),
        Column::new("a", 1, Buffer::U8((0..n as u8).collect())),
        Column::new("b", 1, Buffer::I16((0..n as i16).map(|i| -i * 1000).collect())),
        Column::new("c", 1, Buffer::I32((0..n as i32).map(|i| i32::MIN + i).collect())),
        Column::new("d", 1, Buffer::F32([f32::NAN, f32::INFINITY].repeat(n / 2))),
    ];
    Cloud::new(origin, columns).unwrap()
}

/// Names and values of all columns, in a form in which NaN equals itself.
fn contents(cloud: &Cloud) -> Vec<String> {
    let mut all: Vec<String> = cloud
        .columns()
        .iter()
        .map(|c| format!("{} {} {:?}", c.name(), c.components(), c.values()))
        .collect();
    all.sort();
    all
}

/// Invariant: what is written is read back identically
#[test]
fn written_clouds_are_read_back_identically() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("cloud.ply");
    for origin in [DVec3::ZERO, DVec3::new(512_345.0, -5_403_210.0, 430.5)] {
        for ascii in [false, true] {
            let cloud = rich(origin);
            let comments = vec!["first\nsecond".to_owned()];
            write(&path, &cloud, &WriteOptions { ascii, comments, ..Default::default() }).unwrap();
            let mut loaded = read(&path, &ReadOptions::default()).unwrap();
            assert_eq!(loaded.summary.comments, ["first", "second"]);
            for _ in 0..2 {
                assert_eq!(loaded.cloud.origin(), origin);
                if origin == DVec3::ZERO {
                    assert_eq!(contents(&loaded.cloud), contents(&cloud));
                }
                let before = contents(&loaded.cloud);
                write(&path, &loaded.cloud, &WriteOptions { ascii, ..Default::default() }).unwrap();
                loaded = read(&path, &ReadOptions::default()).unwrap();
                assert_eq!(contents(&loaded.cloud), before);
            }
        }
    }
}

#[test]
fn a_far_origin_is_written_as_double_positions() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("cloud.ply");
    write(&path, &rich(DVec3::splat(1e6)), &WriteOptions::default()).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let header = String::from_utf8_lossy(&bytes[..400]).into_owned();
    assert!(header.contains("property double x"), "{header}");
    let loaded = read(&path, &ReadOptions::default()).unwrap();
    let cloud = rich(DVec3::splat(1e6));
    for i in 0..cloud.len() {
        assert_eq!(loaded.cloud.world_position(i), cloud.world_position(i));
    }
}

#[test]
fn empty_clouds_are_written_and_read() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("cloud.ply");
    write(&path, &Cloud::default(), &WriteOptions::default()).unwrap();
    assert!(read(&path, &ReadOptions::default()).unwrap().cloud.is_empty());
}

/// Invariant: a failed write leaves the old file
#[test]
fn a_failed_write_leaves_the_old_file_and_no_other() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("cloud.ply");
    std::fs::write(&path, "old").unwrap();
    let stop = |_: f64| ControlFlow::Break(());
    let options = WriteOptions { progress: &stop, ..Default::default() };
    let error = write(&path, &rich(DVec3::ZERO), &options).unwrap_err();
    assert!(matches!(error, WriteError::Cancelled { .. }));
    let spaced = rich(DVec3::ZERO)
        .with_columns(vec![Column::new("two words", 1, Buffer::U8(vec![0; 30]))])
        .unwrap();
    let error = write(&path, &spaced, &WriteOptions::default()).unwrap_err();
    assert!(error.to_string().contains("`two words`"), "{error}");
    let clash = rich(DVec3::ZERO)
        .with_columns(vec![Column::new("clip_1", 1, Buffer::U8(vec![0; 30]))])
        .unwrap();
    assert!(write(&path, &clash, &WriteOptions::default()).is_err());
    assert_eq!(std::fs::read(&path).unwrap(), b"old");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn unknown_endings_and_folders_that_do_not_exist_are_refused() {
    let folder = TempDir::new().unwrap();
    for (name, found) in [("cloud.obj", "found `.obj`"), ("cloud", "found no ending")] {
        let path = folder.path().join(name);
        let error = write(&path, &Cloud::default(), &WriteOptions::default()).unwrap_err();
        assert!(error.to_string().contains(found), "{error}");
    }
    let path = folder.path().join("missing/cloud.ply");
    let error = write(&path, &Cloud::default(), &WriteOptions::default()).unwrap_err().to_string();
    assert!(error.contains("cannot be written") && !error.contains('\n'), "{error}");
}

#[cfg(unix)]
#[test]
fn a_replaced_file_keeps_its_rights_and_links_stay_links() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = TempDir::new().unwrap();
    let (target, link) = (folder.path().join("target.ply"), folder.path().join("link.ply"));
    std::fs::write(&target, "old").unwrap();
    std::fs::set_permissions(&target, std::fs::Permissions::from_mode(0o640)).unwrap();
    std::os::unix::fs::symlink(&target, &link).unwrap();
    write(&link, &Cloud::default(), &WriteOptions::default()).unwrap();
    assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
    let metadata = std::fs::metadata(&target).unwrap();
    assert_eq!(metadata.permissions().mode() & 0o777, 0o640);
    assert!(metadata.len() > 3);
}
