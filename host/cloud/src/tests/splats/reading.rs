use super::*;
use crate::assemble;
use crate::formats::table_sink::TableSink;
use crate::tests::{ENCODINGS, load, values};
use crate::{Buffer, Column, Loaded, ReadOptions, SplatKind, Summary, splat_columns};
use glam::{Mat3, Quat, Vec3};
use surfelshop_api::columns::{COLOR, Element, NORMAL, Role, TANGENT_U, TANGENT_V};
use surfelshop_api::format::{CloudHeader, CloudSinkHost as _, FileColumn};

/// Nothing of splats is estimated.
fn assert_nothing_is_estimated(summary: &Summary) {
    assert_eq!((summary.normals.estimated, summary.radii.estimated), (0, 0));
    assert!(!summary.to_string().contains("estimated"), "{summary}");
}

/// Invariant: trained splats are read as their trainer means them
#[test]
fn trained_splats_are_read_as_their_trainer_means_them() {
    for (n_scales, order, encoding) in [(3, 3, 1), (3, 2, 0), (2, 1, 2), (2, 0, 1), (3, 0, 1)] {
        for kind in ["float", "double"] {
            let trained = Trained::new(50, n_scales, order);
            let loaded = trained.ply(ENCODINGS[encoding], kind).load();
            let cloud = &loaded.cloud;
            let expected = SplatKind { dimensions: n_scales as u8, order: Some(order as u8) };
            assert_eq!(splat_columns(cloud), Some(expected));
            assert_eq!(loaded.summary.splats, Some(expected));
            let line =
                format!("50 Gaussian splats ({n_scales}D), spherical harmonics of order {order}");
            assert!(loaded.summary.to_string().contains(&line), "{}", loaded.summary);
            assert_nothing_is_estimated(&loaded.summary);
            assert_eq!(loaded.summary.warnings, Vec::<String>::new());
            assert_eq!(cloud.columns().len(), 10 + order, "{:?}", loaded.summary.columns);
            for i in 0..50 {
                check_splat(&trained, cloud, i);
                for d in directions() {
                    let error = color(cloud, i, d) - trained.color(i, order, d);
                    assert!(error.length() < 1e-6, "order {order}: {error}");
                }
            }
        }
    }
}

fn check_splat(trained: &Trained, cloud: &Cloud, i: usize) {
    let near = |found: f32, expected: f64| {
        let error = (f64::from(found) - expected).abs();
        assert!(error <= 1e-6 * expected.abs(), "{found} for {expected}");
    };
    near(cloud.floats(OPACITY, 1)[i], 1.0 / (1.0 + (-trained.get(i, "opacity")).exp()));
    let n = cloud.column(SPLAT_SCALE).unwrap().components() as usize;
    for axis in 0..n {
        let expected = trained.get(i, &format!("scale_{axis}")).exp();
        near(cloud.floats(SPLAT_SCALE, n as u32)[n * i + axis], expected);
    }
    let [w, x, y, z] = [0, 1, 2, 3].map(|j| trained.get(i, &format!("rot_{j}")));
    let expected = DQuat::from_xyzw(x, y, z, w).normalize().to_array();
    for (found, expected) in cloud.floats(SPLAT_ROTATION, 4)[4 * i..].iter().zip(expected) {
        assert!((f64::from(*found) - expected).abs() < 1e-6);
    }
}

/// Surfels stand for splats where those are not drawn.
#[test]
fn surfels_are_the_ellipses_of_splats() {
    for n_scales in [2, 3] {
        let mut trained = Trained::new(60, n_scales, 0);
        trained.set(0, "opacity", -8.0);
        trained.set(1, "opacity", 12.0);
        let Loaded { cloud, summary, .. } = trained.ply("binary_little_endian", "float").load();
        let (scales, rotations) =
            (cloud.floats(SPLAT_SCALE, n_scales as u32), cloud.floats(SPLAT_ROTATION, 4));
        for i in 0..60 {
            let own: Vec<f32> = scales[n_scales * i..n_scales * (i + 1)].to_vec();
            let axes = Mat3::from_quat(Quat::from_slice(&rotations[4 * i..]));
            let mut order: Vec<usize> = (0..3).collect();
            let of = |axis: usize| own.get(axis).copied().unwrap_or(0.0);
            order.sort_by(|&a, &b| of(b).total_cmp(&of(a)));
            let alpha = f64::from(cloud.floats(OPACITY, 1)[i]);
            let r = (2.0 * (2.0 * alpha).ln()).max(0.25).sqrt() as f32;
            let normal = cloud.normals()[i];
            assert!(normal.dot(axes.col(order[2])).abs() > 0.999_99);
            assert!(normal.abs().max_element() == normal.max_element(), "{normal}");
            let (u, v) = (cloud.vectors(TANGENT_U)[i], cloud.vectors(TANGENT_V)[i]);
            let expected = axes.col(order[0]) * of(order[0]) * r;
            assert!((u - expected).length() < 1e-5 * expected.length());
            assert!((v.length() - of(order[1]) * r).abs() < 1e-5 * v.length());
            assert!(u.cross(v).dot(normal) > 0.0);
            assert!((cloud.radii()[i] - u.length()).abs() < 1e-5 * u.length());
            let code = |j: usize| {
                let dc = trained.get(i, &format!("f_dc_{j}"));
                (255.0 * (0.5 + 0.282_094_79 * dc)).clamp(0.0, 255.0).round()
            };
            let Buffer::U8(codes) = cloud.column(COLOR).unwrap().values() else { panic!() };
            let found = [0, 1, 2].map(|j| f64::from(codes[3 * i + j]));
            assert_eq!(found, [code(0), code(1), code(2)]);
        }
        assert_eq!((summary.normals.of_splats, summary.colors.of_splats), (60, 60));
    }
}

/// Invariant: damaged splats are kept and not seen
#[test]
fn damaged_splats_are_kept_and_not_seen() {
    let mut trained = Trained::new(40, 3, 1);
    for (splat, name, value) in [
        (0, "rot_0", f64::NAN),
        (2, "opacity", f64::NAN),
        (3, "opacity", f64::INFINITY),
        (4, "scale_1", f64::NAN),
        (5, "scale_2", f64::INFINITY),
        (6, "f_dc_1", f64::NAN),
        (7, "f_rest_4", f64::NEG_INFINITY),
        (8, "scale_0", 100.0),
        (9, "scale_0", f64::NEG_INFINITY),
        (10, "scale_0", -1000.0),
    ] {
        trained.set(splat, name, value);
    }
    for i in 0..4 {
        trained.set(1, &format!("rot_{i}"), 0.0);
    }
    for i in 0..3 {
        trained.set(11, &format!("scale_{i}"), f64::NEG_INFINITY);
    }
    let loaded = trained.ply("binary_little_endian", "float").load();
    let cloud = &loaded.cloud;
    for name in OWN.into_iter().chain(["sh_0", "sh_1"]) {
        assert!(values(&loaded, name).iter().all(|value| value.is_finite()), "{name}");
    }
    let identity = [0.0, 0.0, 0.0, 1.0];
    assert_eq!(cloud.floats(SPLAT_ROTATION, 4)[..8], [identity, identity].concat());
    let opacity = cloud.floats(OPACITY, 1);
    assert_eq!(opacity[2..8], [0.0; 6]);
    assert!(opacity.iter().enumerate().all(|(i, &o)| o > 0.0 || (2..8).contains(&i)));
    let scales = cloud.floats(SPLAT_SCALE, 3);
    assert_eq!(scales[12..18], [1e-20; 6]);
    assert_eq!([scales[24], scales[27], scales[30]], [1e18, 0.0, 0.0]);
    assert_eq!(scales[33..36], [0.0; 3]);
    assert_eq!(cloud.floats("sh_0", 3)[6 * 3 + 1], 0.0);
    let said = |words: &str| loaded.summary.warnings.iter().any(|line| line.starts_with(words));
    assert!(said("2 rotations of splats"), "{:?}", loaded.summary.warnings);
    assert!(said("6 splats have scales, opacities or harmonics that are no numbers"));
    assert!(said("1 scales of splats exceeded 1e18"));
    assert_eq!(loaded.summary.warnings.len(), 3);
    // And all of it can be moved.
    let transform = crate::Transform { scale: 1e-3, ..Default::default() };
    assert!(cloud.transformed(&transform).is_ok());
}

#[test]
fn tables_that_only_look_like_splats_stay_as_they_are() {
    // Five floats are no order of harmonics.
    let mut trained = Trained::new(20, 3, 0);
    for i in 0..5 {
        trained = trained.and(&format!("f_rest_{i}"), 0.25);
    }
    let loaded = trained.ply("ascii", "float").load();
    assert_eq!(splat_columns(&loaded.cloud).unwrap().order, Some(0));
    assert_eq!(values(&loaded, "f_rest_4"), [0.25; 20]);
    assert_eq!(loaded.summary.warnings.len(), 1, "{:?}", loaded.summary.warnings);
    assert!(loaded.summary.warnings[0].starts_with("the 5 columns `f_rest_*`"));
    // Columns that are missing, or have another type.
    for (name, other) in [("rot_3", "rot_9"), ("f_dc_2", "f"), ("opacity", "alpha_of")] {
        let mut trained = Trained::new(20, 3, 0);
        let place = trained.place(name);
        trained.properties[place] = other.to_owned();
        let loaded = trained.ply("binary_little_endian", "float").load();
        assert_eq!(splat_columns(&loaded.cloud), None, "{name}");
        assert!(loaded.cloud.column("scale_0").is_some());
        assert!(loaded.summary.normals.of_splats == 0 && loaded.summary.splats.is_none());
    }
    let text = String::from_utf8_lossy(&Trained::new(20, 3, 0).ply("ascii", "float").bytes())
        .replace("float opacity", "uchar opacity")
        .replace(" -", " ");
    let loaded = crate::tests::try_load(text.as_bytes());
    assert!(loaded.is_err() || splat_columns(&loaded.unwrap().cloud).is_none());
}

/// A column of a file that has the name of one that is made keeps its values under another name.
#[test]
fn names_that_are_taken_get_others() {
    let trained = Trained::new(9, 3, 1).and("sh_0", 7.0).and("splat_scale", 8.0).and("ao", 0.5);
    let bytes = trained.ply("binary_big_endian", "float").line("comment surfelshop column sh_1 9");
    let loaded = bytes.load();
    assert_eq!(values(&loaded, "sh_0_"), [7.0; 9]);
    assert_eq!(values(&loaded, "splat_scale_"), [8.0; 9]);
    assert_eq!(values(&loaded, "ao"), [0.5; 9]);
    assert_eq!(splat_columns(&loaded.cloud).unwrap().order, Some(1));
}

/// A cloud out of columns that a format hands over.
fn assembled(columns: &[(FileColumn, Buffer)], n: usize) -> Loaded {
    let mut sink = TableSink::default();
    let header = CloudHeader {
        columns: columns.iter().map(|(column, _)| column.clone()).collect(),
        rows: Some(n as u64),
        ..CloudHeader::default()
    };
    sink.begin(&header).unwrap();
    let values: Vec<_> = columns.iter().map(|(_, values)| values.as_values()).collect();
    sink.batch(&values).unwrap();
    let (table, source) = sink.finish().unwrap();
    assemble::cloud(table, source, &ReadOptions::default()).unwrap()
}

/// Columns of a cloud as a format hands them over.
pub(super) fn handed_over(cloud: &Cloud, without: &[&str]) -> Vec<(FileColumn, Buffer)> {
    let kept = cloud.columns().iter().filter(|column| !without.contains(&column.name()));
    let handed = kept.map(|column| {
        let values = column.values().clone();
        let file = FileColumn::new(column.name(), column.components(), values.element());
        (file.with_role(column.role()), values)
    });
    handed.collect()
}

#[test]
fn formats_hand_over_splats_as_the_host_has_them() {
    let mut cloud = Trained::new(30, 3, 2).ply("ascii", "float").load().cloud;
    let speed = Column::new("speed", 3, Buffer::F32(vec![0.5; 90])).with_role(Role::Direction);
    cloud = cloud.with_columns(vec![speed]).unwrap();
    let derived = [NORMAL, "radius", COLOR, TANGENT_U, TANGENT_V];
    for without in [&[][..], &derived] {
        let loaded = assembled(&handed_over(&cloud, without), 30);
        assert_nothing_is_estimated(&loaded.summary);
        assert_eq!(loaded.summary.normals.given, if without.is_empty() { 30 } else { 0 });
        for column in cloud.columns() {
            let found = loaded.cloud.column(column.name()).unwrap();
            assert_eq!(found.values(), column.values(), "{}", column.name());
            assert_eq!(found.role(), column.role(), "{}", column.name());
        }
    }
    // Normals of a file are kept where its tangents are, but for those that are none.
    let mut handed = handed_over(&cloud, &[]);
    let place = handed.iter().position(|(column, _)| column.name == NORMAL).unwrap();
    let mut normals = vec![Vec3::X; 30];
    (normals[3], normals[4]) = (Vec3::ZERO, Vec3::new(0.0, 2.0, 0.0));
    handed[place].1 = Buffer::F32(normals.iter().flat_map(Vec3::to_array).collect());
    let loaded = assembled(&handed, 30);
    let counts = loaded.summary.normals;
    assert_eq!((counts.given, counts.normalised, counts.of_splats), (28, 1, 1));
    assert_eq!(loaded.cloud.normals()[3], cloud.normals()[3]);
    assert_eq!(loaded.cloud.normals()[4], Vec3::Y);
}

#[test]
fn roles_that_a_type_cannot_have_are_refused_in_headers() {
    let position = FileColumn::new("position", 3, Element::F32);
    let begun = |column: FileColumn| {
        let columns = vec![position.clone(), column];
        TableSink::default().begin(&CloudHeader { columns, ..CloudHeader::default() })
    };
    let plain = |n: u32| FileColumn::new("turn", n, Element::F32);
    assert!(begun(plain(4).with_role(Role::Quaternion)).is_ok());
    let error = begun(plain(3).with_role(Role::Quaternion)).unwrap_err().to_string();
    assert!(error.contains("column `turn` of 3 x f32"), "{error}");
    assert!(begun(plain(12).with_role(Role::SphericalHarmonics(6))).is_err());
    // A name alone promises nothing.
    let loaded = assembled(
        &[
            (position.clone(), Buffer::F32(vec![0.0, 0.0, 0.0, 1.0, 2.0, 0.0])),
            (FileColumn::new(SPLAT_ROTATION, 1, Element::U8), Buffer::U8(vec![1, 2])),
        ],
        2,
    );
    let column = loaded.cloud.column(SPLAT_ROTATION).unwrap();
    assert_eq!((column.role(), column.values()), (Role::Plain, &Buffer::U8(vec![1, 2])));
}

#[test]
fn few_splats_and_none_are_read() {
    for n in [0, 1] {
        let loaded = load(&Trained::new(n, 2, 3).ply("binary_little_endian", "float").bytes());
        assert_eq!(splat_columns(&loaded.cloud).unwrap().order, Some(3));
    }
}
