//! Files from format to format: what is streamed is what reading and writing make, and what is selected is right.
//! Costs 2 s.

use crate::formats::in_memory::{InMemoryCloud, write};
use crate::formats::stage::{Files, formats, places, reading, values, writing};
use glam::{DQuat, DVec3};
use std::path::PathBuf;
use surfelshop_api::columns::{COLOR, NORMAL, POSITION, RADIUS};
use surfelshop_api::format::{INTENSITY, Pose, SCAN};
use surfelshop_cloud::convert::{ConvertError, Converted, Selection, convert};
use surfelshop_cloud::{Buffer, Cloud, Column, inspect};
use surfelshop_tests::clouds;

/// More than one batch.
const POINTS: usize = 70_000;

fn converted(
    files: &Files,
    inputs: &[&str],
    output: &str,
    selection: &Selection,
    merge: bool,
) -> Result<Converted, ConvertError> {
    let inputs: Vec<PathBuf> = inputs.iter().map(|name| files.at(name)).collect();
    let (read, write) = (reading(formats()), writing(formats()));
    convert(&inputs, &files.at(output), selection, merge, &read, &write)
}

#[track_caller]
fn done(files: &Files, inputs: &[&str], output: &str, selection: &Selection) -> Converted {
    converted(files, inputs, output, selection, false).unwrap_or_else(|error| panic!("{error}"))
}

/// A wavy ball with colours, intensities and times, and nothing that would be estimated.
fn ball() -> Cloud {
    ball_of(POINTS)
}

/// So few points that a load does not look around for the sides of normals that are left out.
const FEW: usize = 900;

fn ball_of(n: usize) -> Cloud {
    let intensities = (0..n).map(|i| (i % 5000) as u16).collect();
    let times = (0..n).map(|i| 1000.0 + i as f64 / 8.0).collect();
    let columns = vec![
        Column::new(INTENSITY, 1, Buffer::U16(intensities)),
        Column::new("gps_time", 1, Buffer::F64(times)),
    ];
    clouds::wavy_sphere(n).with_columns(columns).unwrap()
}

#[track_caller]
fn assert_same(a: &Cloud, b: &Cloud, what: &str) {
    let names = |cloud: &Cloud| {
        let mut names: Vec<String> = cloud.columns().iter().map(|c| c.name().to_owned()).collect();
        names.sort();
        names
    };
    assert_eq!(names(a), names(b), "{what}");
    assert_eq!((places(a), a.faces()), (places(b), b.faces()), "{what}");
    for column in a.columns().iter().filter(|column| column.name() != POSITION) {
        let other = b.column(column.name()).unwrap();
        assert!(column.values() == other.values(), "{what}: `{}` differs", column.name());
    }
}

/// Invariant: a conversion makes what reading and writing the whole cloud make, point by point
#[test]
fn what_is_streamed_is_what_reading_and_writing_make() {
    let files = Files::new();
    files.write("in.ply", &ball());
    for (from, to) in [
        ("in.ply", "a.las"),
        ("a.las", "b.laz"),
        ("b.laz", "c.pcd"),
        ("c.pcd", "d.e57"),
        ("d.e57", "e.sfl"),
        ("c.pcd", "f.ply"),
        ("f.ply", "g.xyz"),
        ("g.xyz", "h.pts"),
        ("h.pts", "i.ptx"),
    ] {
        let converted = done(&files, &[from], to, &Selection::default());
        assert_eq!((converted.n_read, converted.n_written), (POINTS as u64, POINTS as u64), "{to}");
        let loaded = files.read(from);
        let whole = format!("whole-{to}");
        // Without what a load adds, since a conversion estimates nothing.
        let given = |cloud: Cloud| match loaded.summary.normals.given {
            0 => cloud.without_column(NORMAL),
            _ => cloud,
        };
        let given = |cloud: Cloud| match loaded.summary.radii.given {
            0 => given(cloud).without_column(RADIUS),
            _ => given(cloud),
        };
        files.write(&whole, &given(loaded.cloud.clone()));
        // LAS 1.2 stays 1.2; a cloud in memory does not say what it is from, and 1.4 has another field.
        let [found, whole] = [to, whole.as_str()]
            .map(|name| files.read(name).cloud.without_column("scanner_channel"));
        assert_same(&found, &whole, &format!("{from} to {to}"));
    }
}

#[test]
fn a_mesh_keeps_its_triangles_unless_points_are_left_out() {
    let files = Files::new();
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    files.put("in.obj", mesh.as_bytes());
    done(&files, &["in.obj"], "out.ply", &Selection::default());
    assert_same(&files.read("in.obj").cloud, &files.read("out.ply").cloud, "obj to ply");
    assert_eq!(files.read("out.ply").cloud.faces().len(), 4);
    let thinned = Selection { every: 2, ..Selection::default() };
    assert_eq!(done(&files, &["in.obj"], "out.ply", &thinned).n_written, 2);
    assert!(files.read("out.ply").cloud.faces().is_empty());
    // A format without triangles says so.
    let lost = done(&files, &["in.obj"], "out.las", &Selection::default()).lost;
    assert!(lost.iter().any(|line| line.contains("triangle")), "{lost:?}");
}

/// Two scans side by side: numbers 0 to 99 along x, each turned in its own axes.
fn two_scans(files: &Files) {
    let turned = |angle| Pose {
        rotation: DQuat::from_rotation_z(angle),
        translation: DVec3::new(100.0, 0.0, 0.0),
    };
    let scan = |first: u16, pose: Pose| {
        let numbers = first..first + 50;
        let place = |number: u16| {
            pose.back(DVec3::new(f64::from(number), f64::from(number % 7), f64::from(number % 3)))
        };
        let places: Vec<DVec3> = numbers.clone().map(place).collect();
        InMemoryCloud::at(&places).with(INTENSITY, 1, Buffer::U16(numbers.collect()))
    };
    let clouds = [(0, turned(0.5)), (50, turned(-1.0))];
    let clouds =
        clouds.map(|(first, pose)| scan(first, pose).standing(&format!("scan {first}"), pose));
    write(files, "org.surfelshop.e57/e57", "two.e57", clouds.to_vec());
}

/// Numbers of the points that are in a file.
fn numbers(files: &Files, name: &str) -> Vec<f64> {
    values(&files.read(name).cloud, INTENSITY)
}

#[test]
fn a_box_is_cropped_in_common_coordinates() {
    let files = Files::new();
    two_scans(&files);
    // No point lies on a face, where its rounding would decide.
    let low = DVec3::new(39.5, -100.0, -100.0);
    let selection =
        Selection { crop: Some([low, DVec3::new(60.5, 100.0, 100.0)]), ..Selection::default() };
    let expected: Vec<f64> = (40..=60).map(f64::from).collect();
    for output in ["out.e57", "out.ply", "out.pcd", "out.ptx"] {
        let converted = done(&files, &["two.e57"], output, &selection);
        assert_eq!((converted.n_read, converted.n_written), (100, 21), "{output}");
        if output == "out.ptx" {
            // Intensities are fractions there.
            assert_eq!(files.read(output).cloud.len(), 21);
            continue;
        }
        assert_eq!(numbers(&files, output), expected, "{output}");
        for (place, number) in places(&files.read(output).cloud).iter().zip(&expected) {
            assert!((place.x - number).abs() < 1e-4, "{output}: {number} lies at {place}");
        }
    }
}

#[test]
fn every_so_many_th_point_of_all_is_kept() {
    let files = Files::new();
    two_scans(&files);
    let selection = Selection { every: 7, ..Selection::default() };
    let converted = done(&files, &["two.e57"], "out.ply", &selection);
    let expected: Vec<f64> = (0..100).step_by(7).map(f64::from).collect();
    assert_eq!(converted.n_written, expected.len() as u64);
    assert_eq!(numbers(&files, "out.ply"), expected);
}

#[test]
fn only_columns_that_are_named_are_kept() {
    let (files, ball) = (Files::new(), ball_of(FEW));
    files.write("in.ply", &ball);
    let named = |names: &[&str]| Selection {
        columns: Some(names.iter().map(|&name| name.to_owned()).collect()),
        ..Selection::default()
    };
    let unknown = named(&[INTENSITY, "no_such_column"]);
    let refused = converted(&files, &["in.ply"], "out.ply", &unknown, false).unwrap_err();
    assert!(refused.to_string().contains("no cloud has a column `no_such_column`"), "{refused}");
    assert!(!files.at("out.ply").exists());
    let selection = named(&[INTENSITY]);
    for output in ["out.ply", "out.pcd", "out.las"] {
        let converted = done(&files, &["in.ply"], output, &selection);
        assert_eq!(converted.columns, [POSITION, INTENSITY], "{output}");
        let cloud = files.read(output).cloud;
        assert!(cloud.column(COLOR).is_none(), "{output}");
        assert!(cloud.column("gps_time").is_none(), "{output}");
        assert_eq!(
            cloud.column(INTENSITY).unwrap().values(),
            ball.column(INTENSITY).unwrap().values()
        );
    }
}

/// Invariant: 16-bit colours that hold 8-bit values are taken for those, streamed or not
#[test]
fn narrow_colours_of_16_bits_keep_their_brightness() {
    let files = Files::new();
    let places = places(&ball_of(FEW));
    for (most, is_narrow) in [(255, true), (256, false)] {
        let mut colors: Vec<u16> = (0..3 * FEW).map(|i| (i % 7) as u16 * 36).collect();
        colors[3 * FEW - 1] = most;
        let given = InMemoryCloud::at(&places).with(COLOR, 3, Buffer::U16(colors));
        write(&files, "org.surfelshop.las/las", "in.las", vec![given]);
        let loaded = files.read("in.las").cloud;
        // PCD has 8 bits.
        let outputs = ["out.las", "out.ply", "out.e57", "out.pcd"];
        for output in &outputs[..if is_narrow { 4 } else { 3 }] {
            let done = done(&files, &["in.las"], output, &Selection::default());
            let told = done.warnings.iter().any(|line| line.contains("hold 8-bit values"));
            assert_eq!(told, is_narrow, "{output}: {:?}", done.warnings);
            let found = files.read(output).cloud;
            assert_eq!(found.linear_colors(), loaded.linear_colors(), "{output}");
        }
    }
}

#[test]
fn scans_stay_apart_or_become_one() {
    let files = Files::new();
    two_scans(&files);
    converted(&files, &["two.e57"], "apart.e57", &Selection::default(), false).unwrap();
    converted(&files, &["two.e57"], "merged.e57", &Selection::default(), true).unwrap();
    let [two, apart, merged] =
        ["two.e57", "apart.e57", "merged.e57"].map(|name| files.read(name).cloud);
    assert_eq!(apart.source().scans.len(), 2);
    for (a, b) in two.source().scans.iter().zip(&apart.source().scans) {
        assert_eq!(a.name, b.name);
        assert!(a.pose.translation.distance(b.pose.translation) < 1e-9, "{a:?} {b:?}");
    }
    assert_eq!(merged.source().scans.len(), 1);
    for cloud in [&apart, &merged] {
        assert_eq!(values(cloud, SCAN), values(&two, SCAN));
        let pairs = places(&two).into_iter().zip(places(cloud));
        let off = pairs.map(|(a, b)| a.distance(b)).fold(0.0, f64::max);
        assert!(off < 1e-4, "{off}");
    }
}

#[test]
fn several_files_become_one_with_a_column_of_their_numbers() {
    let files = Files::new();
    two_scans(&files);
    files.write("ball.ply", &ball());
    let converted = done(&files, &["ball.ply", "two.e57"], "out.ply", &Selection::default());
    assert_eq!(converted.n_written, POINTS as u64 + 100);
    let cloud = files.read("out.ply").cloud;
    let scans = values(&cloud, SCAN);
    let count = |number: f64| scans.iter().filter(|scan| **scan == number).count();
    assert_eq!([0.0, 1.0, 2.0].map(count), [POINTS, 50, 50]);
    // What the other file lacks is no number.
    let times = values(&cloud, "gps_time");
    assert!(times[..POINTS].iter().all(|time| time.is_finite()));
    assert!(times[POINTS..].iter().all(|time| time.is_nan()));
}

#[test]
fn places_that_are_no_numbers_are_left_out_and_counted() {
    let files = Files::new();
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float \
                z\nproperty uchar n\nend_header\n0 0 0 0\nnan 0 0 1\n1 0 0 2\n0 inf 0 3\n";
    files.put("in.ply", text.as_bytes());
    for output in ["out.ply", "out.las", "out.pcd"] {
        let converted = done(&files, &["in.ply"], output, &Selection::default());
        assert_eq!((converted.n_written, converted.n_not_finite), (2, 2), "{output}");
        assert_eq!(values(&files.read(output).cloud, "n"), [0.0, 2.0], "{output}");
    }
}

/// Invariant: organised clouds keep their grids from format to format, empty places and all
#[test]
fn grids_are_kept_with_their_empty_places() {
    let files = Files::new();
    let head = "VERSION .7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 3\nHEIGHT 2\n\
                DATA ascii\n";
    let rows = "1 0 0 0.5\nnan nan nan 0\n3 0 1 0.25\n4 0 0 1\n5 5 5 1\nnan nan nan 0\n";
    files.put("in.pcd", format!("{head}{rows}").as_bytes());
    let grid = |name: &str| {
        let read = reading(formats());
        inspect(files.at(name), &read).unwrap().clouds[0].header.grid
    };
    let all = Selection::default();
    for (from, to) in
        [("in.pcd", "a.pcd"), ("a.pcd", "b.ptx"), ("b.ptx", "c.ptx"), ("c.ptx", "d.pcd")]
    {
        let converted = done(&files, &[from], to, &all);
        assert_eq!((converted.n_written, converted.n_not_finite), (6, 0), "{to}");
        assert_eq!(grid(to), Some([3, 2]), "{to}");
        let (found, expected) = (files.read(to).cloud, files.read("in.pcd").cloud);
        assert_eq!(places(&found), places(&expected), "{to}");
        assert_eq!(values(&found, INTENSITY), [0.5, 0.25, 1.0, 1.0], "{to}");
    }
    // What knows no grids gets no places without a point, and says so; what was thinned is no grid any more.
    let converted = done(&files, &["in.pcd"], "e.las", &all);
    assert_eq!((converted.n_written, converted.n_not_finite), (4, 2));
    assert!(converted.lost.iter().any(|line| line.contains("grid")), "{:?}", converted.lost);
    let half = Selection { every: 2, ..Selection::default() };
    assert_eq!(done(&files, &["in.pcd"], "f.pcd", &half).n_written, 3);
    assert_eq!(grid("f.pcd"), None);
}

/// Invariant: a conversion that fails names the file at fault and leaves what stood there before
#[test]
fn a_conversion_that_fails_leaves_what_stood_there() {
    let files = Files::new();
    files.write("in.las", &ball());
    let bytes = std::fs::read(files.at("in.las")).unwrap();
    files.put("damaged.laz", b"LASF and nothing more");
    files.put("cut.e57", b"ASTM-E57 and nothing more");
    files.put("empty.las", b"");
    let before = files.names();
    for (inputs, output, words) in [
        (&["in.las", "damaged.laz"][..], "in.las", "damaged.laz: "),
        (&["in.las", "cut.e57"], "in.las", "cut.e57: "),
        (&["empty.las"], "in.las", "empty.las: expected a point cloud, found an empty file"),
        (&["in.las", "nowhere.las"], "in.las", "nowhere.las: cannot be read"),
        (&["in.las"], "out.stl", "out.stl: expected a name that ends in"),
        (&["in.las"], "out.nonsense", "out.nonsense: expected a name that ends in"),
    ] {
        let error = converted(&files, inputs, output, &Selection::default(), false).unwrap_err();
        let line = error.to_string();
        assert!(line.contains(words) && !line.contains('\n'), "{line}");
        assert!(std::fs::read(files.at("in.las")).unwrap() == bytes, "{line}");
        assert_eq!(files.names(), before, "{line}");
    }
}

/// Invariant: a box that no point lies in leaves nothing behind and says where the points are, whatever a head says
/// Cost: milliseconds
#[test]
fn boxes_without_a_point_are_refused_by_the_points() {
    let files = Files::new();
    let places: Vec<DVec3> = (0..20).map(|i| DVec3::splat(f64::from(i) / 4.0)).collect();
    let (las, _) = write(&files, "las", "in.las", vec![InMemoryCloud::at(&places)]);
    // A head with other bounds than its points have: largest and smallest x.
    let mut bytes = std::fs::read(&las).unwrap();
    bytes[179..187].copy_from_slice(&900f64.to_le_bytes());
    bytes[187..195].copy_from_slice(&800f64.to_le_bytes());
    std::fs::write(&las, bytes).unwrap();
    let of = |low: f64, high: f64| Selection {
        crop: Some([DVec3::splat(low), DVec3::splat(high)]),
        ..Selection::default()
    };
    assert_eq!(done(&files, &["in.las"], "out.pcd", &of(0.0, 1.0)).n_written, 5);
    for name in ["none.pcd", "none.ply", "none.e57"] {
        let error = converted(&files, &["in.las"], name, &of(7.0, 900.0), false).unwrap_err();
        let line = error.to_string();
        let says = "no point lies in the box; the points reach from 0.0,0.0,0.0 to 4.75,4.75,4.75";
        assert!(line.contains(says), "{line}");
        assert!(!files.names().iter().any(|file| file.starts_with("none")), "{:?}", files.names());
    }
}
