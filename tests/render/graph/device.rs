//! A device that is lost: frames fail with that reason, nothing panics, and a new one draws on.

use glam::DVec3;
use std::thread;
use std::time::Duration;
use surfelshop_api::graph::Output;
use surfelshop_api::prelude::*;
use surfelshop_api::{Scene, static_plugin};
use surfelshop_cloud::Cloud;
use surfelshop_faulty::{calls, fine};
use surfelshop_render::{Engine, EngineOptions, RenderError, Rendered, RendererView};
use surfelshop_tests::{clouds, stage};

static_plugin! {
    id: "org.surfelshop.test.device",
    renderers: [fine::Fine, calls::ReturnsError],
}

const OUTPUTS: [Output; 2] = [Output::Color, Output::Depth];

fn cloud() -> Cloud {
    clouds::sphere(2000, 1.0).cloud()
}

fn render(
    engine: &mut Engine,
    renderer: &mut RendererView,
    cloud: &Cloud,
) -> Result<Rendered, RenderError> {
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 32);
    stage::render(engine, renderer, cloud, &Scene::default(), view, &OUTPUTS)
}

#[track_caller]
fn assert_lost(result: Result<Rendered, RenderError>) {
    let Err(RenderError::DeviceLost(reason)) = result else { panic!("not lost: {result:?}") };
    assert!(!reason.is_empty() && !reason.contains('\n'), "{reason}");
}

#[test]
fn a_lost_device_is_named_as_such_and_a_new_one_draws_the_same() {
    let cloud = cloud();
    let mut engine = stage::fresh_engine();
    let mut renderer = stage::static_renderer::<SurfelshopPackage>(&engine, 0);
    let before = render(&mut engine, &mut renderer, &cloud).unwrap().images;
    assert_eq!(engine.gpu().lost(), None);
    engine.gpu().device.destroy();
    for _ in 0..3 {
        assert_lost(render(&mut engine, &mut renderer, &cloud));
    }
    // What was not made before the loss fails as well: pipelines, columns, the surface.
    let mut other = stage::static_renderer::<SurfelshopPackage>(&engine, 0);
    assert_lost(render(&mut engine, &mut other, &self::cloud()));
    assert!(engine.gpu().lost().is_some());

    let mut engine = stage::fresh_engine();
    let mut other = stage::static_renderer::<SurfelshopPackage>(&engine, 0);
    assert_eq!(render(&mut engine, &mut other, &cloud).unwrap().images, before);
    // Instances of plugins outlive the device.
    assert_eq!(render(&mut engine, &mut renderer, &cloud).unwrap().images, before);
}

#[test]
fn a_device_lost_before_the_first_frame_is_named_as_such() {
    let gpu = surfelshop_render::Gpu::headless(&surfelshop_render::GpuOptions::default()).unwrap();
    gpu.device.destroy();
    match Engine::new(gpu, &EngineOptions::default()) {
        Err(error) => panic!("an engine needs no device yet: {error}"),
        Ok(mut engine) => {
            let mut renderer = stage::static_renderer::<SurfelshopPackage>(&engine, 0);
            assert_lost(render(&mut engine, &mut renderer, &cloud()));
        }
    }
}

/// Invariant: a lost device is an error of that name, never a panic
#[test]
fn a_device_lost_in_the_middle_of_a_frame_does_not_panic() {
    let cloud = cloud();
    for i in 0..24 {
        let mut engine = stage::fresh_engine();
        let mut renderer = stage::static_renderer::<SurfelshopPackage>(&engine, 0);
        // The first frame compiles for long, later ones draw for short.
        if i % 2 == 1 {
            render(&mut engine, &mut renderer, &cloud).unwrap();
        }
        let device = engine.gpu().device.clone();
        let loser = thread::spawn(move || {
            thread::sleep(Duration::from_micros(if i % 2 == 0 { 4000 } else { 300 } * i));
            device.destroy();
        });
        let error = loop {
            if let Err(error) = render(&mut engine, &mut renderer, &cloud) {
                break error;
            }
        };
        loser.join().unwrap();
        assert!(matches!(error, RenderError::DeviceLost(_)), "{error}");
    }
}

#[test]
fn a_plugins_error_is_no_loss() {
    let mut engine = stage::fresh_engine();
    let mut renderer = stage::static_renderer::<SurfelshopPackage>(&engine, 1);
    let error = render(&mut engine, &mut renderer, &cloud()).unwrap_err();
    assert!(matches!(error, RenderError::Plugin(_)), "{error}");
}

#[test]
fn a_renderer_may_go_from_one_engine_to_another() {
    let cloud = cloud();
    let (mut one, mut other) = (stage::fresh_engine(), stage::fresh_engine());
    let mut renderer = stage::static_renderer::<SurfelshopPackage>(&one, 0);
    let first = render(&mut one, &mut renderer, &cloud).unwrap().images;
    for engine in [&mut other, &mut one] {
        assert_eq!(render(engine, &mut renderer, &cloud).unwrap().images, first);
    }
}
