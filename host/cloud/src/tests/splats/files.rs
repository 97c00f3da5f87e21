use super::*;
use crate::convert::{Selection, convert};
use crate::files::replace_at;
use crate::formats::batches::CloudBatches;
use crate::formats::ply::write_batches;
use crate::{Buffer, Column, ReadOptions, Rotation, Transform, WriteOptions, read, write};
use std::sync::Arc;
use surfelshop_api::columns::Role;
use surfelshop_api::format::FileHost;
use tempfile::TempDir;

/// Whether all values of the columns of splats are alike.
fn assert_alike(a: &Cloud, b: &Cloud, tolerance: f64) {
    for name in OWN.into_iter().chain(SH) {
        let Some(column) = a.column(name) else { continue };
        let found = b.column(name).unwrap();
        assert_eq!(column.components(), found.components(), "{name}");
        for (x, y) in column.values().iter_f64().zip(found.values().iter_f64()) {
            let error = (x - y).abs();
            assert!(error <= tolerance * x.abs().max(1e-30), "{name}: {x} became {y}");
        }
    }
    for i in 0..a.len() {
        let error = a.world_position(i).unwrap() - b.world_position(i).unwrap();
        assert!(error.length() < 1e-6, "{error}");
    }
}

fn header(bytes: &[u8]) -> String {
    let end = bytes.windows(11).position(|window| window == b"end_header\n").unwrap();
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

/// Invariant: splats are written as their trainer writes them
#[test]
fn splats_are_written_as_their_trainer_writes_them() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("cloud.ply");
    for (n_scales, order) in [(3, 3), (3, 0), (2, 2), (2, 1)] {
        for ascii in [false, true] {
            let trained = Trained::new(30, n_scales, order);
            let cloud = trained.ply("binary_little_endian", "float").load().cloud;
            write(&path, &cloud, &WriteOptions { ascii, ..Default::default() }).unwrap();
            let bytes = std::fs::read(&path).unwrap();
            let text = header(&bytes);
            let declared = text.lines().filter_map(|line| line.strip_prefix("property float "));
            assert_eq!(declared.collect::<Vec<_>>(), trained.properties, "{text}");
            assert_eq!(text.matches("property").count(), trained.properties.len());
            assert!(!text.contains("surfelshop column"), "{text}");
            let again = read(&path, &ReadOptions::default()).unwrap();
            assert!(again.summary.warnings.is_empty(), "{:?}", again.summary.warnings);
            assert_alike(&cloud, &again.cloud, 1e-6);
            if !ascii {
                check_records(&trained, &bytes[text.len() + 11..]);
            }
        }
    }
}

/// The numbers of the records are those of the file that was read, but for the length of quaternions.
fn check_records(trained: &Trained, records: &[u8]) {
    let (numbers, rest) = records.as_chunks::<4>();
    assert!(rest.is_empty() && numbers.len() == trained.rows.len() * trained.properties.len());
    let found = numbers.iter().map(|bytes| f64::from(f32::from_le_bytes(*bytes)));
    let names = trained.properties.iter().cycle();
    let expected = trained.rows.iter().flatten();
    for ((found, name), expected) in found.zip(names).zip(expected) {
        // What a rounding of an opacity does to its logit.
        let opacity = 1.0 / (1.0 + (-expected).exp());
        let slope = if name == "opacity" { 1.0 / (opacity * (1.0 - opacity)) } else { 1.0 };
        if !name.starts_with('n') && !name.starts_with("rot") {
            let error = (found - expected).abs();
            assert!(error < 1e-6 + 2e-7 * slope, "{name}: {found} for {expected}");
        }
    }
}

#[test]
fn full_and_no_opacity_are_written_as_numbers() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("cloud.ply");
    let cloud = Trained::new(4, 3, 1).ply("ascii", "float").load().cloud;
    let opacity = Column::new(OPACITY, 1, Buffer::F32(vec![0.0, 1.0, 1e-40, 0.5]));
    let mut scales = cloud.floats(SPLAT_SCALE, 3).to_vec();
    scales[0] = 0.0;
    let scales = Column::new(SPLAT_SCALE, 3, Buffer::F32(scales));
    let cloud = cloud.with_columns(vec![opacity, scales]).unwrap();
    for ascii in [false, true] {
        write(&path, &cloud, &WriteOptions { ascii, ..Default::default() }).unwrap();
        let again = read(&path, &ReadOptions::default()).unwrap();
        assert!(again.summary.warnings.is_empty(), "{:?}", again.summary.warnings);
        let opacity = again.cloud.floats(OPACITY, 1);
        assert_eq!([opacity[0], opacity[3]], [0.0, 0.5]);
        assert!(opacity[1] > 0.999_999_8 && opacity[2] < 1e-37, "{opacity:?}");
        assert_eq!(again.cloud.floats(SPLAT_SCALE, 3)[0], 0.0);
    }
}

#[test]
fn further_columns_are_written_and_those_that_follow_are_not() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("cloud.ply");
    let cloud = Trained::new(12, 3, 1).ply("ascii", "float").load().cloud;
    let further = vec![
        Column::new("ao", 1, Buffer::F32(vec![0.25; 12])),
        Column::new("class", 1, Buffer::U8(vec![9; 12])),
        Column::new("pair", 2, Buffer::F64(vec![1.5; 24])),
    ];
    let cloud = cloud.with_columns(further).unwrap();
    for ascii in [false, true] {
        write(&path, &cloud, &WriteOptions { ascii, ..Default::default() }).unwrap();
        let text = header(&std::fs::read(&path).unwrap());
        for absent in ["red", "radius", "tangent", "splat_", "sh_"] {
            assert!(!text.contains(absent), "{text}");
        }
        let again = read(&path, &ReadOptions::default()).unwrap();
        for name in ["ao", "class", "pair"] {
            let [a, b] = [&cloud, &again.cloud].map(|cloud| cloud.column(name).unwrap());
            assert_eq!((a.values(), a.components()), (b.values(), b.components()));
        }
    }
    let clash = Column::new("rot_0", 1, Buffer::U8(vec![0; 12]));
    let clash = cloud.with_columns(vec![clash]).unwrap();
    let error = write(&path, &clash, &WriteOptions::default()).unwrap_err().to_string();
    assert!(error.contains("`rot_0`"), "{error}");
}

#[test]
fn moved_splats_are_written_where_they_stand() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("cloud.ply");
    let cloud = Trained::new(20, 3, 3).ply("ascii", "float").load().cloud;
    let rotation = Rotation::Quaternion(DQuat::from_xyzw(0.1, 0.7, -0.3, 0.5));
    let translation = DVec3::new(2.0, 0.5, -1.0);
    let near = Transform { translation, rotation, scale: 0.5 };
    let far = Transform { translation: DVec3::splat(1e6), ..near };
    for (transform, kind) in [(near, "float"), (far, "double")] {
        let moved = cloud.transformed(&transform).unwrap();
        write(&path, &moved, &WriteOptions::default()).unwrap();
        let text = header(&std::fs::read(&path).unwrap());
        assert!(text.contains(&format!("property {kind} x\n")), "{text}");
        let again = read(&path, &ReadOptions::default()).unwrap();
        assert_alike(&moved, &again.cloud, 1e-6);
    }
}

/// What is no splat any more is written as any cloud is, and its columns come back.
#[test]
fn clouds_without_all_columns_of_splats_keep_those_they_have() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("cloud.ply");
    let cloud = Trained::new(12, 3, 1).ply("ascii", "float").load().cloud;
    for name in [OPACITY, SH[0]] {
        let fewer = cloud.without_column(name);
        write(&path, &fewer, &WriteOptions::default()).unwrap();
        let again = read(&path, &ReadOptions::default()).unwrap().cloud;
        assert_eq!(fewer.columns().len(), again.columns().len());
        for column in fewer.columns() {
            let found = again.column(column.name()).unwrap();
            assert_eq!(found.values(), column.values(), "{}", column.name());
            assert_eq!(found.role(), column.role(), "{}", column.name());
        }
    }
    let roles = cloud.columns().iter().map(Column::role);
    assert!(roles.filter(|role| *role != Role::Plain).count() == 6);
}

/// A format that hands over splats as the host has them is written as a trainer writes.
#[test]
fn batches_of_splats_are_written_as_their_trainer_writes_them() {
    let folder = TempDir::new().unwrap();
    let [whole, batches] = ["whole.ply", "batches.ply"].map(|name| folder.path().join(name));
    for n_scales in [2, 3] {
        let mut cloud = Trained::new(30, n_scales, 2).ply("ascii", "float").load().cloud;
        let pair = Column::new("pair", 2, Buffer::I16(vec![5; 60]));
        cloud = cloud.with_columns(vec![pair]).unwrap();
        for ascii in [false, true] {
            write(&whole, &cloud, &WriteOptions { ascii, ..Default::default() }).unwrap();
            let failed = |error| crate::WriteError::Io { path: batches.clone(), error };
            let source = CloudBatches::new(&cloud, false);
            let into = |file: Arc<dyn FileHost>| write_batches(&*file, &batches, source, ascii);
            replace_at(&batches, into, failed).unwrap();
            let [a, b] = [&whole, &batches].map(|path| {
                let bytes = std::fs::read(path).unwrap();
                let text = header(&bytes);
                let declared = text.lines().filter(|line| line.starts_with("property"));
                let declared: Vec<String> = declared.map(str::to_owned).collect();
                assert_eq!(text.matches("surfelshop column").count(), 1, "{text}");
                (declared, bytes[text.len()..].to_vec())
            });
            assert!(a == b, "{:?} {:?}", a.0, b.0);
        }
    }
}

/// Files go through batch by batch as they are.
#[test]
fn trained_files_are_converted_as_they_are() {
    let folder = TempDir::new().unwrap();
    let (from, to) = (folder.path().join("in.ply"), folder.path().join("out.ply"));
    let trained = Trained::new(30, 3, 3);
    std::fs::write(&from, trained.ply("binary_big_endian", "float").bytes()).unwrap();
    let inputs = [from.clone(), from.clone()];
    let (reading, writing) = (ReadOptions::default(), WriteOptions::default());
    convert(&inputs, &to, &Selection::default(), true, &reading, &writing).unwrap();
    let [one, two] = [&from, &to].map(|path| read(path, &ReadOptions::default()).unwrap().cloud);
    assert_eq!(two.len(), 60);
    assert_eq!(crate::splat_columns(&two), crate::splat_columns(&one));
    let n = one.floats(SH[3], 21).len();
    assert_eq!(two.floats(SH[3], 21)[..n], *one.floats(SH[3], 21));
}

/// What nobody changed keeps its bits, of rotations of any length and opacities that single precision rounds to 1, too.
#[test]
fn trained_files_are_converted_bit_for_bit() {
    let folder = TempDir::new().unwrap();
    let (from, to) = (folder.path().join("in.ply"), folder.path().join("out.ply"));
    for (n_scales, order) in [(3, 3), (3, 0), (2, 3), (2, 1)] {
        let mut trained = Trained::new(500, n_scales, order);
        for (splat, logit) in [(0, 40.0), (1, -120.0), (2, 17.3)] {
            trained.set(splat, "opacity", logit);
            trained.set(splat, "scale_0", -logit);
        }
        let written = trained.ply("binary_little_endian", "float").bytes();
        std::fs::write(&from, &written).unwrap();
        let (reading, writing) = (ReadOptions::default(), WriteOptions::default());
        let inputs = [from.clone()];
        convert(&inputs, &to, &Selection::default(), false, &reading, &writing).unwrap();
        let found = std::fs::read(&to).unwrap();
        let [a, b] = [&written, &found].map(|bytes| {
            let text = header(bytes);
            let declared = text.lines().filter_map(|line| line.strip_prefix("property "));
            (declared.map(str::to_owned).collect::<Vec<_>>(), bytes[text.len()..].to_vec())
        });
        assert_eq!(a.0, b.0);
        assert!(a.1 == b.1, "{n_scales} scales, order {order}");
    }
}
