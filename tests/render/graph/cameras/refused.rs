//! Cameras, buffers of surfels and history that cannot be, each refused with one line that names it.

use crate::graph::cameras::bench::{Bench, back_to_back, behind, look, show};
use glam::DVec3;
use surfelshop_api::View;
use surfelshop_api::graph::{Lifetime, Output, Span};
use surfelshop_api::prelude::*;

#[track_caller]
fn says(words: &[&str], describe: impl Fn(&mut Graph) + Send + 'static) {
    let mut bench = Bench::new(vec![back_to_back()]);
    let mut seat = bench.seat(move |_, graph| describe(graph));
    let line = bench.refusal(&mut seat);
    for word in words {
        assert!(line.contains(word), "`{word}` is missing in: {line}");
    }
}

fn seen_by(view: View) -> impl Fn(&mut Graph) + Send {
    move |graph| {
        let camera = graph.camera("lamp", &view);
        look(graph, Some(camera), Output::Color);
    }
}

fn with(projection: Projection) -> View {
    let mut view = behind();
    view.camera.projection = projection;
    view
}

#[test]
fn numbers_that_no_camera_has() {
    let mut nowhere = behind();
    nowhere.camera.eye = DVec3::NAN;
    for view in [
        nowhere,
        with(Projection::Perspective { fov_y: 0.0 }),
        with(Projection::Perspective { fov_y: 3.2 }),
        with(Projection::Perspective { fov_y: f64::NAN }),
        with(Projection::Orthographic { height: 0.0 }),
        View { near: 0.0, ..behind() },
        View { near: f64::INFINITY, ..behind() },
    ] {
        says(&["camera `lamp`", "numbers that no camera has"], seen_by(view));
    }
}

/// Numbers beyond those of a scene are no reason to fail.
#[test]
fn strange_cameras_are_looked_through() {
    let mut within = behind();
    within.camera.target = within.camera.eye;
    let mut beyond = behind();
    beyond.camera.eye = DVec3::splat(1e300);
    let mut along = behind();
    along.camera.up = DVec3::Z;
    for view in [
        within,
        beyond,
        along,
        View { near: 1e300, ..behind() },
        View { near: 1e-300, ..behind() },
        with(Projection::Perspective { fov_y: 1e-300 }),
        with(Projection::Orthographic { height: 1e300 }),
    ] {
        let mut bench = Bench::new(vec![back_to_back()]);
        let mut seat = bench.seat(move |_, graph| seen_by(view)(graph));
        bench.draw(&mut seat).unwrap_or_else(|error| panic!("{view:?}: {error}"));
    }
}

#[test]
fn sizes_that_no_camera_has() {
    says(&["camera `lamp` has 0 x 4 pixels"], seen_by(View { size_px: [0, 4], ..behind() }));
    let huge = View { size_px: [1_000_000, 4], ..behind() };
    says(&["camera `lamp` has 1000000 x 4 pixels", "each side must be 1 to"], seen_by(huge));
    says(&["it has 49 cameras; at most 48"], |graph| {
        for _ in 0..48 {
            graph.camera("another", &behind());
        }
        seen_by(behind())(graph);
    });
    says(&["what its cameras see", "at most 4294967296"], |graph| {
        for _ in 0..40 {
            graph.camera("wide", &View { size_px: [2048, 2048], ..behind() });
        }
        seen_by(behind())(graph);
    });
}

#[test]
fn cameras_of_another_graph_and_targets_of_another_size() {
    says(&["pass `look for color`", "it looks from camera 0; the graph has 0"], |graph| {
        let other = Graph::new().camera("lamp", &behind());
        look(graph, Some(other), Output::Color);
    });
    says(&["pass `shade`", "`small` is 7 x 5", "its camera's size, 5 x 7"], |graph| {
        let wgsl = "
            #import surfelshop::surface::Surface
            fn shade(s: Surface) -> vec4<f32> { return vec4(s.albedo, 1.0); }";
        let camera = graph.camera("lamp", &behind());
        let small = graph.texture("small", Texture::fixed(Format::Rgba32Float, 7, 5));
        graph.pass(Pass::shading("shade", wgsl, "shade").seen_from(camera).target(small));
    });
}

const TOUCH: &str = "
    var<storage, read_write> points: array<vec4<f32>>;
    @compute @workgroup_size(1) fn touch() { points[0] = vec4(1.0); }
";

#[test]
fn surfels_that_are_not_only_read() {
    says(&["pass `touch`", "`points` holds the scene's surfels and is only read"], |graph| {
        let points = graph.surfels("given", 2, 10);
        let pass = Pass::compute("touch", TOUCH, "touch", Groups::Fixed([1; 3]));
        graph.pass(pass.bind("points", points));
        show(graph, points);
    });
    let given = || Buffer { surfels: Some(10), ..Buffer::new(64) };
    let besides = "buffer `given` is filled with surfels; it can neither be uploaded nor kept";
    says(&[besides], move |graph| {
        let upload = Some(Span { offset: 0, len: 0 });
        let points = graph.buffer("given", Buffer { upload, ..given() });
        show(graph, points);
    });
    for kept in [given().persistent("key"), given().history()] {
        says(&[besides], move |graph| {
            let points = graph.buffer("given", kept.clone());
            show(graph, points);
        });
    }
}

#[test]
fn surfels_of_another_number_than_the_scene_has() {
    // Two surfels are 64 bytes.
    for size in [32, 96, 1 << 20] {
        says(&["buffer `given` has", "10 at most of the scene's surfels take 64"], move |graph| {
            let buffer = Buffer { surfels: Some(10), ..Buffer::new(size) };
            let points = graph.buffer("given", buffer);
            show(graph, points);
        });
    }
}

#[test]
fn textures_keep_nothing_from_frame_to_frame() {
    says(&["texture `sums` is to keep what a frame leaves in it; only buffers do"], |graph| {
        let sums = Texture::fixed(Format::Rgba32Float, 4, 4);
        graph.texture("sums", Texture { lifetime: Lifetime::History, ..sums });
        look(graph, None, Output::Color);
    });
}
