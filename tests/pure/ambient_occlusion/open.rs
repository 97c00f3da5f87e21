//! Open, noisy, two-sided data: what `hybrid` finds with few rays is what many rays find.

use crate::ambient_occlusion::stage::rms;
use glam::Vec3;
use surfelshop_tests::clouds::Surfels;
use surfelshop_tests::occlusion::{Baked, bake, room, values};

/// Rays of each surfel of the reference.
const RAYS: f64 = 512.0;

/// A scan, as it were: a floor and three walls, the rest was not seen, whose places are off by a third of
/// a step and whose normals by some 15 degrees, and leaves that are seen from both sides.
fn scan() -> Surfels {
    let mesh = room(3000);
    let mut state = 1u64;
    let mut unit = move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    };
    let mut vector = move || Vec3::new(unit(), unit(), unit());
    let step = (24.0f32 / 3000.0).sqrt();
    let mut scan = Surfels::default();
    for (&position, &normal) in mesh.positions.iter().zip(&mesh.normals) {
        if position.x < 0.999 && position.z < 0.999 {
            let tilted = (normal + 0.25 * vector()).normalize_or(normal);
            scan.push(position + step / 3.0 * vector().x * normal, tilted, step);
        }
    }
    for _ in 0..500 {
        let normal = vector().normalize_or(Vec3::Z);
        scan.push(0.4 * vector(), normal, step);
    }
    scan
}

fn baked(scan: &Surfels, settings: &str) -> Baked {
    bake(&scan.cloud().view(), &values(settings)).unwrap()
}

/// The word before these in what is said at the end.
fn number(baked: &Baked, before: &str) -> f64 {
    let said = baked.messages.last().unwrap();
    let number = said.split(before).next().unwrap().rsplit(' ').next().unwrap();
    number.parse().unwrap_or_else(|_| panic!("{said}"))
}

#[test]
fn few_rays_find_what_many_find_within_what_is_asked_for() {
    let scan = scan();
    for options in ["", " cone=true", " max-distance=0.3"] {
        let many = baked(&scan, &format!("method=rays rays={RAYS}{options}")).ao;
        // Independent rays' error at half of the sky bounds that of the stratified ones here.
        let noise = 0.5 / RAYS.sqrt();
        for asked in [0.03f64, 0.018] {
            let few = baked(&scan, &format!("error={asked:?}{options}"));
            let error = rms(&few.ao, &many);
            // The limit is on what is estimated for each bundle, some of which are better.
            let bound = asked.hypot(noise);
            assert!(error < bound, "{asked}{options}: {error}, {:?}", few.messages.last());
            let said = number(&few, " (root mean square)");
            let both = said.hypot(noise);
            assert!(error < 1.3 * both && said < 1.3 * error, "{asked}{options}: {said}, {error}");
        }
    }
}

#[test]
fn more_rays_are_traced_only_where_they_help() {
    let scan = scan();
    let rays = |settings: &str| number(&baked(&scan, settings), " rays for");
    let [few, some, all] = [rays("error=1.0"), rays("error=0.02"), rays("error=0.0")];
    assert!(few < 0.5 * some && some < 0.9 * all, "{few}, {some}, {all}");
    // What is above the horizon of the mean normal of a bundle may be below that of a surfel.
    let n = number(&baked(&scan, ""), " of them");
    assert!(n == scan.positions.len() as f64, "the scan is open: {n}");
    assert!(few > 32.0 * n && few <= 64.0 * n && all <= 256.0 * n, "{few}, {all}, {n} surfels");
}

#[test]
fn the_fit_of_neighbours_carries_no_light_over_a_crease() {
    // A wall on a ground.
    let mut scene = Surfels::default();
    let n = 60;
    for i in 0..n {
        for j in 0..n {
            let (x, y) = (i as f32 / n as f32, (j as f32 + 0.5) / n as f32);
            scene.push(Vec3::new(x, 0.0, y), Vec3::Y, 0.01);
            scene.push(Vec3::new(x, y, 0.0), Vec3::Z, 0.01);
        }
    }
    let many = baked(&scene, &format!("method=rays rays={RAYS}")).ao;
    let few = baked(&scene, "").ao;
    let foot: Vec<usize> =
        (0..few.len()).filter(|&i| scene.positions[i].y + scene.positions[i].z < 0.06).collect();
    let mean = |ao: &[f32]| foot.iter().map(|&i| ao[i]).sum::<f32>() / foot.len() as f32;
    // Noise has no mean; a fit over the crease would be off by some 0.1 at its foot.
    assert!((mean(&few) - mean(&many)).abs() < 0.01, "{} {}", mean(&few), mean(&many));
}
