//! What is written is read again as it was.

use super::*;
use crate::pts::Pts;
use crate::ptx::Ptx;
use crate::xyz::Separator;
use surfelshop_api::columns::{COLOR, NORMAL, RADIUS};
use surfelshop_api::format::{CLASSIFICATION, GPS_TIME, INTENSITY, Pose};
use surfelshop_api::glam::{DQuat, DVec3};

/// Numbers of all sizes.
fn numbers(seeded: &mut Seeded, n: usize) -> Vec<f64> {
    let odd =
        [0.0, -0.0, 1.0, 0.1, 1e-300, -1e300, f64::MIN_POSITIVE, 5e-324, 123_456_789.123_456_79];
    let size = |seeded: &mut Seeded| 10f64.powi(seeded.below(30) as i32 - 15);
    let random = |seeded: &mut Seeded| (seeded.unit() - 0.5) * size(seeded);
    odd.into_iter().chain((odd.len()..n).map(|_| random(seeded))).take(n).collect()
}

fn everything(n: usize) -> StoredCloud {
    let mut seeded = Seeded(5);
    let positions: Vec<[f64; 3]> =
        numbers(&mut seeded, 3 * n).chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    let unit = |seeded: &mut Seeded| {
        let v = DVec3::new(seeded.unit() - 0.5, seeded.unit() - 0.5, seeded.unit() - 0.5);
        v.normalize_or(DVec3::Z).as_vec3().to_array()
    };
    let normals: Vec<f32> = (0..n).flat_map(|_| unit(&mut seeded)).collect();
    let floats: Vec<f32> = numbers(&mut seeded, n).iter().map(|&v| v as f32).collect();
    let bytes: Vec<u8> = (0..3 * n).map(|i| (i * 7) as u8).collect();
    StoredCloud::new(&positions)
        .with(NORMAL, 3, Stored::F32(normals))
        .with(COLOR, 3, Stored::U8(bytes.clone()))
        .with(RADIUS, 1, Stored::F32(floats.clone()))
        .with(INTENSITY, 1, Stored::F32(floats.clone()))
        .with(CLASSIFICATION, 1, Stored::U8(bytes[..n].to_vec()))
        .with(GPS_TIME, 1, Stored::F64(numbers(&mut seeded, n)))
        .with("tangent_u", 3, Stored::F32([&floats[..], &floats, &floats].concat()))
        .with("flow", 2, Stored::I32((0..2 * n as i32).map(|i| i * 101 - 7000).collect()))
        .with("odd name, with \"all\"", 1, Stored::F32(floats))
}

fn values(stored: &Stored) -> Vec<f64> {
    match stored {
        Stored::U8(all) => all.iter().map(|&v| f64::from(v)).collect(),
        Stored::U16(all) => all.iter().map(|&v| f64::from(v)).collect(),
        Stored::I32(all) => all.iter().map(|&v| f64::from(v)).collect(),
        Stored::F32(all) => all.iter().map(|&v| f64::from(v)).collect(),
        Stored::F64(all) => all.clone(),
    }
}

#[test]
fn tables_with_names_are_read_as_they_were() {
    let cloud = everything(100);
    for (name, delimiter) in [
        ("a.csv", Separator::Auto),
        ("a.tsv", Separator::Auto),
        ("a.xyz", Separator::Auto),
        ("a.txt", Separator::Semicolon),
        ("a.asc", Separator::Tab),
    ] {
        let settings = Settings { delimiter, ..Settings::default() };
        let (text, lines) = write_with::<Xyz>(std::slice::from_ref(&cloud), name, &settings);
        assert_eq!(lines, ["text keeps no types: read again, `flow` will be floats"]);
        let found = read_with::<Xyz>(text.as_bytes(), name, &Settings::default()).unwrap();
        assert_eq!(found.warnings, Vec::<String>::new());
        let found = &found.clouds[0];
        assert_eq!(
            shape(found),
            "position 3 f64, normal 3 f32, color 3 u8, radius 1 f32, intensity 1 f32, \
             classification 1 u8, gps_time 1 f64, tangent_u 3 f32, flow 2 f32, odd_name__with__all_ 1 f32"
        );
        for (stored, read) in cloud.columns.iter().zip(&found.columns) {
            assert_eq!(&values(stored), read, "{name}");
        }
    }
    let (text, _) = write_with::<Xyz>(std::slice::from_ref(&cloud), "a.CSV", &Settings::default());
    assert!(text.starts_with("x,y,z,nx,ny,nz,r,g,b,radius,"), "{}", &text[..80]);
    let (text, _) = write_with::<Xyz>(std::slice::from_ref(&cloud), "a.tsv", &Settings::default());
    assert!(text.starts_with("x\ty\tz\tnx\t"), "{}", &text[..80]);
    let settings = Settings { header: false, ..Settings::default() };
    let (text, _) =
        write_with::<Xyz>(&[StoredCloud::new(&[[1.5, 2.0, -3.25]])], "a.xyz", &settings);
    assert_eq!(text, "1.5 2 -3.25\n");
}

#[test]
fn an_empty_table_and_linear_colours_are_read_as_they_were() {
    let colors = vec![0.0f32, 1.0, 1.0, 0.0, 0.0, 1.0];
    let cloud = StoredCloud::new(&[[1.0; 3], [2.0; 3]]).with(COLOR, 3, Stored::F32(colors.clone()));
    let (text, _) = write_with::<Xyz>(&[cloud], "a.xyz", &Settings::default());
    let found = super::cloud(&text);
    assert_eq!(shape(&found), "position 3 f64, color 3 f32");
    assert_eq!(found.columns[1], colors.iter().map(|&v| f64::from(v)).collect::<Vec<_>>());
    let empty = StoredCloud::new(&[]).with(COLOR, 3, Stored::U8(Vec::new()));
    let (text, _) = write_with::<Xyz>(&[empty], "a.csv", &Settings::default());
    assert_eq!(text, "x,y,z,r,g,b\n");
    let found = super::cloud(&text);
    assert_eq!(shape(&found), "position 3 f64, color 3 u8");
    assert!(found.columns[0].is_empty());
    // Names above something else are no empty table.
    assert!(read(&("x,y,z\n".to_owned() + &"one two\n".repeat(100_000))).is_err());
}

#[test]
fn pts_files_are_read_as_they_were() {
    let positions: Vec<[f64; 3]> =
        (0..30).map(|i| [f64::from(i) * 0.1, 1e6 + 0.25, -3.0]).collect();
    let intensities: Vec<f32> = (0..30).map(|i| i as f32 * 17.5 - 100.0).collect();
    let cloud = StoredCloud::new(&positions)
        .with(COLOR, 3, Stored::U8((0..90).collect()))
        .with(INTENSITY, 1, Stored::F32(intensities.clone()))
        .with(RADIUS, 1, Stored::F32(vec![1.0; 30]));
    let (text, lines) = write_with::<Pts>(&[cloud.clone(), cloud], "a.pts", &());
    assert_eq!(lines, ["column `radius` is left out: PTS has intensity and colour only"]);
    assert!(text.starts_with("30 "), "{}", &text[..30]);
    let found = read_with::<Pts>(text.as_bytes(), "a.pts", &()).unwrap();
    assert_eq!((found.clouds.len(), found.warnings.len()), (2, 0));
    for cloud in &found.clouds {
        assert_eq!(cloud.header.rows, Some(30));
        assert_eq!(cloud.columns[0], positions.concat());
        assert_eq!(cloud.columns[1], intensities.iter().map(|&v| f64::from(v)).collect::<Vec<_>>());
        assert_eq!(cloud.columns[2], (0..90).map(f64::from).collect::<Vec<_>>());
    }
    let (text, _) = write_with::<Pts>(&[StoredCloud::new(&[])], "a.pts", &());
    assert_eq!(
        read_with::<Pts>(text.as_bytes(), "a.pts", &()).unwrap().clouds[0].header.rows,
        Some(0)
    );
}

#[test]
fn points_where_the_scanner_stands_stay_points() {
    let positions = [[0.0, 0.0, 0.0], [1.0, 2.0, 3.0], [f64::NAN, 0.0, 0.0], [-0.0, 0.0, 0.0]];
    let (text, lines) = write_with::<Ptx>(&[StoredCloud::new(&positions)], "a.ptx", &());
    let says = |line: &String| line.ends_with(": 2") && line.contains("1e-9 beside it");
    assert!(lines.iter().any(says), "{lines:?}");
    let found = read_with::<Ptx>(text.as_bytes(), "a.ptx", &()).unwrap();
    assert_eq!(found.clouds[0].columns[0], [1e-9, 0.0, 0.0, 1.0, 2.0, 3.0, 1e-9, 0.0, 0.0]);
}

#[test]
fn scans_are_read_with_their_poses() {
    let rotation = DQuat::from_euler(surfelshop_api::glam::EulerRot::XYZ, 0.3, -0.2, 2.5);
    let pose = Pose { rotation, translation: DVec3::new(4.5e6, -3.25, 1e-3) };
    let positions: Vec<[f64; 3]> = (1..31).map(|i| [f64::from(i) * 0.1, 0.25, -3.0]).collect();
    let intensities: Vec<u16> = (0..30).map(|i| i * 2000).collect();
    let mut cloud = StoredCloud::new(&positions).with(INTENSITY, 1, Stored::U16(intensities)).with(
        COLOR,
        3,
        Stored::U16((0..90).map(|i| i * 257).collect()),
    );
    cloud.header.pose = pose;
    let mut second = StoredCloud::new(&positions[..6]);
    second.header.grid = Some([3, 2]);
    let (text, lines) = write_with::<Ptx>(&[cloud, second], "a.ptx", &());
    assert_eq!(
        lines,
        [
            "`color` is rounded to 8 bits of sRGB",
            "this cloud does not say where the scanner stood, and PTX is read as if at the zero of the points",
            "intensity is written as a fraction of its type's largest number",
            "there is no intensity: 0.5 is written",
        ]
    );
    let found = read_with::<Ptx>(text.as_bytes(), "a.ptx", &()).unwrap();
    assert_eq!(found.warnings, Vec::<String>::new());
    let [a, b] = found.clouds.as_slice() else { panic!("{}", found.clouds.len()) };
    assert_eq!(a.columns[0], positions.concat());
    assert!((a.columns[1][29] - 58_000.0 / 65_535.0).abs() < 1e-7);
    assert_eq!(a.columns[2], (0..90).map(f64::from).collect::<Vec<_>>());
    assert_eq!(a.header.pose.translation, pose.translation);
    assert!(a.header.pose.rotation.dot(rotation).abs() > 1.0 - 1e-14);
    assert!(b.header.format.ends_with("; grid of 2 columns and 3 rows"), "{}", b.header.format);
    assert_eq!(b.header.comments, Vec::<String>::new());
    assert_eq!(b.columns[0], positions[..6].concat());
}

#[test]
fn points_that_are_not_finite_stand_for_places_without_a_return() {
    let positions = [[1.0, 2.0, 3.0], [f64::NAN, 2.0, 3.0], [4.0, 5.0, 6.5]];
    let (text, _) = write_with::<Ptx>(&[StoredCloud::new(&positions)], "a.ptx", &());
    let found = read_with::<Ptx>(text.as_bytes(), "a.ptx", &()).unwrap();
    assert_eq!(found.clouds[0].columns[0], [1.0, 2.0, 3.0, 4.0, 5.0, 6.5]);
    assert_eq!(found.warnings.len(), 1);
}

/// Invariant: what is made up, and what of a scan has no place, is said
/// Cost: milliseconds
#[test]
fn missing_intensities_and_places_of_scanners_are_said() {
    let colors = || StoredCloud::new(&[[1.0; 3], [2.0; 3]]).with(COLOR, 3, Stored::U8(vec![7; 6]));
    let (text, lines) = write_with::<Pts>(&[colors()], "a.pts", &());
    assert!(text.contains("1 1 1 0 7 7 7"), "{text}");
    assert_eq!(lines, ["there is no intensity: 0 is written"]);
    let mut seen = StoredCloud::new(&[[1.0; 3]]);
    seen.header.scanner = Some(DVec3::X);
    let said = |lines: Vec<String>, part: &str| {
        assert!(lines.iter().any(|line| line.contains(part)), "{part}: {lines:?}");
    };
    said(
        write_with::<Pts>(&[seen.clone()], "a.pts", &()).1,
        "no place for the place of the scanner",
    );
    let table = |cloud| write_with::<Xyz>(&[cloud], "a.xyz", &Settings::default()).1;
    said(table(seen.clone()), "no place for the place of the scanner");
    seen.header.scanner = None;
    said(write_with::<Ptx>(&[seen], "a.ptx", &()).1, "does not say where the scanner stood");
}

/// Invariant: a scanner beside zero stands at the zero of the axes that PTX writes
/// Cost: milliseconds
#[test]
fn scans_are_moved_to_where_their_scanner_is_zero() {
    let places = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.5], [7.0, 8.0, 9.0]];
    let mut seen = StoredCloud::new(&places);
    seen.header.scanner = Some(DVec3::new(1.0, 2.0, 3.0));
    seen.header.pose = Pose {
        rotation: DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2),
        translation: DVec3::new(100.0, 0.0, 0.0),
    };
    let pose = seen.header.pose;
    let (text, lines) = write_with::<Ptx>(&[seen], "a.ptx", &());
    // What lies where the scanner stands is written beside it.
    assert!(lines.iter().all(|line| !line.contains("place for")), "{lines:?}");
    assert!(text.contains("\n1e-9 0 0 0.5\n3 3 3.5 0.5\n6 6 6 0.5\n"), "{text}");
    let found = read_with::<Ptx>(text.as_bytes(), "a.ptx", &()).unwrap();
    let cloud = &found.clouds[0];
    assert_eq!(cloud.header.scanner, Some(DVec3::ZERO));
    assert!((cloud.header.pose.translation - DVec3::new(98.0, 1.0, 3.0)).length() < 1e-9);
    for (place, point) in places.iter().zip(cloud.columns[0].chunks_exact(3)) {
        let found = cloud.header.pose.place(DVec3::from_slice(point));
        assert!((found - pose.place(DVec3::from_array(*place))).length() < 2e-9);
    }
}
