//! `register`.

use super::shapes::{TemporaryFile, ply_text};
use super::*;
use crate::register::{Register, Settings, Start};
use crate::transform;
use surfelshop_api::glam::DQuat;

/// Points of a lumpy body without symmetries, `seed` choosing which.
fn body(n: u32, seed: u64) -> TestCloud {
    let radius = |d: DVec3| {
        1.0 + 0.25 * (2.0 * d.x + 0.5).sin()
            + 0.2 * (3.0 * d.y + d.z).cos()
            + 0.3 * d.z * d.z
            + 0.4 * d.x
            + 0.2 * d.y
    };
    let place = |d: DVec3| {
        let d = d.normalize_or(DVec3::X);
        radius(d) * d * DVec3::new(1.6, 1.0, 0.7)
    };
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    for (i, d) in sphere(n).into_iter().enumerate() {
        let i = 9 * i as u64 + seed;
        let d = (d.as_dvec3() + 0.02 * DVec3::new(noise(i), noise(i + 3), noise(i + 6)))
            .normalize_or(DVec3::X);
        let (u, v) = d.any_orthonormal_pair();
        let along = |t: DVec3| place(d + 1e-5 * t) - place(d - 1e-5 * t);
        let normal = along(u).cross(along(v)).normalize_or(d);
        positions.push(place(d).as_vec3());
        normals.push((if normal.dot(d) < 0.0 { -normal } else { normal }).as_vec3());
    }
    TestCloud::new(&positions, &normals, 0.05)
}

/// The cloud moved, and by what.
fn moved(cloud: &TestCloud, turn: DQuat, by: DVec3) -> TestCloud {
    let mut moved = cloud.clone();
    let map = |values: &[f32], by: DVec3| -> Vec<f32> {
        let vectors = values.chunks_exact(3).map(Vec3::from_slice);
        vectors.flat_map(|v| (turn * v.as_dvec3() + by).as_vec3().to_array()).collect()
    };
    moved.positions = map(&cloud.positions, by);
    moved.normals = map(&cloud.normals, DVec3::ZERO);
    moved
}

/// Where the tool puts places of the cloud that it was run with.
fn placed(ran: &ToolOutput) -> Vec<DVec3> {
    let EditHeader::NewCloud { origin, .. } = &ran.staged[0].0 else { panic!() };
    ran.vectors(POSITION).into_iter().map(|p| *origin + p.as_dvec3()).collect()
}

fn turn(degrees: f64) -> DQuat {
    DQuat::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize_or(DVec3::X), degrees.to_radians())
}

/// The farthest that a place is from where it was before the motion.
fn worst(ran: &ToolOutput, truth: &TestCloud) -> f64 {
    let pairs = placed(ran).into_iter().zip(truth.places());
    pairs.map(|(a, b)| a.distance(truth.origin + b.as_dvec3())).fold(0.0, f64::max)
}

#[test]
fn other_points_of_the_same_surface_are_put_back() {
    let fixed = body(6000, 0);
    let file = TemporaryFile::new("fixed.ply", ply_text(&fixed, false).as_bytes());
    let own = body(5000, 77);
    for (degrees, by, start) in [
        (0.5, DVec3::new(0.01, 0.0, -0.02), Start::Place),
        (20.0, DVec3::new(0.1, -0.15, 0.1), Start::Place),
        (20.0, DVec3::new(40.0, -15.0, 7.0), Start::Centres),
        (170.0, DVec3::new(-3.0, 8.0, 1.0), Start::Axes),
    ] {
        let cloud = moved(&own, turn(degrees), by);
        let params =
            Settings { to: file.path(), start, overlap: 1.0, samples: 2000, ..Default::default() };
        let ran = run::<Register>(&cloud, &params).unwrap();
        let off = worst(&ran, &own);
        // A spacing is about 0.06.
        assert!(off < 2e-3, "{degrees} degrees: {off} off; {}", ran.message);
        assert!(!ran.message.contains("not settled"), "{}", ran.message);
    }
}

#[test]
fn parts_that_have_no_counterpart_have_no_say() {
    let fixed = body(6000, 0);
    let file = TemporaryFile::new("whole.ply", ply_text(&fixed, false).as_bytes());
    let own = body(5000, 77);
    // A fifth of the cloud is of something else that stands beside it.
    let mut cloud = own.clone();
    for (i, place) in cloud.positions.chunks_exact_mut(3).enumerate().take(1000) {
        place[2] = 2.5 + 0.3 * noise(i as u64) as f32;
    }
    let cloud = moved(&cloud, turn(8.0), DVec3::new(0.1, 0.05, 0.0));
    let off_with = |overlap| {
        let params = Settings { to: file.path(), overlap, samples: 2000, ..Default::default() };
        let ran = run::<Register>(&cloud, &params).unwrap();
        let pairs = placed(&ran).into_iter().zip(own.places()).skip(1000);
        pairs.map(|(a, b)| a.distance(b.as_dvec3())).fold(0.0, f64::max)
    };
    let (trimmed, whole) = (off_with(0.7), off_with(1.0));
    assert!(trimmed < 5e-3, "{trimmed}");
    assert!(whole > 4.0 * trimmed, "{whole} {trimmed}");
}

#[test]
fn the_motion_told_is_that_of_transform_and_far_origins_lose_nothing() {
    let mut fixed = body(3000, 0);
    fixed.origin = DVec3::new(3e6, 5e6, 100.0);
    let file = TemporaryFile::new("far-fixed.ply", ply_text(&fixed, false).as_bytes());
    let mut own = body(3000, 5);
    own.origin = fixed.origin;
    let cloud = moved(&own, turn(5.0), DVec3::new(0.05, 0.0, 0.02));
    let params = Settings { to: file.path(), overlap: 1.0, ..Default::default() };
    let ran = run::<Register>(&cloud, &params).unwrap();
    assert!(worst(&ran, &own) < 4e-3, "{} {}", worst(&ran, &own), ran.message);
    let mut settings = transform::Settings::default();
    let words = ran.message.split(' ').filter_map(|word| word.split_once('='));
    let mut n_words = 0;
    for (name, value) in words {
        if name == "about" {
            assert_eq!(value, "centre");
            settings.about = transform::About::Centre;
            continue;
        }
        let value: f64 = value.parse().unwrap();
        match name {
            "rotate-x" => settings.rotate_x = value,
            "rotate-y" => settings.rotate_y = value,
            "rotate-z" => settings.rotate_z = value,
            "translate-x" => settings.translate_x = value,
            "translate-y" => settings.translate_y = value,
            "translate-z" => settings.translate_z = value,
            _ => panic!("{name}"),
        }
        n_words += 1;
    }
    assert_eq!(n_words, 6, "{}", ran.message);
    let again = run::<transform::Transform>(&cloud, &settings).unwrap();
    for (a, b) in placed(&ran).into_iter().zip(placed(&again)) {
        assert!(a.distance(b) < 3e-6, "{a} {b}");
    }
    // Longer lines are cut by the host.
    assert!(ran.message.len() <= 300, "{}", ran.message);
}

#[test]
fn what_cannot_be_registered_is_refused_and_runs_stop() {
    let fixed = ball(300);
    let file = TemporaryFile::new("ball.ply", ply_text(&fixed, false).as_bytes());
    assert!(refusal::<Register>(&fixed, &Settings::default()).contains("found no file"));
    let params = Settings { to: file.path(), ..Default::default() };
    let mut inverted = fixed.clone();
    inverted.normals.iter_mut().for_each(|n| *n = -*n);
    let line = refusal::<Register>(&inverted, &params);
    assert!(line.contains("found 0 pairs"), "{line}");
    let wrong = Settings { overlap: f64::NAN, ..params.clone() };
    assert!(refusal::<Register>(&fixed, &wrong).contains("`overlap`"));
    // A sphere slides on itself, and comes to rest all the same.
    let slid = moved(&fixed, turn(3.0), DVec3::new(0.05, 0.0, 0.0));
    let ran = run::<Register>(&slid, &params).unwrap();
    assert!(placed(&ran).iter().all(|p| (p.length() - 1.0).abs() < 5e-3), "{}", ran.message);
    for odd in &odd_clouds()[..3] {
        let result = run::<Register>(odd, &params);
        assert!(result.map_or_else(|e| e.to_string().contains("expected"), |_| true));
    }
    stops_everywhere::<Register>(&ball(60), &Settings { rounds: 3, ..params });
}

#[test]
fn pairs_that_are_about_right_start_from_anywhere() {
    let fixed = body(4000, 1);
    let file = TemporaryFile::new("pairs-fixed.ply", ply_text(&fixed, false).as_bytes());
    let own = body(4000, 5);
    // Upside down and far away: beyond what `place` and `axes` find alone.
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 0.3, 0.2).normalize_or(DVec3::X), 2.9);
    let by = DVec3::new(7.0, -3.0, 2.0);
    let cloud = moved(&own, turn, by);
    let pair = |i: usize| {
        let at = Vec3::from_slice(&own.positions[3 * i..]).as_dvec3();
        // Clicks miss by some spacings.
        let missed =
            at + 0.1 * DVec3::new(noise(i as u64), noise(i as u64 + 1), noise(i as u64 + 2));
        let DVec3 { x, y, z } = turn * at + by;
        format!("{x} {y} {z} {} {} {}", missed.x, missed.y, missed.z)
    };
    let typed = |n: usize| (0..n).map(|i| pair(i * 700 + 50)).collect::<Vec<_>>().join("; ");
    let params = |pairs: String| Settings {
        to: file.path(),
        start: Start::Pairs,
        overlap: 1.0,
        pairs,
        ..Default::default()
    };
    let ran = run::<Register>(&cloud, &params(typed(4))).unwrap();
    assert!(worst(&ran, &own) < 4e-3, "{} {}", worst(&ran, &own), ran.message);
    assert!(refusal::<Register>(&cloud, &params(typed(2))).contains("found 2"));
    assert!(refusal::<Register>(&cloud, &params("1 2 3".to_owned())).contains("6 numbers"));
    for line in [
        "0.1 0.1 0.1 0.7 0.7 0.7; 0.1 0.1 0.1 0.7 0.7 0.7; 0.1 0.1 0.1 0.7 0.7 0.7",
        "0 0 0 0 0 0; 1 1 1 1 1 1; 2 2 2 2 2 2",
    ] {
        let said = refusal::<Register>(&cloud, &params(line.to_owned()));
        assert!(said.contains("not on one line"), "{said}");
    }
    let unsaid = Settings { start: Start::Axes, ..params(typed(4)) };
    assert!(refusal::<Register>(&cloud, &unsaid).contains("start=pairs"));
}
