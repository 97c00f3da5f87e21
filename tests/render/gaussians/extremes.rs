//! Gaussians at the ends of what numbers can be: every picture is of finite numbers.

use super::agreement::views;
use super::stage::{self, Gaussians};
use glam::{DVec3, Quat, Vec3};
use surfelshop_api::View;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_cloud::Cloud;
use surfelshop_tests::stage::{each_way, engine, view};

const BLENDS: [&str; 5] = ["sorted", "stochastic", "additive", "nearest", "normalized"];

/// Draws a cloud from some views; the most of the picture that it covers, of each renderer.
#[track_caller]
fn covered(cloud: &Cloud, views: &[View], what: &str) -> [f32; 2] {
    // Without a graphics card the others take long.
    each_way(|| {
        drawn(cloud, &views[..1], &BLENDS[..1], what);
    });
    drawn(cloud, views, &BLENDS, what)
}

fn drawn(cloud: &Cloud, views: &[View], blends: &[&str], what: &str) -> [f32; 2] {
    let mut engine = engine();
    stage::UNITS.map(|unit| {
        let mut renderer = stage::renderer(&engine, unit);
        let mut most = 0f32;
        for blend in blends {
            let values = stage::values(&[("blend", stage::text(blend))]);
            for view in views {
                let (clouds, mut outputs) = ([cloud], stage::outputs().to_vec());
                if unit == "gaussians-2d" {
                    outputs.push(stage::distortion());
                }
                let frame =
                    stage::frame(&mut engine, &mut renderer, &clouds, *view, &values, &outputs)
                        .unwrap();
                stage::all_finite(&frame, &format!("{what}, {unit} {blend}"));
                let pixels = stage::pixels(&frame, &Output::Color);
                let sum: f32 = pixels.iter().map(|pixel| pixel[3]).sum();
                most = most.max(sum / pixels.len() as f32);
            }
        }
        most
    })
}

fn front() -> View {
    view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 48)
}

/// Costs 1 s.
///
/// Invariant: no Gaussian, however degenerate, makes a pixel that is not finite
#[test]
fn sizes_and_opacities_at_their_ends_stay_finite() {
    let mut all = Gaussians::default();
    let sizes = [0.0, 1e-38, 1e-20, 1e-4, 0.1, 10.0, 1e18, 1e30];
    let mut k = 0;
    for a in sizes {
        for b in sizes {
            for opacity in [0.0, 1e-30, 0.5, 1.0, 5.0, -1.0] {
                k += 1;
                let place =
                    Vec3::new((k as f32).sin(), (2.0 * k as f32).sin(), 0.01 * k as f32 - 1.0);
                let turn = Quat::from_rotation_x(k as f32) * Quat::from_rotation_z(0.3 * k as f32);
                all.push(place, [a, b, sizes[k % 8]], turn, opacity, [0.3, -0.2, 0.9]);
            }
        }
    }
    let views: Vec<View> = views().into_iter().map(|(_, view)| view).chain([front()]).collect();
    covered(&all.cloud(), &views, "sizes");
    // And each by itself, which nothing hides.
    let mut engine = engine();
    for unit in stage::UNITS {
        let mut renderer = stage::renderer(&engine, unit);
        for size in sizes {
            let mut one = Gaussians::default();
            one.push(Vec3::ZERO, [size; 3], Quat::IDENTITY, 1.0, [0.3, -0.2, 0.9]);
            let (cloud, none) = (one.cloud(), Values::new());
            let outputs = stage::outputs();
            let frame =
                stage::frame(&mut engine, &mut renderer, &[&cloud], front(), &none, &outputs)
                    .unwrap();
            stage::all_finite(&frame, &format!("{unit} of size {size}"));
        }
    }
}

/// Costs 0.8 s.
#[test]
fn colours_and_rotations_at_their_ends_stay_finite() {
    let mut all = Gaussians::generated(200);
    for (i, rotation) in all.rotations.iter_mut().enumerate() {
        let factor = [0.0, 1e-30, 1e-3, 3.0, 1e10, 1e19, 1e30, 3e38][i % 8];
        rotation.iter_mut().for_each(|r| *r *= factor);
    }
    let most = covered(&all.cloud(), &[front(), views()[3].1], "rotations");
    assert!(most.iter().all(|share| *share > 0.01), "{most:?}");
    let mut all = Gaussians::generated(200);
    for values in &mut all.harmonics {
        for (i, value) in values.iter_mut().enumerate() {
            *value *= [1.0, 1e3, 1e6, 1e30, 3e38][i % 5];
        }
    }
    covered(&all.cloud(), &[front(), views()[3].1], "colours");
}

/// Costs 1.3 s.
#[test]
fn places_at_their_ends_stay_finite() {
    for reach in [1e-30, 1e-6, 1e6, 1e30] {
        let mut all = Gaussians::generated(200);
        for (i, position) in all.positions.iter_mut().enumerate() {
            if i % 2 == 0 {
                *position *= reach;
            }
        }
        let far = View { near: 1e-6, ..front() };
        covered(&all.cloud(), &[front(), views()[3].1, far], "places");
    }
}

/// Costs 1.3 s.
#[test]
fn one_distance_for_all_and_none_in_view_are_drawn() {
    let mut all = Gaussians::generated(500);
    all.positions.iter_mut().for_each(|position| position.z = 0.0);
    let most = covered(&all.cloud(), &[front()], "at one distance");
    assert!(most.iter().all(|share| *share > 0.1), "{most:?}");
    all.positions.iter_mut().for_each(|position| *position = Vec3::ZERO);
    covered(&all.cloud(), &[front()], "at one place");
    all.positions.iter_mut().for_each(|position| position.z = 9.0);
    assert_eq!(covered(&all.cloud(), &[front()], "behind the eye"), [0.0; 2]);
    assert_eq!(covered(&Gaussians::default().cloud(), &[front()], "none"), [0.0; 2]);
}

/// A Gaussian around the eye, and one that the eye is at the centre of. Costs 0.7 s.
#[test]
fn gaussians_around_the_eye_cover_the_picture() {
    let mut all = Gaussians::default();
    // 10 deviations wide, half of one before the eye.
    all.push(Vec3::new(0.0, 0.0, 2.5), [10.0, 10.0, 0.1], Quat::IDENTITY, 1.0, [0.5; 3]);
    all.push(Vec3::new(0.0, 0.0, 3.0), [1.0; 3], Quat::IDENTITY, 1.0, [0.5; 3]);
    let most = covered(&all.cloud(), &[front()], "around the eye");
    assert!(most.iter().all(|share| *share > 0.95), "{most:?}");
    // From its side a plane is a line of no more than what is widened.
    let turned = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
    let mut all = Gaussians::default();
    all.push(Vec3::ZERO, [10.0, 10.0, 0.0], turned, 1.0, [0.5; 3]);
    let most = covered(&all.cloud(), &[front()], "from the side");
    assert!(most[1] < 0.2, "{most:?}");
}
