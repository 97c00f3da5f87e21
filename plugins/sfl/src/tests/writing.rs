//! Clouds that are written, and read again.

use super::clouds::{Numbers, TestCloud, column, discs, read, write, write_with};
use crate::read::Buffer;
use crate::settings::{NormalChoice, Settings};
use crate::surfel::color::ColorModel;
use crate::surfel::layout::{Layout, Normals};
use crate::surfel::normal_code::Cube;
use surfelshop_api::columns::{COLOR, NORMAL, TANGENT_U, TANGENT_V};
use surfelshop_api::format::{CollectedCloud, Pose, UpAxis};
use surfelshop_api::glam::{DQuat, DVec3};

/// The clouds of what is written, and what was said.
fn round_trip(clouds: &[TestCloud]) -> (Vec<CollectedCloud>, Vec<String>) {
    let (bytes, lines) = write(clouds);
    let found = read(&bytes).unwrap();
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    (found.clouds, lines)
}

/// Whether a column is what it was.
fn same(cloud: &TestCloud, found: &CollectedCloud, name: &str) {
    let (_, values) = cloud.columns.iter().find(|(column, _)| column.name == name).unwrap();
    let expected: Vec<f64> = values.values().iter_f64().collect();
    assert_eq!(column(found, name), expected, "{name}");
}

fn floats(len: usize, seed: u64) -> Buffer {
    let mut numbers = Numbers(seed);
    Buffer::F32((0..len).map(|_| numbers.single()).collect())
}

fn bytes(len: usize, seed: u64) -> Buffer {
    let mut numbers = Numbers(seed);
    Buffer::U8((0..len).map(|_| numbers.next() as u8).collect())
}

#[test]
fn discs_come_back() {
    let n = 100;
    let cloud = discs(n).with("specular", 3, bytes(3 * n, 1)).with(
        "flags",
        1,
        Buffer::U32((0..n as u32).map(|i| i << 5).collect()),
    );
    let (found, lines) = round_trip(std::slice::from_ref(&cloud));
    for name in ["position", "radius", "color", "specular", "flags"] {
        same(&cloud, &found[0], name);
    }
    let found_normals = column(&found[0], NORMAL);
    let Buffer::F32(normals) = &cloud.columns[1].1 else { panic!("normals are floats") };
    for (found, normal) in found_normals.iter().zip(normals) {
        assert!((found - f64::from(*normal)).abs() < 1e-4);
    }
    assert_eq!(lines.len(), 1, "{lines:?}");
    assert!(lines[0].contains("normals are rounded") && lines[0].contains("normals=float"));
    // What was read from codes is written without loss, and said to be.
    let mut again = discs(n);
    again.columns[1].1 = Buffer::F32(found_normals.iter().map(|&v| v as f32).collect());
    let (found, lines) = round_trip(&[again]);
    assert_eq!(column(&found[0], NORMAL), found_normals);
    assert!(lines.is_empty(), "{lines:?}");
}

#[test]
fn normals_as_floats_stay_what_they_are() {
    let cloud = discs(50);
    let settings = Settings { normals: NormalChoice::Float };
    let (bytes, lines) = write_with(std::slice::from_ref(&cloud), &settings).unwrap();
    assert!(lines.is_empty(), "{lines:?}");
    let found = read(&bytes).unwrap();
    for name in ["position", "normal", "radius", "color"] {
        same(&cloud, &found.clouds[0], name);
    }
    assert!(found.clouds[0].header.format.contains("float normals"));
}

#[test]
fn ellipses_come_back_without_normals_and_radii() {
    let n = 30;
    let cloud = TestCloud::new(&[[0.5, 0.25, 0.125]; 30])
        .with(TANGENT_U, 3, floats(3 * n, 1))
        .with(TANGENT_V, 3, floats(3 * n, 2))
        .with("texture", 2, floats(2 * n, 3));
    let (found, lines) = round_trip(std::slice::from_ref(&cloud));
    assert!(lines.is_empty(), "{lines:?}");
    for name in [TANGENT_U, TANGENT_V, "texture"] {
        same(&cloud, &found[0], name);
    }
    let of = |name: &str, i: usize| DVec3::from_slice(&column(&found[0], name)[3 * i..]);
    for i in 0..n {
        let (u, v) = (of(TANGENT_U, i), of(TANGENT_V, i));
        assert!((of(NORMAL, i) - u.cross(v).normalize_or_zero()).length() < 1e-6);
        let radius = column(&found[0], "radius")[i];
        assert!((radius - u.length().max(v.length())).abs() < 1e-6);
    }
}

#[test]
fn everything_that_is_read_is_written() {
    let n = 20;
    let shares = Buffer::F32((0..n).map(|i| i as f32 / 255.0).collect());
    let cloud = discs(n)
        .with("ambient", 3, bytes(3 * n, 1))
        .with("ambient_coefficient", 1, shares.clone())
        .with("diffuse_coefficient", 1, shares.clone())
        .with("specular_coefficient", 1, shares)
        .with("shininess", 1, bytes(n, 2))
        .with("weight", 1, floats(n, 3))
        .with("sampling_density", 3, floats(3 * n, 4))
        .with("isovalue", 1, floats(n, 5))
        .with("origin_cell", 1, Buffer::U32((0..n as u32).collect()))
        .with("camera_depth", 1, floats(n, 6))
        .with("camera_id", 1, bytes(n, 7))
        .with("camera_xy", 2, Buffer::U16((0..2 * n as u16).collect()))
        .with("camera_angles", 2, floats(2 * n, 8));
    let (found, lines) = round_trip(std::slice::from_ref(&cloud));
    for (column, _) in cloud.columns.iter().filter(|(column, _)| column.name != NORMAL) {
        same(&cloud, &found[0], &column.name);
    }
    assert_eq!(found[0].header.columns.len(), cloud.columns.len());
    assert_eq!(lines.len(), 1, "{lines:?}");
}

#[test]
fn records_are_laid_out_as_pointshop3d_has_them() {
    let coded = |properties: &[usize]| {
        let layout =
            Layout::arranged(properties, Normals::Code(Cube::Cub32), Some(ColorModel::Rgba));
        let places: Vec<usize> = layout.properties().map(|(_, place)| place).collect();
        (layout.record, layout.bits(), places)
    };
    let ordinary = coded(&[0, 1, 4, 10, 12, 27]);
    assert_eq!(ordinary, (32, vec![0x080f_141f], vec![0, 12, 16, 24, 28, 20]));
    let surfel1 = coded(&[0, 1, 4, 7, 9, 10, 11, 12, 13, 14, 27]);
    let places = vec![0, 12, 16, 20, 32, 33, 37, 38, 42, 43, 28];
    assert_eq!(surfel1, (44, vec![0x080f_7e9f], places));
    let elliptical = coded(&[0, 1, 7, 9, 10, 11, 12, 13, 14, 24, 27]);
    let places = vec![0, 12, 16, 52, 53, 57, 58, 62, 63, 24, 48];
    assert_eq!(elliptical, (64, vec![0x090f_7e8f], places));
}

#[test]
fn what_a_file_cannot_hold_is_said() {
    let mut cloud = TestCloud::new(&[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
        .with("intensity", 1, floats(2, 1))
        .with("ao", 1, floats(2, 2))
        .with(TANGENT_U, 3, floats(6, 3))
        .with("shininess", 1, Buffer::F32(vec![3.5, 300.0]))
        .with("weight", 1, Buffer::F64(vec![0.1, 0.2]))
        .with("texture", 3, floats(6, 4))
        .with(COLOR, 4, Buffer::U16(vec![65535, 0, 257, 300, 514, 770, 0, 65535]));
    cloud.header.has_faces = true;
    cloud.header.coordinate_system = "EPSG:32632".to_owned();
    cloud.header.up = UpAxis::Unknown;
    let (bytes, lines) = write(&[cloud]);
    let expected = [
        "columns `ao`, `intensity` are left out: surfels of SFL have no such property",
        "column `tangent_u` is left out: surfels of SFL have two tangents of three numbers",
        "column `texture` is left out: surfels of SFL hold other types or numbers of components there",
        "`color` is rounded to 8 bits of sRGB",
        "`shininess` is rounded to whole numbers from 0 to 255",
        "`weight` is rounded to 32-bit floats",
        "SFL has no place for the coordinate reference system and the triangles",
        "a cloud does not say which axis points up: the file says y",
    ];
    assert_eq!(lines, expected);
    let found = &read(&bytes).unwrap().clouds[0];
    assert_eq!(column(found, "shininess"), [4.0, 255.0]);
    assert_eq!(column(found, COLOR), [255.0, 0.0, 1.0, 1.0, 2.0, 3.0, 0.0, 255.0]);
}

#[test]
fn linear_colours_are_encoded() {
    let linear = Buffer::F32(vec![0.0, 1.0, 0.214_041_14, -1.0, 7.0, f32::NAN]);
    let (found, lines) = round_trip(&[TestCloud::new(&[[0.0; 3]; 2]).with(COLOR, 3, linear)]);
    assert_eq!(column(&found[0], COLOR), [0.0, 255.0, 128.0, 0.0, 255.0, 0.0]);
    assert_eq!(lines, ["`color` is rounded to 8 bits of sRGB"]);
}

#[test]
fn positions_far_from_zero_are_stored_around_an_origin() {
    let places = [[4_321_000.123, 987_654.321, 512.01], [4_321_010.456, 987_660.5, 513.02]];
    let (found, lines) = round_trip(&[TestCloud::new(&places)]);
    let pose = found[0].header.pose;
    assert_eq!(pose.rotation, DQuat::IDENTITY);
    assert!(pose.translation.distance(DVec3::from(places[0])) < 16.0, "{}", pose.translation);
    let own = column(&found[0], "position");
    for (own, place) in own.chunks_exact(3).zip(places) {
        let error = (pose.place(DVec3::from_slice(own)) - DVec3::from(place)).length();
        assert!(error < 1e-6, "{error}");
    }
    assert!(lines[0].contains("`test` are stored relative to"), "{lines:?}");
    assert!(lines[1].contains("rounded to 32-bit floats"), "{lines:?}");
    // What 32-bit floats hold stays as it is.
    let exact = [[4_321_000.0, 0.5, 1.0], [4_321_000.5, 1.0, 1.0]];
    let (found, lines) = round_trip(&[TestCloud::new(&exact)]);
    assert_eq!(found[0].header.pose, Pose::default());
    assert_eq!(column(&found[0], "position"), exact.as_flattened());
    assert!(lines.is_empty(), "{lines:?}");
}

#[test]
fn several_clouds_stand_where_they_stood() {
    let pose = |angle: f64, x: f64| Pose {
        rotation: DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), angle),
        translation: DVec3::new(x, -3.25, 1e5 + 0.1),
    };
    let mut clouds = [discs(3), discs(4), discs(5)];
    clouds[1].header.pose = pose(1.0, 7.1);
    clouds[2].header.pose = pose(-2.5, 1e6 + 0.3);
    clouds[0].header.name = String::new();
    clouds[2].header.name = "third".to_owned();
    let (found, _lines) = round_trip(&clouds);
    let names: Vec<&str> = found.iter().map(|cloud| cloud.header.name.as_str()).collect();
    assert_eq!(names, ["surfelSet00", "test", "third"]);
    for (cloud, found) in clouds.iter().zip(&found) {
        let (before, after) = (cloud.header.pose, found.header.pose);
        assert!(before.translation.distance(after.translation) < 1e-9);
        assert!(before.rotation.dot(after.rotation).abs() > 1.0 - 1e-15);
        same(cloud, found, "position");
        let [low, high] = found.header.bounds.unwrap();
        let own = column(found, "position");
        for axis in 0..3 {
            let values = || own.iter().copied().skip(axis).step_by(3);
            assert_eq!(low[axis], values().fold(f64::INFINITY, f64::min));
            assert_eq!(high[axis], values().fold(f64::NEG_INFINITY, f64::max));
        }
    }
}

#[test]
fn what_points_up_stays_up() {
    let up = |axis: UpAxis| {
        let mut cloud = TestCloud::new(&[[1.0, 2.0, 3.0]]);
        cloud.header.up = axis;
        let (found, _) = round_trip(&[cloud]);
        assert_eq!(column(&found[0], "position"), [1.0, 2.0, 3.0]);
        found[0].header.up
    };
    assert_eq!(up(UpAxis::Unknown), UpAxis::Y);
    for axis in [UpAxis::X, UpAxis::Y, UpAxis::Z] {
        assert_eq!(up(axis), axis);
    }
}

#[test]
fn what_is_known_of_a_scene_is_written() {
    let mut cloud = discs(2);
    cloud.header.metres_per_unit = 0.5;
    let comments = ["title: T", "author: A", "description: D", "version: 12", "date: today"];
    cloud.header.comments = comments.map(str::to_owned).to_vec();
    let (found, lines) = round_trip(std::slice::from_ref(&cloud));
    let header = &found[0].header;
    let expected = [
        "title: T",
        "author: A",
        "application: Surfelshop",
        "description: D",
        "date: today",
        "version: 12",
    ];
    assert_eq!(header.comments, expected);
    assert_eq!((header.time.as_str(), header.metres_per_unit), ("today", 0.5));
    assert_eq!(lines.len(), 1, "{lines:?}");
    cloud.header.comments.push("made by hand".to_owned());
    assert_eq!(round_trip(&[cloud]).1.len(), 2);
}

#[test]
fn there_is_a_cloud_and_not_too_many() {
    assert!(write_with(&[], &Settings::default()).unwrap_err().to_string().contains("found none"));
    let (found, lines) = round_trip(&[TestCloud::new(&[])]);
    assert_eq!((found.len(), found[0].header.rows), (1, Some(0)));
    assert!(lines.is_empty(), "{lines:?}");
    let clouds = vec![TestCloud::new(&[]); 1023];
    assert_eq!(round_trip(&clouds).0.len(), 1023);
    let clouds = vec![TestCloud::new(&[]); 1024];
    let line = write_with(&clouds, &Settings::default()).unwrap_err().to_string();
    assert!(line.contains("at most 1023 clouds"), "{line}");
    let line = write_with(&[TestCloud::new(&[[1e300; 3]])], &Settings::default());
    assert!(line.unwrap_err().to_string().contains("within the range of 32-bit floats"));
}

#[test]
fn origins_of_sets_that_are_turned_are_turned_with_them() {
    let places = [[4_321_000.123, 987_654.321, 512.01], [4_321_010.456, 987_660.5, 513.02]];
    let mut cloud = TestCloud::new(&places);
    let pose =
        Pose { rotation: DQuat::from_rotation_z(0.7), translation: DVec3::new(5.5, -6.25, 0.1) };
    cloud.header.pose = pose;
    let (bytes, lines) = write(&[cloud]);
    assert!(lines[0].contains("stored relative to"), "{lines:?}");
    let found = &read(&bytes).unwrap().clouds[0];
    let own = column(found, "position");
    for (own, place) in own.chunks_exact(3).zip(places) {
        let expected = pose.place(DVec3::from(place));
        let placed = found.header.pose.place(DVec3::from_slice(own));
        assert!(placed.distance(expected) < 1e-6, "{placed} {expected}");
    }
}

#[test]
fn the_box_of_the_scene_holds_all_sets_where_they_stand() {
    let mut clouds = [TestCloud::new(&[[0.0; 3], [1.0, 2.0, 3.0]]), TestCloud::new(&[[4.0; 3]])];
    clouds[0].header.pose.rotation = DQuat::from_rotation_z(std::f64::consts::PI);
    clouds[0].header.pose.translation = DVec3::new(0.0, 0.0, 10.0);
    let (bytes, _) = write(&clouds);
    // The first entry of the tag is the root's.
    let entry = bytes.windows(8).position(|w| w == [0x01, 0x18, 0, 6, 0, 0, 0, 6]).unwrap();
    let place = u32::from_be_bytes(bytes[entry + 8..entry + 12].try_into().unwrap()) as usize;
    let floats = bytes[place..place + 24].chunks_exact(4);
    let found: Vec<f32> = floats.map(|f| f32::from_be_bytes(f.try_into().unwrap())).collect();
    // (1, 2, 3) stands at (-1, -2, 13).
    for (found, expected) in found.iter().zip([-1.0, -2.0, 4.0, 4.0, 4.0, 13.0]) {
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }
}
