//! Frames that are left because nobody wants them any more.

use glam::DVec3;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use surfelshop_api::Scene;
use surfelshop_api::graph::Output;
use surfelshop_render::{EngineOptions, GpuOptions, RenderError, SurfelDrawing};
use surfelshop_tests::{clouds, stage};

/// Invariant: a frame that nobody wants any more is left, counted, and leaves nothing behind
#[test]
fn a_frame_that_is_not_wanted_is_left_and_the_next_is_whole() {
    let options = EngineOptions { surfels: SurfelDrawing::Processor, ..EngineOptions::default() };
    let mut engine = stage::engine_with(&GpuOptions::default(), &options);
    let mut renderer = stage::built_renderer(&engine, "surfelshop_ewa_phong", "ewa-phong");
    let (cloud, scene) = (clouds::wavy_sphere(5000), Scene::default());
    let mut draw = |engine: &mut surfelshop_render::Engine, x: f64| {
        let view = stage::view(DVec3::new(x, 1.0, 4.0), DVec3::ZERO, 96);
        stage::render(engine, &mut renderer, &cloud, &scene, view, &[Output::Color])
    };
    let expected = draw(&mut engine, 0.0).unwrap();
    let other = draw(&mut engine, 1.0).unwrap();
    engine.forget_surfaces();
    let stop = Arc::new(AtomicBool::new(true));
    engine.stop_when(stop.clone());
    assert!(matches!(draw(&mut engine, 0.0), Err(RenderError::Stopped)));
    assert_eq!(engine.counters().stopped, 1);
    stop.store(false, Ordering::Relaxed);
    for (x, expected) in [(0.0, &expected), (1.0, &other), (0.0, &expected)] {
        let again = draw(&mut engine, x).unwrap();
        assert!(again.images == expected.images, "what was left shows");
    }
    assert_eq!(engine.counters().stopped, 1);
}
