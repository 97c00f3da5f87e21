//! Painted clouds: what changed is put to what is in memory, or on the device.

use glam::DVec3;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{Scene, columns};
use surfelshop_cloud::selection::{Region, Selection, with_value};
use surfelshop_cloud::{Buffer, Cloud, Column};
use surfelshop_render::{
    Counters, Engine, EngineOptions, GpuOptions, RenderRequest, SurfelDrawing,
};
use surfelshop_tests::{clouds, stage};

/// An engine that draws on the CPU and expects edits, or does not.
fn engine(expects: bool) -> Engine {
    engine_by(SurfelDrawing::Processor, expects)
}

fn engine_by(surfels: SurfelDrawing, expects: bool) -> Engine {
    let options = EngineOptions { surfels, ..EngineOptions::default() };
    let mut engine = stage::engine_with(&GpuOptions::default(), &options);
    engine.expect_edits(expects);
    engine
}

/// A picture, with surfels merged to so many pixels.
fn draw(engine: &mut Engine, cloud: &Cloud, detail_px: f32) -> Vec<f32> {
    let mut renderer = stage::built_renderer(engine, "surfelshop_ewa_phong", "ewa-phong");
    let request = RenderRequest {
        clouds: &[cloud.view()],
        facts: cloud.facts(),
        scene: &Scene::default(),
        view: stage::view(DVec3::new(0.3, 0.5, 3.0), DVec3::ZERO, 96),
        values: &Values::new(),
        outputs: &[Output::Color],
        frame_index: 0,
        environment: None,
        stride: 1,
        detail_px,
        parts: None,
        eye_dome: None,
    };
    let frame = engine.render(&mut renderer, &request).unwrap();
    frame.images[0].1.data.clone()
}

/// Columns put in order, and columns that were painted.
fn work(counters: Counters) -> (u32, u32) {
    (counters.uploads, counters.patched_columns)
}

fn gray(cloud: Cloud) -> Cloud {
    let all = Region::All.select(&cloud).unwrap();
    let cloud = with_value(&cloud, &all, "ao", &[0.75]).unwrap();
    with_value(&cloud, &all, "color", &[200.0, 180.0, 160.0]).unwrap()
}

/// With a colour in a ball around a place.
fn painted(cloud: &Cloud, center: DVec3, name: &str, value: &[f64]) -> Cloud {
    let some = Region::Sphere { center, radius: 0.3 }.select(cloud).unwrap();
    with_value(cloud, &some, name, value).unwrap()
}

/// Invariant: a painted cloud's picture is that of one put in order anew, from near and from afar, and nothing else is
/// put in order or sent
///
/// A second: a cloud of several parts is put in order nine times.
#[test]
fn a_painted_cloud_is_drawn_as_one_put_in_order_anew() {
    let cloud = gray(clouds::sphere(150_000, 1.0).cloud());
    let once = painted(&cloud, DVec3::Z, "color", &[10.0, 240.0, 20.0]);
    let twice = painted(&once, DVec3::new(0.5, 0.2, 0.8), "ao", &[0.2]);
    let (cpu, quads) = (SurfelDrawing::Processor, SurfelDrawing::Quads);
    // The device has columns of their own for colours and accessibility.
    for (surfels, detail_px, n_undone) in [(cpu, 0.0, 1), (cpu, 2.0, 1), (quads, 0.0, 2)] {
        let anew = |cloud: &Cloud| draw(&mut engine_by(surfels, false), cloud, detail_px);
        let mut engine = engine_by(surfels, true);
        let first = draw(&mut engine, &cloud, detail_px);
        let (uploads, painted) = work(engine.counters());
        for (n, cloud) in (1..).zip([&once, &twice]) {
            assert!(engine.holds(&[cloud.view()]), "{detail_px}: step {n}");
            let now = draw(&mut engine, cloud, detail_px);
            assert!(now != first && now == anew(cloud), "{detail_px}: step {n}");
            assert_eq!(work(engine.counters()), (uploads, painted + n), "{detail_px}: step {n}");
        }
        // Undone it is what it was.
        assert!(draw(&mut engine, &cloud, detail_px) == first, "{detail_px}");
        assert_eq!(work(engine.counters()), (uploads, painted + 2 + n_undone), "{detail_px}");
    }
}

/// Without edits in view nothing is kept for them; and where colours decide which of two at one place comes first, or
/// much has changed, all are put in order.
#[test]
fn where_painting_is_more_than_colours_all_are_put_in_order() {
    let cloud = gray(clouds::sphere(5_000, 1.0).cloud());
    let green = painted(&cloud, DVec3::Z, "color", &[10.0, 240.0, 20.0]);
    let mut plain = engine(false);
    draw(&mut plain, &cloud, 0.0);
    assert!(!plain.holds(&[green.view()]));
    // Two at each place, which their colours tell apart: with the darker first.
    let twice = |n: usize| {
        let mut surfels = clouds::sphere(n, 1.0);
        surfels.positions.extend_from_within(..);
        surfels.normals.extend_from_within(..);
        surfels.radii.extend_from_within(..);
        surfels.colors.extend_from_within(..);
        let codes = (0..2 * n).flat_map(|i| if i < n { [90; 3] } else { [160; 3] }).collect();
        let colors = Column::new(columns::COLOR, 3, Buffer::U8(codes));
        surfels.cloud().with_columns(vec![colors]).unwrap()
    };
    let doubled = twice(2_000);
    let mut engine = engine(true);
    draw(&mut engine, &doubled, 0.0);
    let first_half = |value: f64, cloud: &Cloud| {
        let some = Region::Sphere { center: DVec3::Z, radius: 0.3 }.select(cloud).unwrap();
        let some = Selection::of(4_000, |i| i < 2_000 && some.contains(i)).unwrap();
        with_value(cloud, &some, "color", &[value; 3]).unwrap()
    };
    for (value, put_in_order) in [(20.0, false), (240.0, true)] {
        let before = work(engine.counters());
        let edited = first_half(value, &doubled);
        assert_eq!(engine.holds(&[edited.view()]), !put_in_order, "{value}");
        let now = draw(&mut engine, &edited, 0.0);
        assert!(now == draw(&mut self::engine(false), &edited, 0.0), "{value}");
        let expected = if put_in_order { (1, 0) } else { (0, 1) };
        let after = work(engine.counters());
        assert_eq!((after.0 - before.0, after.1 - before.1), expected, "{value}");
    }
    // What moved, and most of a cloud.
    for edited in
        [painted(&cloud, DVec3::Z, "radius", &[0.1]), gray(cloud.with_columns(Vec::new()).unwrap())]
    {
        let mut engine = self::engine(true);
        draw(&mut engine, &cloud, 0.0);
        assert!(!engine.holds(&[edited.view()]));
    }
}
