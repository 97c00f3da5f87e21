//! Far places, close looks, degenerate boxes and parameters at their ends.

use crate::procedural::agreement::compare;
use glam::{DVec3, Vec3};
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_render::{GpuOptions, RenderRequest, RendererView};
use surfelshop_tests::clouds::Surfels;
use surfelshop_tests::procedural::Bench;
use surfelshop_tests::procedural::patterns::{ALL, Settings};
use surfelshop_tests::procedural::places::{boxed, spots};
use surfelshop_tests::procedural::plane::{PatternView, Plane, unlit};
use surfelshop_tests::stage;

/// A million metres away and in pieces of a thousandth of a millimetre: what f32 coordinates would
/// show as steps, equals f64 within the bound that holds near the origin.
#[test]
fn far_and_close_places_equal_the_twin() {
    let mut bench = Bench::new(&GpuOptions::default());
    let far = DVec3::new(1.1e6, -2.3e6, 1e6);
    for pattern in ALL {
        // Wood's rings are measured in f32, as its limits say.
        if pattern == "wood" {
            continue;
        }
        let settings = Settings { frequency: 300.0, octaves: 8, seed: 1, ..Settings::default() };
        let object = boxed(far, 1.5);
        // A cloud in a corner of the box, seen from as close as a fraction of a finest cell.
        for size in [1.0, 1e-3, 1e-6] {
            let origin = far + DVec3::new(0.71, -0.33, 0.5);
            compare(&mut bench, &settings, pattern, &spots(300, size, 0.01, 2), origin, object);
        }
    }
}

/// 0 and 16 octaves, no and huge frequencies, all gains and lacunarities.
#[test]
fn ends_of_parameters_equal_the_twin() {
    let mut bench = Bench::new(&GpuOptions::default());
    let plain = Settings::default();
    let settings = [
        Settings { octaves: 0, ..plain },
        Settings { octaves: 16, ..plain },
        Settings { octaves: 16, lacunarity: 4.0, gain: 1.0, ..plain },
        Settings { octaves: 16, lacunarity: 1.0, gain: 0.0, ..plain },
        Settings { frequency: 0.0, warp: 4.0, ..plain },
        Settings { frequency: 1e6, ..plain },
        Settings { frequency: 1e6, octaves: 16, gain: 1.0, seed: 65_535, ..plain },
    ];
    for pattern in ALL {
        for settings in &settings {
            let (origin, object) = (DVec3::ZERO, boxed(DVec3::ZERO, 1.0));
            let close = settings.frequency > 1e5;
            let spots = spots(300, if close { 1e-5 } else { 1.0 }, 0.3, 4);
            if pattern == "wood" && close {
                continue;
            }
            compare(&mut bench, settings, pattern, &spots, origin, object);
        }
    }
}

struct Stage {
    engine: stage::PooledEngine,
    renderer: RendererView,
}

impl Stage {
    /// Whether anything is there, in a picture without a pixel that is not finite.
    fn finite(&mut self, cloud: &Cloud, view: View, values: &Values) -> bool {
        let request = RenderRequest {
            clouds: &[cloud.view()],
            facts: cloud.facts(),
            scene: &Scene::default(),
            view,
            values,
            outputs: &[Output::Color],
            frame_index: 0,
            environment: None,
            stride: 1,
            detail_px: 0.0,
            parts: None,
            eye_dome: None,
        };
        let rendered = self.engine.render(&mut self.renderer, &request).unwrap();
        let color = rendered.image(&Output::Color).unwrap();
        assert!(color.data.iter().all(|v| v.is_finite()), "{values:?}");
        color.data.as_chunks::<4>().0.iter().any(|texel| texel[3] > 0.0)
    }
}

/// Points, flat clouds and nothing have no box to speak of; their pictures are finite with any
/// parameters, filtered or not, from noise of either kind.
#[test]
fn pictures_of_degenerate_clouds_are_finite() {
    let engine = stage::engine();
    let renderer = stage::built_renderer(&engine, "surfelshop-procedural", "procedural");
    let mut stage = Stage { engine, renderer };
    let cloud = |points: &[Vec3]| {
        let mut surfels = Surfels::default();
        points.iter().for_each(|&point| surfels.push(point, Vec3::Z, 0.5));
        surfels.cloud()
    };
    let clouds = [
        cloud(&[]),
        cloud(&[Vec3::ZERO]),
        cloud(&[Vec3::splat(0.2); 5]),
        cloud(&[Vec3::ZERO, Vec3::X]),
        cloud(&[Vec3::ZERO, Vec3::X, Vec3::Y]),
    ];
    let view = |eye| stage::view(eye, DVec3::ZERO, 32);
    let eyes = [DVec3::new(0.1, 0.2, 2.0), DVec3::new(0.0, 0.0, 1e-3), DVec3::new(40.0, 0.0, 0.9)];
    for pattern in ALL {
        let mut all = Vec::new();
        for (frequency, octaves, warp) in [(0.0, 0, 0.0), (1e6, 16, 4.0), (4.0, 6, 0.5)] {
            let settings = Settings { frequency, octaves, warp, ..Settings::default() };
            let values = settings.values(pattern);
            let mut points = values.clone();
            points.insert("filter".to_owned(), Value::Bool(false));
            let mut volume = values.clone();
            volume.insert("noise".to_owned(), Value::Text("volume".to_owned()));
            volume.insert("volume-size".to_owned(), Value::Int(16));
            all.extend([values, points, volume]);
        }
        for cloud in &clouds {
            for values in &all {
                assert_ne!(stage.finite(cloud, view(eyes[0]), values), cloud.is_empty());
                stage.finite(cloud, view(eyes[1]), values);
                stage.finite(cloud, view(eyes[2]), values);
            }
        }
    }
}

/// From as close as a hundred-millionth of the plane the picture is the smooth one of f64, not the steps
/// that f32 coordinates would make of it: one of those is as wide as three hundred of these pictures.
#[test]
fn close_looks_show_no_steps() {
    let settings = Settings { octaves: 8, ..Settings::default() };
    let values = unlit(&settings, "simple-marble", 4.0);
    let values =
        Values::from_iter(values.into_iter().chain([("filter".to_owned(), Value::Bool(false))]));
    for distance in [1.0, 1e-2, 1e-4] {
        let sight = PatternView { distance, tilt: 0.3, size: 48 };
        let mut plane = Plane::close(4.0 * distance as f32);
        let pixels = plane.picture(sight, &values).unwrap().pixels;
        let scaled = Settings { frequency: 4.0 * Plane::SIZE, ..settings };
        let exact: Vec<f64> = (0..48 * 48)
            .map(|i| {
                let at = Plane::place(sight, [i % 48, i / 48]);
                scaled.look("simple-marble", &at, DVec3::ONE).albedo.x
            })
            .collect();
        // The place on the surface is known to some units of the distance's last place, and the
        // finest octave has 512 cells a unit, of contrast 1 / 128 and slope 5.
        let places = 16.0 * f64::from(f32::EPSILON) * distance;
        let bound = 2.5 * 5.0 * 4.0 * 8.0 * places + 3e-5;
        let mut range = (f64::INFINITY, f64::NEG_INFINITY);
        for (pixel, exact) in pixels.iter().zip(&exact) {
            let difference = (f64::from(pixel.x) - exact).abs();
            assert!(difference < bound, "{distance}: {pixel} for {exact}, bound {bound:e}");
            range = (range.0.min(*exact), range.1.max(*exact));
        }
        assert!(range.1 - range.0 > 3.0 * bound, "{distance}: something is to be seen, {range:?}");
    }
}
