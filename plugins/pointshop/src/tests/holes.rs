//! `fill-holes`.

use super::*;
use crate::holes::{FillHoles, Settings};

/// The surfels whose places fit.
fn without(cloud: &TestCloud, goes: impl Fn(Vec3) -> bool) -> TestCloud {
    let stays: Vec<bool> = cloud.places().into_iter().map(|place| !goes(place)).collect();
    fn chosen<T: Copy>(values: &[T], n: usize, stays: &[bool]) -> Vec<T> {
        let rows = values.chunks_exact(n).zip(stays).filter(|(_, stays)| **stays);
        rows.flat_map(|(row, _)| row.to_vec()).collect()
    }
    TestCloud {
        origin: cloud.origin,
        positions: chosen(&cloud.positions, 3, &stays),
        normals: chosen(&cloud.normals, 3, &stays),
        radii: chosen(&cloud.radii, 1, &stays),
        colors: chosen(&cloud.colors, 3, &stays),
        others: cloud
            .others
            .iter()
            .map(|(name, n, values)| (*name, *n, chosen(values, *n as usize, &stays)))
            .collect(),
    }
}

/// Discs of a result: place, normal, radius.
fn discs(ran: &ToolOutput) -> Vec<(Vec3, Vec3, f32)> {
    let normals = ran.vectors(NORMAL).into_iter().zip(ran.floats(RADIUS));
    ran.vectors(POSITION).into_iter().zip(normals).map(|(p, (n, r))| (p, n, r)).collect()
}

/// Whether a ray meets a disc.
fn is_met(discs: &[(Vec3, Vec3, f32)], from: Vec3, along: Vec3) -> bool {
    discs.iter().any(|(place, normal, radius)| {
        let far = normal.dot(*place - from) / normal.dot(along);
        far > 0.0 && (from + far * along).distance(*place) <= *radius
    })
}

#[test]
fn a_cap_of_a_sphere_comes_back() {
    let whole = ball(5000);
    let spacing = (4.0 * std::f32::consts::PI / 5000.0).sqrt();
    let axis = Vec3::new(0.3, -0.5, 0.8).normalize_or(Vec3::Z);
    for degrees in [6f32, 20.0, 40.0, 60.0] {
        let cut = degrees.to_radians().cos();
        let cloud = without(&whole, |place| place.dot(axis) > cut);
        let params = Settings { largest: 3.0 };
        let ran = run::<FillHoles>(&cloud, &params).unwrap();
        let (n, discs) = (cloud.radii.len(), discs(&ran));
        assert!(ran.message.starts_with("1 hole filled with "), "{}", ran.message);
        let new = &discs[n..];
        for (place, normal, _) in new {
            let off = (place.length() - 1.0).abs();
            assert!(off < 0.05 * spacing, "{degrees} degrees: {off} off, spacing {spacing}");
            assert!(normal.dot(*place) > 0.999, "{degrees} degrees");
            assert!(place.dot(axis) > cut - 2.0 * spacing);
        }
        // About as many as there were, and those that overlap the rim.
        let gone = whole.radii.len() - n;
        let rim = (2.0 * std::f32::consts::PI * degrees.to_radians().sin() / spacing) as usize;
        let most = gone + 2 * rim + 8;
        assert!(new.len() > gone / 2 && new.len() < most + gone, "{} for {gone}", new.len());
        for direction in sphere(20_000).iter().filter(|d| d.dot(axis) > cut - 0.1) {
            assert!(is_met(&discs, Vec3::ZERO, *direction), "{degrees} degrees: {direction}");
        }
        let marks = ran.bytes("filled");
        assert!(marks[..n].iter().all(|mark| *mark == 0) && marks[n..].iter().all(|m| *m == 1));
    }
}

/// A wavy sheet with colours that change along x.
fn sheet(side: usize) -> TestCloud {
    let (mut positions, mut normals, mut colors) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..side * side {
        let wobble = |k: usize| 0.25 * noise((2 * i + k) as u64) as f32;
        let (x, y) = ((i % side) as f32 + wobble(0), (i / side) as f32 + wobble(1));
        positions.push(Vec3::new(x, y, wave(x, y)));
        let slope = Vec3::new(-0.2 * (0.1 * x).cos(), 0.0, 1.0);
        normals.push(slope.normalize_or(Vec3::Z));
        colors.extend([(4 * (i % side)) as u8, 100, 7]);
    }
    TestCloud { colors, ..TestCloud::new(&positions, &normals, 0.9) }
}

fn wave(x: f32, _y: f32) -> f32 {
    2.0 * (0.1 * x).sin()
}

#[test]
fn holes_of_any_shape_are_filled_and_outer_borders_stay() {
    let whole = sheet(60);
    // An L, and a disc with an island.
    let goes = |p: Vec3| {
        let ell = p.x > 8.0 && p.y > 8.0 && p.x < 24.0 && p.y < 24.0 && (p.x < 14.0 || p.y < 14.0);
        let far = (p.truncate() - surfelshop_api::glam::Vec2::new(42.0, 42.0)).length();
        ell || far > 2.5 && far < 8.0
    };
    let mut cloud = without(&whole, goes);
    cloud.others.push(("height", 1, cloud.places().iter().map(|p| p.z).collect()));
    let n = cloud.radii.len();
    let ran = run::<FillHoles>(&cloud, &Settings { largest: 30.0 }).unwrap();
    let discs = discs(&ran);
    assert_eq!(ran.names(), ["position", "normal", "radius", "color", "height", "filled"]);
    assert!(ran.message.ends_with("borders are wider than 30.000000 and stay"), "{}", ran.message);
    for (place, normal, _) in &discs[n..] {
        assert!(goes(*place) || discs[..n].iter().any(|(p, _, _)| p.distance(*place) < 1.5));
        assert!((place.z - wave(place.x, place.y)).abs() < 0.15, "{place}");
        assert!(normal.z > 0.9);
    }
    for i in 0..6400 {
        let (x, y) = (2.0 + 0.7 * (i % 80) as f32, 2.0 + 0.7 * (i / 80) as f32);
        assert!(is_met(&discs, Vec3::new(x, y, 50.0), -Vec3::Z), "a hole at {x} {y}");
    }
    // Colours lie between those around, and follow them.
    let (colors, heights) = (ran.bytes("color"), ran.floats("height"));
    for (i, (place, _, _)) in discs.iter().enumerate().skip(n) {
        let expected = 4.0 * place.x;
        let found = f32::from(colors[3 * i]);
        assert!((found - expected).abs() < 30.0, "{found} at {place}");
        assert!(colors[3 * i + 1].abs_diff(100) <= 1 && colors[3 * i + 2].abs_diff(7) <= 1);
        assert!((heights[i] - place.z).abs() < 1.5);
    }
}

#[test]
fn what_is_whole_stays_as_it_is() {
    for cloud in [ball(3000), sheet(30)] {
        let ran = run::<FillHoles>(&cloud, &Settings::default());
        let host = ran.map(|ran| (ran.staged.len(), ran.message)).unwrap();
        assert_eq!(host.0, 0, "{}", host.1);
        assert!(host.1.starts_with("0 holes filled with 0 surfels"), "{}", host.1);
    }
    // A box is open nowhere, though its surfels lie beside its edges.
    let cuboid = shapes::cuboid(Vec3::ZERO, Vec3::new(3.0, 2.0, 1.0), 0.1);
    let ran = run::<FillHoles>(&cuboid, &Settings { largest: 10.0 }).unwrap();
    let n = cuboid.radii.len();
    if !ran.staged.is_empty() {
        let new = discs(&ran).len() - n;
        assert_eq!(new, 0, "{}", ran.message);
    }
}

#[test]
fn scale_and_place_change_nothing() {
    let cloud = without(&ball(2000), |place| place.z > 0.9);
    let plain = run::<FillHoles>(&cloud, &Settings::default()).unwrap();
    for scale in [1024f32.powi(2), 1024f32.powi(-2)] {
        let mut other = cloud.clone();
        other.origin = DVec3::splat(1e6);
        other.positions.iter_mut().for_each(|x| *x *= scale);
        other.radii.iter_mut().for_each(|r| *r *= scale);
        let scaled = run::<FillHoles>(&other, &Settings::default()).unwrap();
        let (a, b) = (plain.vectors(POSITION), scaled.vectors(POSITION));
        assert_eq!(a.len(), b.len());
        assert!(a.iter().zip(b).all(|(a, b)| a.distance(b / scale) < 1e-5));
    }
}

#[test]
fn odd_clouds_and_splats_are_refused_or_left_and_runs_stop() {
    for cloud in odd_clouds() {
        let ran = run::<FillHoles>(&cloud, &Settings { largest: 100.0 }).unwrap();
        assert!(ran.staged.is_empty(), "{}", ran.message);
    }
    assert!(refusal::<FillHoles>(&TestCloud::default(), &Settings::default()).contains("empty"));
    let mut splats = ball(50);
    splats.others.push(("splat_scale", 3, vec![0.1; 150]));
    let line = refusal::<FillHoles>(&splats, &Settings::default());
    assert!(line.contains("Gaussian splats"), "{line}");
    let cloud = without(&ball(400), |place| place.z > 0.8);
    stops_everywhere::<FillHoles>(&cloud, &Settings { largest: 3.0 });
}
