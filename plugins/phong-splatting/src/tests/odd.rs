//! Clouds that are hardly any, and numbers at the ends of what there is.

use super::audit::{AuditedSplat, n_uncovered};
use super::shapes::{moved, random, sphere};
use super::*;

fn of(points: &[Vec3], normals: &[Vec3]) -> TestCloud {
    TestCloud { positions: points.to_vec(), normals: normals.to_vec(), ..TestCloud::default() }
}

#[test]
fn a_few_samples_are_discs_of_their_own() {
    let one = TestCloud { radii: vec![0.25], ..of(&[Vec3::ONE], &[Vec3::Y]) };
    let splats = AuditedSplat::all(&one.run(&Settings::default()).unwrap());
    assert_eq!(splats.len(), 1);
    assert!(splats[0].at.distance(DVec3::ONE) < 1e-6 && splats[0].up.dot(DVec3::Y) > 0.999_999);
    // The octagon around a disc reaches a little farther.
    assert!((0.25..0.28).contains(&splats[0].half.min_element()), "{}", splats[0].half);
    // Far apart, and opposite: nothing joins them.
    let points = [Vec3::ZERO, Vec3::X * 100.0];
    let two = TestCloud { radii: vec![1.0; 2], ..of(&points, &[Vec3::Z, Vec3::Z]) };
    let splats = AuditedSplat::all(&two.run(&within(0.1)).unwrap());
    assert_eq!(splats.len(), 2);
    assert!(splats.iter().all(|splat| splat.half.max_element() < 1.1), "each is its own disc");
    let back =
        TestCloud { radii: vec![1.0; 2], ..of(&[Vec3::ZERO, Vec3::X], &[Vec3::Z, -Vec3::Z]) };
    let splats = AuditedSplat::all(&back.run(&within(0.1)).unwrap());
    assert_eq!(splats.len(), 2);
    assert!(splats[0].up.dot(splats[1].up) < -0.999);
}

/// A sample in the plane of a sheet, far from it.
#[test]
fn a_sample_beside_a_sheet_is_a_disc_of_its_own() {
    let sheet = (0..1600).map(|i| Vec3::new((i % 40) as f32, (i / 40) as f32, 0.0) * 0.01);
    let points: Vec<Vec3> = sheet.chain([Vec3::X * 2.0]).collect();
    let given = TestCloud { radii: vec![0.009; 1601], ..of(&points, &[Vec3::Z; 1601]) };
    let splats = AuditedSplat::all(&given.run(&Settings::default()).unwrap());
    let alone: Vec<&AuditedSplat> = splats.iter().filter(|splat| splat.at.x > 1.0).collect();
    assert!(alone.len() == 1 && alone[0].half.max_element() < 0.0099, "{}", splats.len());
    assert!(splats.iter().all(|splat| splat.half.max_element() < 0.4), "nothing bridges the gap");
}

#[test]
fn samples_on_a_line_keep_their_normals() {
    let points: Vec<Vec3> = (0..50).map(|i| Vec3::new(i as f32, 2.0 * i as f32, 0.0)).collect();
    let given = TestCloud { radii: vec![1.5; 50], ..of(&points, &[Vec3::Z; 50]) };
    let ran = given.run(&Settings::default()).unwrap();
    let splats = AuditedSplat::all(&ran);
    assert!(splats.len() < 10 && splats.iter().all(|splat| splat.up.z > 0.999), "{}", ran.message);
    assert_eq!(n_uncovered(&given, &given.radii, &splats, 0.1, 1e-6), 0);
}

#[test]
fn copies_count_once() {
    let mut given = sphere(3_000);
    let settings = within(0.01);
    let n = AuditedSplat::all(&given.run(&settings).unwrap()).len();
    given.positions.extend_from_within(..);
    given.normals.extend_from_within(..);
    assert_eq!(AuditedSplat::all(&given.run(&settings).unwrap()).len(), n);
    let heap = of(&[Vec3::ONE; 500], &[Vec3::X; 500]);
    assert_eq!(AuditedSplat::all(&heap.run(&settings).unwrap()).len(), 1);
}

#[test]
fn samples_that_are_no_numbers_are_left_out() {
    let mut given = sphere(2_000);
    given.positions[7] = Vec3::NAN;
    given.positions[8].y = f32::INFINITY;
    given.normals[9] = Vec3::ZERO;
    given.normals[10] = Vec3::NAN;
    given.radii = vec![0.08; 2_000];
    given.radii[11] = f32::NAN;
    given.radii[12] = -1.0;
    given.radii[13] = 0.0;
    let ran = given.run(&within(0.01)).unwrap();
    assert!(
        ran.message.contains("4 samples without a position or normal left out"),
        "{}",
        ran.message
    );
    AuditedSplat::all(&ran);
}

#[test]
fn single_normals_that_face_the_wrong_way_are_turned() {
    let mut given = sphere(5_000);
    let right = given.clone();
    let mut random = random(5);
    let mut n_wrong = 0;
    for normal in &mut given.normals {
        if random() < 0.01 {
            *normal = -*normal;
            n_wrong += 1;
        }
    }
    let ran = given.run(&within(0.01)).unwrap();
    assert!(ran.message.contains(&format!("{n_wrong} normals turned")), "{}", ran.message);
    let splats = AuditedSplat::all(&ran);
    assert!(splats.iter().all(|splat| splat.normal.dot(splat.at) > 0.9));
    assert_eq!(n_uncovered(&right, &[], &splats, 0.0347, 1e-6), 0);
}

#[test]
fn both_sides_of_a_thin_sheet_stay_apart() {
    let mut points = Vec::new();
    for (z, normal) in [(0.0, -DVec3::Z), (1e-4, DVec3::Z)] {
        points.extend(shapes::jittered(40, 40).map(|(x, y)| (DVec3::new(x, y, z), normal)));
    }
    let given = shapes::given(points.into_iter());
    let ran = given.run(&within(1e-3)).unwrap();
    let splats = AuditedSplat::all(&ran);
    let side = |z: f64| splats.iter().filter(|splat| splat.up.z * z > 0.999).count();
    assert!(side(1.0) > 0 && side(-1.0) > 0 && side(1.0) + side(-1.0) == splats.len());
    assert!(!ran.message.contains("turned"), "{}", ran.message);
    assert_eq!(n_uncovered(&given, &[], &splats, 1e-3 * 2f64.sqrt(), 1e-6), 0);
}

#[test]
fn scale_and_place_do_not_matter() {
    let given = sphere(3_000);
    let n = AuditedSplat::all(&given.run(&within(0.01)).unwrap()).len();
    for scale in [1e-20f32, 1e20] {
        let scaled = moved(&given, |point| point * scale);
        let ran = scaled.run(&within(0.01)).unwrap();
        let words = ["position", "radius", "tangent_u", "tangent_v", "normal_field", "normal"];
        assert!(words.iter().all(|name| ran.floats(name).iter().all(|value| value.is_finite())));
        assert!((ran.floats("radius").len()).abs_diff(n) <= n / 10, "{scale}");
    }
    // Where coordinates are much larger than the extent, all that is left is their rounding.
    let far = moved(&given, |point| point * 1e-3 + Vec3::splat(1000.0));
    AuditedSplat::all(&far.run(&within(0.01)).unwrap());
}

#[test]
fn noise_neither_fails_nor_flips() {
    let mut random = random(11);
    let mut given = sphere(3_000);
    for i in 0..3_000 {
        let mut noise = || Vec3::new(random() as f32, random() as f32, random() as f32) - 0.5;
        given.positions[i] += noise() * 0.1;
        given.normals[i] = (given.normals[i] + noise() * 2.0).normalize_or(Vec3::Z);
    }
    for tolerance in [1e-6, 1e-3, 0.1] {
        let splats = AuditedSplat::all(&given.run(&within(tolerance)).unwrap());
        assert!(splats.len() <= 3_100 && !splats.is_empty());
    }
}

#[test]
fn clouds_that_cannot_be_stood_for_are_refused() {
    assert!(TestCloud::default().refusal().contains("empty cloud"));
    let bare = TestCloud { normals: Vec::new(), ..sphere(10) };
    assert!(bare.refusal().contains("run the tool `normals` first"));
    assert!(of(&[Vec3::NAN; 3], &[Vec3::Z; 3]).refusal().contains("finite positions"));
    let settings = Settings { tolerance: f64::NAN, ..Settings::default() };
    let error = sphere(10).run(&settings).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("`tolerance`"), "{error}");
}

#[test]
fn a_run_stops_at_every_question() {
    let given = shapes::cube(6);
    for stops_at in 1.. {
        let host = RecordingHost { stops_at, ..RecordingHost::default() };
        let result = given.run_at(&within(0.01), &host);
        if host.n_checks.get() < stops_at {
            result.unwrap();
            let messages = host.messages.borrow();
            assert!(messages.windows(2).all(|pair| pair[0].0 <= pair[1].0 + 1e-12), "{messages:?}");
            assert_eq!(messages.last().map(|(fraction, _)| *fraction), Some(1.0));
            return;
        }
        assert_eq!(result.unwrap_err().message(), CANCELLED);
        assert!(host.staged.borrow().is_empty(), "stopped at {stops_at}");
    }
}
