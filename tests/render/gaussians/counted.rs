//! What scenes cost that have no splats in them, and those that have, by count.

use super::agreement::views;
use super::stage::{self, Gaussians};
use glam::DVec3;
use surfelshop_api::Scene;
use surfelshop_api::columns::{OPACITY, SH, SPLAT_ROTATION, SPLAT_SCALE};
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_cloud::{Buffer, Cloud, Column};
use surfelshop_render::{Counters, PassState, Rendered, SurfelDrawing};
use surfelshop_render::{EngineOptions, GpuOptions};
use surfelshop_tests::{clouds, stage as host};

/// Passes that were made or taken from before.
fn ran(frame: &Rendered) -> Vec<(String, PassState)> {
    frame.passes.iter().map(|pass| (pass.name.clone(), pass.state)).collect()
}

/// What a renderer without splats does for a cloud.
fn phong(cloud: &Cloud, surfels: SurfelDrawing) -> (Rendered, Counters) {
    let options = EngineOptions { surfels, ..EngineOptions::default() };
    let mut engine = host::engine_with(&GpuOptions::default(), &options);
    let mut renderer = host::built_renderer(&engine, "surfelshop_ewa_phong", "ewa-phong");
    let view = host::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 64);
    let (scene, outputs) = (Scene::default(), [Output::Color]);
    let frame = host::render(&mut engine, &mut renderer, cloud, &scene, view, &outputs).unwrap();
    (frame, engine.counters())
}

/// Costs 0.5 s.
///
/// Invariant: who draws no splats pays nothing for them
#[test]
fn surfels_cost_what_they_did() {
    let n = 2000;
    let plain = clouds::sphere(n, 1.0).cloud();
    let floats = |name: &str, k: usize| Column::new(name, k as u32, Buffer::F32(vec![0.1; k * n]));
    let columns = vec![
        floats(OPACITY, 1),
        floats(SPLAT_SCALE, 3),
        floats(SPLAT_ROTATION, 4),
        floats(SH[0], 3),
        floats(SH[3], 21),
    ];
    let splats = plain.with_columns(columns).unwrap();
    for surfels in [SurfelDrawing::Processor, SurfelDrawing::Quads] {
        let (a, a_counts) = phong(&plain, surfels);
        let (b, b_counts) = phong(&splats, surfels);
        assert_eq!((a_counts.column_buffers, a_counts.given_column_bytes), (0, 0));
        assert_eq!(a_counts, b_counts, "columns of splats that nobody reads");
        assert_eq!(ran(&a), ran(&b));
        assert!(ran(&a).iter().all(|(name, _)| !name.contains("splat")), "{:?}", ran(&a));
        stage::equal_bits(&a, &b, "with columns of splats");
    }
}

/// Costs 0.2 s.
#[test]
fn columns_are_brought_to_the_device_once_and_what_nobody_asked_for_does_not_run() {
    let cloud = Gaussians::generated(500).cloud();
    let mut engine = host::fresh_engine();
    let mut renderer = stage::renderer(&engine, "gaussians");
    let mut draw = |view: usize, output: Output| {
        let (view, none) = (views()[view].1, Values::new());
        let frame =
            stage::frame(&mut engine, &mut renderer, &[&cloud], view, &none, &[output]).unwrap();
        let all = ran(&frame).into_iter().filter(|(_, state)| *state == PassState::Ran);
        (all.map(|(name, _)| name).collect::<Vec<_>>(), engine.counters())
    };
    let (passes, first) = draw(0, Output::Color);
    assert_eq!(passes, ["splats", "color of sums"]);
    assert_eq!(first.column_buffers, 5, "Gaussians and four orders of harmonics");
    // Eleven floats, three of order 0, and halves in whole words.
    let bytes = 4 * (5 * 4 + 500 * (11 + 3 + 5 + 8 + 11));
    assert_eq!(first.given_column_bytes, bytes);
    assert_eq!(first.surfaces, Default::default(), "no surface is drawn");
    let (_, second) = draw(1, Output::Color);
    assert_eq!((second.column_buffers, second.plans), (first.column_buffers, first.plans));
    assert_eq!(second.compiled, first.compiled);
    let (passes, third) = draw(1, Output::Normal);
    assert_eq!(passes, ["normals of splats", "normal of sums"]);
    assert_eq!(third.column_buffers, first.column_buffers);
    let (passes, _) = draw(1, Output::Depth);
    assert_eq!(passes, ["depths of splats"]);
}

/// Costs 0.2 s.
#[test]
fn distortion_is_paid_for_by_those_who_look_at_it() {
    let cloud = Gaussians::generated(500).cloud();
    let mut engine = host::fresh_engine();
    let mut renderer = stage::renderer(&engine, "gaussians-2d");
    let mut draw = |output: Output| {
        let (view, none) = (views()[0].1, Values::new());
        let frame =
            stage::frame(&mut engine, &mut renderer, &[&cloud], view, &none, &[output]).unwrap();
        let bytes = frame.graph_bytes;
        let all = ran(&frame).into_iter().filter(|(_, state)| *state == PassState::Ran);
        (all.map(|(name, _)| name).collect::<Vec<_>>(), bytes, engine.counters().compiled.pipelines)
    };
    let (depths, ..) = draw(Output::Depth);
    assert_eq!(depths, ["depths of splats"]);
    let (color, _, before) = draw(Output::Color);
    assert_eq!(color, ["splats", "color of sums"]);
    let (passes, _, after) = draw(stage::distortion());
    assert_eq!(passes, ["distortion of splats"]);
    assert_eq!(after, before + 1, "its pipeline was not made before");
}
