//! `transform` and `deform`.

use super::*;
use crate::deform::{self, Deform};
use crate::linear::half_axes;
use crate::transform::{About, Mirror, Settings, Transform};
use surfelshop_api::glam::{DMat3, DQuat, Quat};
use surfelshop_geometry::harmonics;

impl ToolOutput {
    fn origin(&self) -> DVec3 {
        let EditHeader::NewCloud { origin, .. } = &self.staged[0].0 else { panic!() };
        *origin
    }
}

/// A ball with a column of each kind.
fn decorated() -> TestCloud {
    let mut cloud = ball(200);
    cloud.origin = DVec3::new(1000.0, -20.0, 3.0);
    cloud.colors = vec![77; 600];
    let normals: Vec<Vec3> = cloud.normals.chunks_exact(3).map(Vec3::from_slice).collect();
    let us: Vec<Vec3> = normals.iter().map(|n| 0.1 * n.any_orthonormal_vector()).collect();
    let vs: Vec<Vec3> = normals.iter().zip(&us).map(|(n, u)| 0.5 * n.cross(*u)).collect();
    let turns = |i: u64| {
        let numbers = [0, 1, 2, 3].map(|c| noise(4 * i + c) as f32);
        Quat::from_array(numbers).normalize().to_array()
    };
    let coefficients = |n: u64| (0..200 * n).map(|i| noise(9000 + i) as f32).collect();
    cloud.others = vec![
        ("tangent_u", 3, flat(&us)),
        ("tangent_v", 3, flat(&vs)),
        ("normal_field", 4, [0.1, 0.2, 0.3, 0.4].repeat(200)),
        ("clip", 7, [1.0, 0.0, 0.2, 0.0, 0.0, 1.0, 1.0].repeat(200)),
        ("splat_scale", 3, [0.3, 0.2, 0.1].repeat(200)),
        ("splat_rotation", 4, (0..200).flat_map(turns).collect()),
        ("sh_1", 9, coefficients(9)),
        ("sh_2", 15, coefficients(15)),
        ("height", 1, vec![5.0; 200]),
    ];
    cloud
}

#[test]
fn a_move_changes_no_bit_but_the_origin() {
    let cloud = decorated();
    let params = Settings { translate_x: 0.1, translate_z: 1e6, ..Default::default() };
    let ran = run::<Transform>(&cloud, &params).unwrap();
    assert_eq!(ran.origin(), cloud.origin + DVec3::new(0.1, 0.0, 1e6));
    for column in &cloud.view().columns {
        if let Values::F32(values) = column.values {
            assert_eq!(ran.floats(column.name), values, "{}", column.name);
        }
    }
    assert_eq!(ran.bytes("color"), cloud.colors);
}

#[test]
fn four_quarter_turns_are_none_and_mirrors_undo_themselves() {
    let cloud = ball(500);
    let mut turned = cloud.clone();
    for _ in 0..4 {
        let params = Settings { rotate_y: 90.0, ..Default::default() };
        let ran = run::<Transform>(&turned, &params).unwrap();
        turned.positions = ran.floats(POSITION);
        turned.normals = ran.floats(NORMAL);
        turned.origin = ran.origin();
    }
    for (a, b) in cloud.places().iter().zip(turned.places()) {
        assert!((a.as_dvec3() - turned.origin - b.as_dvec3()).length() < 1e-6);
    }
    assert_eq!(cloud.normals, turned.normals);
    let mut cloud = decorated();
    let before = cloud.clone();
    for _ in 0..2 {
        let params = Settings { mirror: Mirror::Y, ..Default::default() };
        let ran = run::<Transform>(&cloud, &params).unwrap();
        cloud.origin = ran.origin();
        cloud.positions = ran.floats(POSITION);
        cloud.normals = ran.floats(NORMAL);
        cloud.others.iter_mut().for_each(|(name, _, values)| *values = ran.floats(name));
    }
    for ((name, _, a), (_, _, b)) in before.others.iter().zip(&cloud.others) {
        // A rotation and its negative are one.
        let near = |(a, b): (&f32, &f32)| {
            (a - b).abs() < 1e-5 || *name == "splat_rotation" && (a + b).abs() < 1e-5
        };
        assert!(a.iter().zip(b).all(near), "{name}");
    }
}

#[test]
fn every_column_is_transformed_by_what_it_holds() {
    let cloud = decorated();
    let params = Settings {
        rotate_x: 30.0,
        rotate_y: -50.0,
        rotate_z: 110.0,
        scale: 2.5,
        mirror: Mirror::X,
        translate_y: 7.0,
        ..Default::default()
    };
    let ran = run::<Transform>(&cloud, &params).unwrap();
    let turn = DQuat::from_rotation_z(110f64.to_radians())
        * DQuat::from_rotation_y(-50f64.to_radians())
        * DQuat::from_rotation_x(30f64.to_radians());
    let turn = DMat3::from_quat(turn) * DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
    let of = |name: &str| -> Vec<Vec3> { cloud.view().vectors(name).collect() };
    let places = ran.vectors(POSITION);
    for (i, place) in places.iter().enumerate() {
        let expected =
            2.5 * turn * (cloud.origin + of(POSITION)[i].as_dvec3()) + DVec3::new(0.0, 7.0, 0.0);
        assert!((ran.origin() + place.as_dvec3()).distance(expected) < 1e-5);
        let normal = ran.vectors(NORMAL)[i].as_dvec3();
        assert!(normal.distance(turn * of(NORMAL)[i].as_dvec3()) < 1e-6);
        let u = ran.vectors("tangent_u")[i].as_dvec3();
        assert!(u.distance(2.5 * turn * of("tangent_u")[i].as_dvec3()) < 1e-6);
    }
    assert!(ran.floats(RADIUS).iter().zip(&cloud.radii).all(|(a, b)| (a / b - 2.5).abs() < 1e-6));
    assert!((ran.floats("splat_scale")[0] - 0.75).abs() < 1e-6);
    assert_eq!(ran.floats("normal_field")[..4], [-0.1, -0.2, -0.3, -0.4]);
    assert_eq!(ran.floats("clip"), cloud.others[3].2);
    assert_eq!(ran.floats("height"), cloud.others[8].2);
    // A splat's shape, of axes and lengths, and what it radiates are those of the transformed one.
    let shape = |rotation: &[f32], scale: f64| {
        let q = DQuat::from_array([0, 1, 2, 3].map(|i| f64::from(rotation[i])));
        let axes = DMat3::from_quat(q.normalize());
        let lengths = DVec3::new(0.3, 0.2, 0.1) * scale;
        axes * DMat3::from_diagonal(lengths * lengths) * axes.transpose()
    };
    let radiated = |row: &[f32], from: usize, n: usize, d: DVec3| {
        let basis = harmonics::basis(d);
        (0..n).map(|m| f64::from(row[3 * m]) * basis[from + m]).sum::<f64>()
    };
    let (rotations, before) = (ran.floats("splat_rotation"), &cloud.others[5].2);
    for i in 0..200 {
        let expected = turn * shape(&before[4 * i..], 2.5) * turn.transpose();
        assert!(shape(&rotations[4 * i..], 2.5).abs_diff_eq(expected, 1e-6));
        let d = DVec3::new(noise(3), noise(4), noise(5)).normalize_or(DVec3::X);
        for (column, from, n) in [(6, 1, 3), (7, 4, 5)] {
            let (name, components, values) = &cloud.others[column];
            let row = i * *components as usize..(i + 1) * *components as usize;
            let after = radiated(&ran.floats(name)[row.clone()], from, n, turn * d);
            assert!((after - radiated(&values[row], from, n, d)).abs() < 1e-5, "{name}");
        }
    }
}

#[test]
fn the_centre_stays_where_it_is_turned_about() {
    let cloud = decorated();
    let params =
        Settings { rotate_z: 33.0, scale: 0.1, about: About::Centre, ..Default::default() };
    let ran = run::<Transform>(&cloud, &params).unwrap();
    let middle = |places: &[Vec3], origin: DVec3| {
        places.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / 200.0 + origin
    };
    let moved = middle(&ran.vectors(POSITION), ran.origin());
    assert!(moved.distance(middle(&cloud.places(), cloud.origin)) < 0.01);
    let wrong = Settings { scale: 0.0, ..Default::default() };
    assert!(refusal::<Transform>(&cloud, &wrong).contains("`scale` above 0"));
    let wrong = Settings { rotate_x: f64::INFINITY, ..Default::default() };
    assert!(refusal::<Transform>(&cloud, &wrong).contains("`rotate-x`"));
    let huge = Settings { scale: 1e9, ..Default::default() };
    let far = TestCloud::new(&[Vec3::splat(1e35), Vec3::ZERO], &[Vec3::X; 2], 1.0);
    assert!(refusal::<Transform>(&far, &huge).contains("single precision"));
    assert!(refusal::<Transform>(&TestCloud::default(), &params).contains("empty cloud"));
    stops_everywhere::<Transform>(&cloud, &params);
}

fn lattice(text: &str) -> deform::Settings {
    deform::Settings { lattice: text.to_owned(), ..Default::default() }
}

#[test]
fn half_axes_span_the_same_ellipse() {
    let (a, b) = (DVec3::new(2.0, 0.5, 0.0), DVec3::new(-0.3, 1.0, 0.4));
    let (u, v, turn) = half_axes(a, b);
    assert!(u.dot(v).abs() < 1e-12 && u.length() >= v.length());
    // A place of one ellipse is the same one of the other.
    let (x, y) = (0.3, -0.8);
    let (p, q) = (turn.x * x - turn.y * y, turn.y * x + turn.x * y);
    assert!((x * u + y * v).distance(p * a + q * b) < 1e-12);
}

#[test]
fn a_lattice_of_eight_points_may_stretch_evenly() {
    let mut cloud = ball(1000);
    cloud.origin = DVec3::splat(5.0);
    // The four points of the largest x move by one width.
    let text = "2 2 2 # twice as long\n 1 0 0 1 0 0\n 1,1,0,1,0,0\n 1 0 1 1 0 0\n 1 1 1 1 0 0";
    let ran = run::<Deform>(&cloud, &lattice(text)).unwrap();
    let min = cloud.places().iter().fold(0f32, |min, p| min.min(p.x));
    let (us, vs) = (ran.vectors("tangent_u"), ran.vectors("tangent_v"));
    for (i, (before, after)) in cloud.places().iter().zip(ran.vectors(POSITION)).enumerate() {
        let expected = Vec3::new(min + 2.0 * (before.x - min), before.y, before.z);
        assert!(after.distance(expected) < 1e-5);
        // The normal of the ellipsoid, and the discs' ellipses in its tangent planes.
        let normal = Vec3::new(before.x / 2.0, before.y, before.z).normalize_or(Vec3::X);
        assert!(ran.vectors(NORMAL)[i].distance(normal) < 1e-5);
        assert!(us[i].dot(normal).abs() < 1e-5 && vs[i].dot(normal).abs() < 1e-5);
        assert!(us[i].dot(vs[i]).abs() < 1e-6);
        let (radius, area) = (cloud.radii[i], us[i].length() * vs[i].length());
        let cofactor = Vec3::new(before.x, 2.0 * before.y, 2.0 * before.z).length();
        assert!((area / (radius * radius) / cofactor - 1.0).abs() < 1e-4);
        assert!((ran.floats(RADIUS)[i] - us[i].length()).abs() < 1e-7);
    }
}

#[test]
fn derivatives_are_those_of_the_map() {
    let text = "3 4 2 1 2 1 0.4 -0.3 0.2  0 3 0 0.1 0.1 0.1  2 0 1 -0.2 0 0.3";
    let lattice = deform::lattice::Lattice::read(text).unwrap();
    let (at, step) = (DVec3::new(0.3, 0.6, 0.8), 1e-6);
    let (_, slope) = lattice.offset(at);
    for axis in 0..3 {
        let mut ahead = at;
        ahead[axis] += step;
        let mut behind = at;
        behind[axis] -= step;
        let measured = (lattice.offset(ahead).0 - lattice.offset(behind).0) / (2.0 * step);
        assert!(measured.distance(slope.col(axis)) < 1e-8, "{axis}");
    }
    // At a corner the map follows the control point.
    assert!(lattice.offset(DVec3::new(0.0, 1.0, 0.0)).0.distance(DVec3::splat(0.1)) < 1e-12);
}

#[test]
fn what_changes_nothing_keeps_discs_and_clip_lines_turn_along() {
    let mut cloud = ball(300);
    cloud.colors = vec![3; 900];
    let ran = run::<Deform>(&cloud, &lattice("2 2 2")).unwrap();
    assert_eq!(ran.names(), ["position", "normal", "radius", "color"]);
    assert_eq!(ran.floats(POSITION), cloud.positions);
    let mut cloud = decorated();
    cloud.others.retain(|(name, _, _)| !name.starts_with("splat") && !name.starts_with("sh_"));
    let ran = run::<Deform>(&cloud, &lattice("2 2 2 0 0 0 -0.3 0.1 0")).unwrap();
    let clip = ran.floats("clip");
    let (before, after) = (cloud.view(), &ran);
    for i in 0..200 {
        // The point where the line crosses the first axis, before, is on the line after.
        let line = &cloud.others[3].2[7 * i..];
        let (x, y) = (-line[2] / line[0], 0.25);
        let local = |u: Vec3, v: Vec3| x * u + y * v;
        let tangent = |name: &str| before.vectors(name).nth(i).unwrap();
        let at = local(tangent("tangent_u"), tangent("tangent_v"));
        let bent = deform::lattice::Lattice::read("2 2 2 0 0 0 -0.3 0.1 0").unwrap();
        let size = surfelshop_geometry::Bounds::of_positions(&cloud.places()).unwrap().size();
        let min = surfelshop_geometry::Bounds::of_positions(&cloud.places()).unwrap().min;
        let share = (cloud.places()[i].as_dvec3() - min) / size;
        let map = DMat3::IDENTITY
            + DMat3::from_diagonal(size) * bent.offset(share).1 * DMat3::from_diagonal(1.0 / size);
        let at = map * at.as_dvec3();
        let (u, v) =
            (after.vectors("tangent_u")[i].as_dvec3(), after.vectors("tangent_v")[i].as_dvec3());
        let place = (at.dot(u) / u.length_squared(), at.dot(v) / v.length_squared());
        let line: Vec<f64> = clip[7 * i..7 * i + 3].iter().map(|&c| f64::from(c)).collect();
        assert!((line[0] * place.0 + line[1] * place.1 + line[2]).abs() < 1e-5);
    }
}

#[test]
fn lattices_that_make_no_sense_are_refused() {
    let cloud = ball(100);
    for (text, expected) in [
        ("", "found 0 numbers"),
        ("2 2", "found 2 numbers"),
        ("1 2 2", "from 2 to 32, found `1`"),
        ("2 2 33", "found `33`"),
        ("2 2 2 0 0 2 0 0 0", "from 0 to 1, found `2`"),
        ("2 2 2 0 0 0 1 1", "found 5 after the last"),
        ("2 2 2 0 0 0 1 x 0", "found `x`"),
        ("2 2 2 0 0 0 1 NaN 0", "found `NaN`"),
        ("2 2 2 0 0 0 1 0 0 0 0 0 1 0 0", "0 0 0 twice"),
        ("2 2 2 0 0 0 3 0 0 0 0 1 3 0 0 0 1 0 3 0 0 0 1 1 3 0 0", "turned inside out"),
    ] {
        let line = refusal::<Deform>(&cloud, &lattice(text));
        assert!(line.contains(expected), "{line}");
    }
    let gone = deform::Settings { file: FilePath("no/such.txt".to_owned()), ..Default::default() };
    let line = run::<Deform>(&cloud, &gone).map(|_| ()).unwrap_err().to_string();
    assert!(line.starts_with("no/such.txt: "), "{line}");
    assert!(refusal::<Deform>(&decorated(), &lattice("2 2 2")).contains("Gaussian splats"));
    for odd in &odd_clouds()[..3] {
        run::<Deform>(odd, &lattice("2 2 2 0 0 0 0.1 0 0")).unwrap();
    }
    stops_everywhere::<Deform>(&ball(100), &lattice("3 3 3 1 1 1 0.1 0.1 0.1"));
}
