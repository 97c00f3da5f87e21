//! Axes and transforms.

use super::clouds::{column, read};
use super::files::{Made, bytes_of, file_behind, resolution, root_of, set};
use surfelshop_api::columns::Element;
use surfelshop_api::format::{Collected, UpAxis};
use surfelshop_api::glam::DVec3;

/// A surfel with position, normal, radius, or the two tangents in place of normal and radius.
fn disc() -> Made {
    let records = bytes_of(&[1.0, 2.0, 3.0, 0.0, 0.6, 0.8, 0.5]);
    set(1, 28, &[1 | 1 << 1 | 1 << 4], &[(0, 0), (1, 12), (4, 24)]).child(resolution(1, &records))
}

fn ellipse() -> Made {
    let records = bytes_of(&[1.0, 2.0, 3.0, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    set(1, 36, &[1 | 1 << 24], &[(0, 0), (24, 12)]).child(resolution(1, &records))
}

fn axes(root: Made, [right, up, back]: [[f32; 3]; 3]) -> Made {
    root.floats(0x0110, &right).floats(0x0111, &up).floats(0x0112, &back)
}

fn read_root(root: &Made) -> Collected {
    read(&file_behind(&[], root)).unwrap()
}

fn vector(found: &Collected, name: &str) -> DVec3 {
    DVec3::from_slice(&column(&found.clouds[0], name))
}

fn assert_near(found: DVec3, expected: [f64; 3]) {
    assert!((found - DVec3::from(expected)).length() < 1e-6, "{found} {expected:?}");
}

/// Row by row.
const MOVED_QUARTER_TURN: [f32; 16] =
    [0.0, -1.0, 0.0, 10.0, 1.0, 0.0, 0.0, 20.0, 0.0, 0.0, 1.0, 30.0, 0.0, 0.0, 0.0, 1.0];

#[test]
fn rigid_transforms_are_poses() {
    let found = read_root(&root_of(vec![disc().floats(0x0161, &MOVED_QUARTER_TURN)]));
    let header = &found.clouds[0].header;
    assert_eq!(vector(&found, "position"), DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(header.columns[0].element, Element::F32);
    assert_eq!(header.pose.translation, DVec3::new(10.0, 20.0, 30.0));
    assert_near(header.pose.rotation * DVec3::X, [0.0, 1.0, 0.0]);
    assert_near(header.pose.place(DVec3::new(1.0, 2.0, 3.0)), [8.0, 21.0, 33.0]);
    // The same as 64-bit floats, with digits that 32 bits do not hold.
    let mut wide = MOVED_QUARTER_TURN.map(f64::from);
    wide[3] = 4_000_000.125;
    let found = read_root(&root_of(vec![disc().doubles(0x0161, &wide)]));
    assert_eq!(found.clouds[0].header.pose.translation.x, 4_000_000.125);
}

#[test]
fn axes_turn_the_surfels_so_that_y_is_up() {
    // y to the right, z upwards and x back.
    let z_up = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
    let found = read_root(&axes(root_of(vec![disc()]), z_up));
    assert_eq!(vector(&found, "position"), DVec3::new(2.0, 3.0, 1.0));
    assert_eq!(found.clouds[0].header.up, UpAxis::Y);
    assert_near(vector(&found, "normal"), [0.6, 0.8, 0.0]);
    assert_eq!(found.clouds[0].header.columns[0].element, Element::F32);
    // Everything that the host makes of it is C T p.
    let found = read_root(&axes(root_of(vec![disc().floats(0x0161, &MOVED_QUARTER_TURN)]), z_up));
    let pose = found.clouds[0].header.pose;
    assert_near(pose.place(vector(&found, "position")), [21.0, 33.0, 8.0]);
    // T n = (-0.6, 0, 0.8).
    assert_near(pose.rotation * vector(&found, "normal"), [0.0, 0.8, -0.6]);
}

/// Invariant: coordinates of files whose x or z points up, as they are written here, stay
#[test]
fn axes_that_point_up_otherwise_are_said_and_coordinates_stay() {
    let z_up = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]];
    let x_up = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    for (rows, up) in [(z_up, UpAxis::Z), (x_up, UpAxis::X)] {
        let found =
            read_root(&axes(root_of(vec![disc().floats(0x0161, &MOVED_QUARTER_TURN)]), rows));
        let header = &found.clouds[0].header;
        assert_eq!((vector(&found, "position"), header.up), (DVec3::new(1.0, 2.0, 3.0), up));
        assert_near(header.pose.place(DVec3::new(1.0, 2.0, 3.0)), [8.0, 21.0, 33.0]);
        assert_near(vector(&found, "normal"), [0.0, 0.6, 0.8]);
    }
}

#[test]
fn axes_that_mirror_keep_normals_outside() {
    let mirrored = [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let found = read_root(&axes(root_of(vec![disc()]), mirrored));
    assert_eq!(vector(&found, "position"), DVec3::new(-1.0, 2.0, 3.0));
    assert_near(vector(&found, "normal"), [0.0, 0.6, 0.8]);
    let found = read_root(&axes(root_of(vec![ellipse()]), mirrored));
    let [normal, u, v] = ["normal", "tangent_u", "tangent_v"].map(|name| vector(&found, name));
    assert_near(normal, [0.0, 0.0, 1.0]);
    assert_near(u, [-2.0, 0.0, 0.0]);
    assert_near(v, [0.0, -1.0, 0.0]);
    assert_near(u.cross(v).normalize_or_zero(), [0.0, 0.0, 1.0]);
}

fn diagonal(x: f32, y: f32, z: f32) -> [f32; 16] {
    [x, 0.0, 0.0, 10.0, 0.0, y, 0.0, 20.0, 0.0, 0.0, z, 30.0, 0.0, 0.0, 0.0, 1.0]
}

#[test]
fn scales_are_applied_to_surfels() {
    let found = read_root(&root_of(vec![disc().floats(0x0161, &diagonal(2.0, 2.0, 2.0))]));
    let header = &found.clouds[0].header;
    assert_eq!(vector(&found, "position"), DVec3::new(12.0, 24.0, 36.0));
    assert_eq!((header.columns[0].element, header.pose), (Element::F64, Default::default()));
    assert_eq!(column(&found.clouds[0], "radius"), [1.0]);
    assert_near(vector(&found, "normal"), [0.0, 0.6, 0.8]);
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    // A disc in the plane of x and y; x and y are stretched by 3 and 5.
    let flat = bytes_of(&[1.0, 2.0, 3.0, 0.0, 0.0, 1.0, 0.5]);
    let flat =
        set(1, 28, &[1 | 1 << 1 | 1 << 4], &[(0, 0), (1, 12), (4, 24)]).child(resolution(1, &flat));
    let found = read_root(&root_of(vec![flat.floats(0x0161, &diagonal(3.0, 5.0, 7.0))]));
    assert!((column(&found.clouds[0], "radius")[0] - 0.5 * 15.0_f64.sqrt()).abs() < 1e-6);
    assert!(found.warnings[0].contains("stretches"), "{:?}", found.warnings);
    // Normals are those of the stretched surface: here through (0, 4, -3).
    let found = read_root(&root_of(vec![disc().floats(0x0161, &diagonal(1.0, 2.0, 3.0))]));
    let surface = DVec3::new(0.0, 8.0, -9.0);
    assert!(vector(&found, "normal").dot(surface).abs() < 1e-6);
    assert!((vector(&found, "normal").length() - 1.0).abs() < 1e-6);
}

#[test]
fn transforms_that_mirror_turn_the_second_tangent_round() {
    let found = read_root(&root_of(vec![ellipse().floats(0x0161, &diagonal(1.0, 1.0, -3.0))]));
    assert_near(vector(&found, "position"), [11.0, 22.0, 21.0]);
    assert_near(vector(&found, "normal"), [0.0, 0.0, -1.0]);
    let (u, v) = (vector(&found, "tangent_u"), vector(&found, "tangent_v"));
    assert_near(u.cross(v), [0.0, 0.0, -2.0]);
    assert_eq!(column(&found.clouds[0], "radius"), [2.0]);
}

#[test]
fn boxes_follow_the_surfels() {
    let bounds = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    let turned = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
    let found = read_root(&axes(root_of(vec![disc().floats(0x0118, &bounds)]), turned));
    let expected = [DVec3::new(2.0, 3.0, 1.0), DVec3::new(5.0, 6.0, 4.0)];
    assert_eq!(found.clouds[0].header.bounds, Some(expected));
    let not_finite = [1.0, 2.0, 3.0, 4.0, f32::NAN, 6.0];
    let found = read_root(&root_of(vec![disc().floats(0x0118, &not_finite)]));
    assert_eq!(found.clouds[0].header.bounds, None);
}

#[test]
fn transforms_and_axes_that_are_none_are_said_and_left_out() {
    let mut nan = diagonal(1.0, 1.0, 1.0);
    nan[5] = f32::NAN;
    let mut perspective = diagonal(1.0, 1.0, 1.0);
    perspective[12] = 0.5;
    let cases =
        [(nan, "not finite"), (perspective, "perspective"), (diagonal(1.0, 0.0, 1.0), "flattens")];
    for (matrix, why) in cases {
        let found = read_root(&root_of(vec![disc().floats(0x0161, &matrix)]));
        assert!(found.warnings[0].contains(why), "{:?}", found.warnings);
        assert_eq!(vector(&found, "position"), DVec3::new(1.0, 2.0, 3.0));
    }
    let found = read_root(&root_of(vec![disc().floats(0x0161, &[1.0; 4])]));
    assert!(found.warnings[0].contains("expected 16 numbers"), "{:?}", found.warnings);
    let flat = [[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    let found = read_root(&axes(root_of(vec![disc()]), flat));
    assert!(found.warnings[0].contains("axes"), "{:?}", found.warnings);
    assert_eq!(vector(&found, "position"), DVec3::new(1.0, 2.0, 3.0));
}
