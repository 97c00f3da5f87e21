//! `smooth`.

use super::*;
use crate::smooth::{Apply, Mode, Settings, Smooth};

/// A sphere with noise along its normals of this share of the spacing, and noisy normals.
fn rough(n: u32, share: f64) -> TestCloud {
    let spacing = (4.0 * std::f64::consts::PI / f64::from(n)).sqrt();
    let directions = sphere(n);
    let seeds = 0u64..;
    let positions: Vec<Vec3> = directions
        .iter()
        .zip(seeds)
        .map(|(d, seed)| (d.as_dvec3() * (1.0 + share * spacing * noise(seed))).as_vec3())
        .collect();
    let normal = |(d, seed): (&Vec3, u64)| {
        let tilt = DVec3::new(noise(3 * seed), noise(3 * seed + 1), noise(3 * seed + 2));
        (d.as_dvec3() + 0.3 * tilt).normalize_or(DVec3::Z).as_vec3()
    };
    let normals: Vec<Vec3> = directions.iter().zip(9000u64..).map(normal).collect();
    TestCloud::new(&positions, &normals, 0.05)
}

/// The volume, as that of a sphere whose cubed radius is the mean, and the deviation of radii.
fn volume_and_noise(places: &[Vec3]) -> (f64, f64) {
    let radii: Vec<f64> = places.iter().map(|place| place.as_dvec3().length()).collect();
    let n = radii.len() as f64;
    let mean = radii.iter().sum::<f64>() / n;
    let noise = (radii.iter().map(|radius| (radius - mean).powi(2)).sum::<f64>() / n).sqrt();
    (radii.iter().map(|radius| radius.powi(3)).sum::<f64>() / n, noise)
}

#[test]
fn noise_goes_and_the_volume_stays() {
    let cloud = rough(4000, 0.3);
    let (before, noise_before) = volume_and_noise(&cloud.places());
    for rounds in [1, 5, 50] {
        let params = Settings { rounds, ..Default::default() };
        let ran = run::<Smooth>(&cloud, &params).unwrap();
        let (after, noise_after) = volume_and_noise(&ran.vectors(POSITION));
        let change = after / before - 1.0;
        assert!(change.abs() < 2e-3, "{rounds} rounds: the volume changes by {change}");
        let most = if rounds == 1 { 0.6 } else { 0.3 };
        assert!(noise_after < most * noise_before, "{rounds}: {noise_after} of {noise_before}");
        let angle = |(n, p): (Vec3, Vec3)| f64::from(n.dot(p.normalize_or(Vec3::Z))).acos();
        let angles = ran.vectors(NORMAL).into_iter().zip(ran.vectors(POSITION)).map(angle);
        let mean = angles.sum::<f64>() / 4000.0;
        assert!(
            mean < if rounds == 1 { 0.12 } else { 0.05 },
            "{rounds}: normals are off by {mean}"
        );
    }
}

/// A sphere with waves of this height.
fn wavy(height: f64) -> TestCloud {
    let directions = sphere(6000);
    let radius = |d: &Vec3| 1.0 + height * (30.0 * f64::from(d.x)).sin();
    let positions: Vec<Vec3> =
        directions.iter().map(|d| (d.as_dvec3() * radius(d)).as_vec3()).collect();
    TestCloud::new(&positions, &directions, 0.05)
}

#[test]
fn enhancing_makes_waves_higher_and_keeps_the_volume() {
    let cloud = wavy(0.01);
    let (before, waves_before) = volume_and_noise(&cloud.places());
    let of = |mode, strength| {
        let params = Settings { mode, strength, scale: 2.0, ..Default::default() };
        volume_and_noise(&run::<Smooth>(&cloud, &params).unwrap().vectors(POSITION))
    };
    let (volume, waves) = of(Mode::Enhance, 0.6);
    assert!(waves > 1.3 * waves_before && waves < 2.3 * waves_before, "{waves} of {waves_before}");
    assert!((volume / before - 1.0).abs() < 2e-3);
    let (_, none) = of(Mode::Enhance, 0.0);
    assert!((none / waves_before - 1.0).abs() < 1e-3);
    let (_, smoothed) = of(Mode::Smooth, 0.6);
    assert!(smoothed < 0.6 * waves_before);
}

#[test]
fn edges_stay_sharp_where_the_crease_is_small() {
    let cloud = shapes::cuboid(Vec3::splat(-1.0), Vec3::ONE, 0.08);
    let params = Settings { crease: 30.0, rounds: 10, ..Default::default() };
    let ran = run::<Smooth>(&cloud, &params).unwrap();
    for (before, after) in cloud.places().iter().zip(ran.vectors(POSITION)) {
        assert!(before.distance(after) < 1e-3, "{before} {after}");
    }
    let blunt = run::<Smooth>(&cloud, &Settings { crease: 180.0, rounds: 10, ..params }).unwrap();
    let moved = cloud.places().into_iter().zip(blunt.vectors(POSITION));
    assert!(moved.map(|(a, b)| a.distance(b)).fold(0.0, f32::max) > 1e-3);
}

#[test]
fn what_does_not_apply_stays_and_tangents_turn_along() {
    let mut cloud = rough(600, 0.3);
    cloud.colors = vec![9; 1800];
    let normals: Vec<Vec3> = cloud.normals.chunks_exact(3).map(Vec3::from_slice).collect();
    let tangents: Vec<Vec3> = normals.iter().map(|n| 0.1 * n.any_orthonormal_vector()).collect();
    cloud.others.push(("tangent_u", 3, flat(&tangents)));
    let of = |apply| run::<Smooth>(&cloud, &Settings { apply, ..Default::default() }).unwrap();
    assert_eq!(of(Apply::Positions).names(), ["position"]);
    assert_eq!(of(Apply::Normals).names(), ["normal", "tangent_u"]);
    let ran = of(Apply::Both);
    assert_eq!(ran.names(), ["position", "normal", "tangent_u"]);
    for (normal, tangent) in ran.vectors(NORMAL).iter().zip(ran.vectors("tangent_u")) {
        assert!(normal.dot(tangent).abs() < 1e-6 && (tangent.length() - 0.1).abs() < 1e-6);
    }
    assert!(ran.message.starts_with("600 surfels moved by 0."), "{}", ran.message);
}

#[test]
fn scale_and_place_change_nothing() {
    let cloud = rough(500, 0.3);
    let plain = run::<Smooth>(&cloud, &Settings::default()).unwrap().vectors(POSITION);
    for scale in [1024.0 * 1024.0, 1.0 / 1_048_576.0] {
        let mut other = cloud.clone();
        other.origin = DVec3::splat(1e6);
        other.positions.iter_mut().for_each(|x| *x *= scale);
        let scaled = run::<Smooth>(&other, &Settings::default()).unwrap().vectors(POSITION);
        for (a, b) in plain.iter().zip(scaled) {
            assert!(a.distance(b / scale) < 1e-6);
        }
    }
}

#[test]
fn odd_clouds_are_smoothed_or_refused_and_runs_stop() {
    for cloud in odd_clouds() {
        for mode in [Mode::Smooth, Mode::Enhance] {
            let ran = run::<Smooth>(&cloud, &Settings { mode, ..Default::default() }).unwrap();
            let places = ran.vectors(POSITION).into_iter().zip(cloud.places());
            assert!(places.filter(|(_, p)| p.is_finite()).all(|(after, _)| after.is_finite()));
            assert!(ran.vectors(NORMAL).iter().all(|n| (n.length() - 1.0).abs() < 1e-6));
        }
    }
    let params = Settings::default();
    assert!(refusal::<Smooth>(&TestCloud::default(), &params).contains("empty cloud"));
    let bare = TestCloud { normals: vec![], ..rough(50, 0.1) };
    assert!(refusal::<Smooth>(&bare, &params).contains("the tool `normals`"));
    let wrong = Settings { strength: f64::NAN, ..Default::default() };
    assert!(refusal::<Smooth>(&rough(50, 0.1), &wrong).contains("`strength`"));
    stops_everywhere::<Smooth>(&rough(150, 0.1), &Settings { rounds: 2, ..params });
}
