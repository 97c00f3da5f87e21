//! Work that need not be done is not done, by count.

use glam::DVec3;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{Scene, columns};
use surfelshop_cloud::{Buffer, Column};
use surfelshop_render::{
    Engine, EngineOptions, GpuOptions, PassReport, PassState, RenderRequest, Rendered,
    SurfelDrawing,
};
use surfelshop_tests::clouds::{self, Surfels};
use surfelshop_tests::stage;

const PHONG: (&str, &str) = ("surfelshop_ewa_phong", "ewa-phong");
const FLAT: (&str, &str) = ("surfelshop_flat", "flat");

fn ran(frame: &Rendered) -> Vec<&str> {
    let passes = frame.passes.iter().filter(|pass| pass.state == PassState::Ran);
    passes.map(|pass| pass.name.as_str()).collect()
}

/// These count what the device does.
/// An engine that draws by quads and uploads each column, on cards as without one.
fn quads() -> Engine {
    let surfels = SurfelDrawing::Quads;
    let options =
        EngineOptions { surfels, constant_radii: Some(false), ..EngineOptions::default() };
    stage::engine_with(&GpuOptions::default(), &options)
}

/// Invariant: an unchanged graph compiles nothing again
#[test]
fn unchanged_structure_recompiles_nothing() {
    let mut engine = quads();
    let cloud = clouds::sphere(500, 1.0).cloud();
    let mut renderer = stage::built_renderer(&engine, PHONG.0, PHONG.1);
    let mut at = |x: f64| {
        let view = stage::view(DVec3::new(x, 0.0, 3.0), DVec3::ZERO, 32);
        let outputs = [Output::Color];
        stage::render(&mut engine, &mut renderer, &cloud, &Scene::default(), view, &outputs)
            .unwrap();
        engine.counters()
    };
    let first = at(0.0);
    let moved = at(0.5);
    assert!(first.compiled.pipelines > 0);
    assert_eq!(first.compiled, moved.compiled);
    assert_eq!(first.plans, moved.plans);
    assert_eq!(first.uploads, moved.uploads);
    assert_eq!(moved.surfaces.visibility, 2, "the camera moved, so the surface was made again");
}

/// Invariant: passes nobody asked for neither run nor compile
#[test]
fn depth_alone_runs_fewer_passes_than_color() {
    let cloud = clouds::sphere(500, 1.0).cloud();
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 32);
    let run = |output: Output| {
        let mut engine = quads();
        let mut renderer = stage::built_renderer(&engine, PHONG.0, PHONG.1);
        let outputs = [output];
        let frame =
            stage::render(&mut engine, &mut renderer, &cloud, &Scene::default(), view, &outputs)
                .unwrap();
        (frame, engine.counters().compiled.pipelines)
    };
    let (depth, depth_pipelines) = run(Output::Depth);
    let (color, color_pipelines) = run(Output::Color);
    assert!(ran(&depth).len() < ran(&color).len(), "{:?}\n{:?}", ran(&depth), ran(&color));
    assert!(ran(&color).contains(&"phong") && !ran(&depth).contains(&"phong"));
    let culled = depth.passes.iter().find(|pass| pass.name == "phong").unwrap();
    assert_eq!(culled.state, PassState::Culled);
    assert!(depth_pipelines < color_pipelines, "what does not run is not compiled");
}

/// Invariant: renderers of one view share its surface
#[test]
fn two_renderers_over_one_view_share_its_surface() {
    let mut engine = quads();
    let cloud = clouds::sphere(500, 1.0).cloud();
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 32);
    let mut renderers = [
        stage::built_renderer(&engine, PHONG.0, PHONG.1),
        stage::built_renderer(&engine, PHONG.0, PHONG.1),
        stage::built_renderer(&engine, FLAT.0, FLAT.1),
    ];
    for renderer in &mut renderers {
        let outputs = [Output::Color];
        stage::render(&mut engine, renderer, &cloud, &Scene::default(), view, &outputs).unwrap();
    }
    let counters = engine.counters();
    assert_eq!(counters.surfaces.visibility, 1, "all three look at the same surfels");
    assert_eq!(counters.surfaces.blended, 1, "the two blending ones share the blended surface");
    assert_eq!(counters.surfaces.nearest, 1);
    assert_eq!(counters.uploads, 4, "position, normal, radius and color, once each");
    engine.forget_surfaces();
    let outputs = [Output::Color];
    let [first, ..] = &mut renderers;
    stage::render(&mut engine, first, &cloud, &Scene::default(), view, &outputs).unwrap();
    assert_eq!(engine.counters().surfaces.visibility, 2, "forgotten, so it was made again");
}

/// Invariant: distances of a surface that the CPU drew are neither drawn into a texture nor read back
#[test]
fn distances_that_the_cpu_knows_do_not_pass_through_the_device() {
    let cloud = clouds::sphere(500, 1000.0).cloud();
    let view = stage::view(DVec3::new(0.0, 0.0, 3000.0), DVec3::ZERO, 45);
    let frames = |surfels: SurfelDrawing, asked: &[&[Output]]| {
        let options = EngineOptions { surfels, ..EngineOptions::default() };
        let mut engine = stage::engine_with(&GpuOptions::default(), &options);
        let mut renderer = stage::built_renderer(&engine, PHONG.0, PHONG.1);
        let mut last = None;
        for outputs in asked {
            let scene = Scene::default();
            let frame = stage::render(&mut engine, &mut renderer, &cloud, &scene, view, outputs);
            last = Some(frame.unwrap());
        }
        last.unwrap()
    };
    let (color, depth) = (Output::Color, Output::Depth);
    let both: &[Output] = &[color.clone(), depth.clone()];
    let together = frames(SurfelDrawing::Processor, &[both]);
    assert!(!ran(&together).contains(&"host: depth"), "{:?}", ran(&together));
    let distances = together.image(&depth).unwrap();
    assert_eq!(distances.components, 1);
    // Alone, with the same surface drawn for colours before, and asked for once more.
    let ways: [&[&[Output]]; 3] = [
        &[std::slice::from_ref(&depth)],
        &[std::slice::from_ref(&color), std::slice::from_ref(&depth)],
        &[both, std::slice::from_ref(&depth)],
    ];
    for (i, asked) in ways.into_iter().enumerate() {
        let frame = frames(SurfelDrawing::Processor, asked);
        assert!(frame.image(&depth).unwrap() == distances, "way {i}");
    }
    // The device's own are of the same surfels, in the same units: rays meet planes by other roundings.
    let drawn = frames(SurfelDrawing::Quads, &[both]);
    assert!(ran(&drawn).contains(&"host: depth"), "{:?}", ran(&drawn));
    let others = drawn.image(&depth).unwrap();
    assert_eq!((others.components, others.data.len()), (1, distances.data.len()));
    let pairs = || distances.data.iter().zip(&others.data);
    let covered = pairs().filter(|(one, other)| **one > 0.0 && **other > 0.0).count();
    assert!(covered > 500, "{covered}");
    // Of 500 surfels on a ball some pixel's nearest two are as near as rounding.
    let differing =
        pairs().filter(|(one, other)| (*one - *other).abs() > 1e-4 * one.max(**other)).count();
    assert!(differing * 100 <= covered, "{differing} of {covered}");
}

#[test]
fn surfels_drawn_alone_are_those_a_frame_begins_with() {
    let cloud = clouds::sphere(500, 1.0).cloud();
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 32);
    let (scene, outputs) = (Scene::default(), [Output::Color]);
    for surfels in [SurfelDrawing::Quads, SurfelDrawing::Processor] {
        let options = EngineOptions { surfels, ..EngineOptions::default() };
        let picture = |alone_first: bool| {
            let mut engine = stage::engine_with(&GpuOptions::default(), &options);
            let mut renderer = stage::built_renderer(&engine, PHONG.0, PHONG.1);
            if alone_first {
                let request = RenderRequest {
                    clouds: &[cloud.view()],
                    facts: cloud.facts(),
                    scene: &scene,
                    view,
                    environment: None,
                    values: &Values::new(),
                    outputs: &[],
                    frame_index: 0,
                    stride: 1,
                    detail_px: 0.0,
                    parts: None,
                    eye_dome: None,
                };
                let passes = engine.draw_surfels(&request).unwrap();
                let ran = |pass: &PassReport| pass.state == PassState::Ran;
                assert!(!passes.is_empty() && passes.iter().all(ran), "{passes:?}");
                let again = engine.draw_surfels(&request).unwrap();
                assert!(again.iter().all(|pass| pass.state == PassState::Reused), "{again:?}");
            }
            let frame =
                stage::render(&mut engine, &mut renderer, &cloud, &scene, view, &outputs).unwrap();
            let counters = engine.counters();
            assert_eq!(counters.surfaces.blended, 1, "made once, by either");
            let on_host = counters.host_column_bytes > 0;
            assert_eq!(on_host, surfels == SurfelDrawing::Processor);
            assert_eq!(counters.column_bytes == 0, on_host);
            frame.image(&Output::Color).unwrap().clone()
        };
        assert_eq!(picture(true), picture(false));
    }
}

#[test]
fn changed_surface_settings_make_a_new_surface() {
    let mut engine = quads();
    let cloud = clouds::sphere(500, 1.0).cloud();
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 32);
    let mut renderer = stage::built_renderer(&engine, FLAT.0, FLAT.1);
    let mut scene = Scene::default();
    for scale in [1.0, 0.5, 1.0] {
        scene.surface.radius_scale = scale;
        let outputs = [Output::Color];
        stage::render(&mut engine, &mut renderer, &cloud, &scene, view, &outputs).unwrap();
    }
    assert_eq!(engine.counters().surfaces.visibility, 2, "the first one was kept");
}

/// What stays is told by counts and by bytes. A buffer of a few bytes may or may not be given back when a
/// number is read, so the fewest bytes of the last twenty switches are set against the most of twenty early
/// ones: whatever each switch leaves is there two hundred times.
#[test]
fn two_hundred_switches_leave_nothing_behind() {
    let cloud = clouds::sphere(500, 1.0).cloud();
    let view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 32);
    let (scene, outputs) = (Scene::default(), [Output::Color]);
    let mut engine = quads();
    let units = [("surfelshop_flat", "flat"), ("surfelshop_ewa_phong", "ewa-phong")];
    let (mut counted, mut bytes) = (Vec::new(), Vec::new());
    for i in 0..240 {
        // An instance of its own each time, as when the window switches.
        let (library, unit) = units[i % 2];
        let mut renderer = stage::built_renderer(&engine, library, unit);
        // Another camera each time, so that no surface is taken from before.
        let mut moved = view;
        moved.camera.eye.x += 0.001 * i as f64;
        stage::render(&mut engine, &mut renderer, &cloud, &scene, moved, &outputs).unwrap();
        let counters = engine.counters();
        counted.push((counters.compiled, counters.column_bytes));
        let allocated = engine.gpu().device.generate_allocator_report();
        bytes.push(allocated.unwrap().total_allocated_bytes);
    }
    assert_eq!(counted[19], counted[239], "nothing is compiled again and columns are shared");
    // What is let go of is free a little later, sometimes: whatever stays adds up over a hundred switches.
    let (early, late) = (bytes[20..120].iter().max(), bytes[220..].iter().min());
    assert!(late <= early, "{late:?} bytes on the device after 220 switches, {early:?} up to 120");
}

#[test]
fn the_processor_draws_once_for_all_that_look_at_the_same() {
    let options = EngineOptions { surfels: SurfelDrawing::Processor, ..EngineOptions::default() };
    let mut engine = stage::engine_with(&GpuOptions::default(), &options);
    let cloud = clouds::sphere(500, 1.0).cloud();
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 32);
    let outputs = [Output::Color];
    let mut drawn = |unit: (&str, &str)| {
        let mut renderer = stage::built_renderer(&engine, unit.0, unit.1);
        let scene = Scene::default();
        let frame = stage::render(&mut engine, &mut renderer, &cloud, &scene, view, &outputs);
        let passes = frame.unwrap().passes;
        (passes[0].name.clone(), passes[0].state, engine.counters())
    };
    let name = "surfels: processor".to_owned();
    let first = drawn(PHONG);
    assert_eq!((first.0, first.1), (name.clone(), PassState::Ran));
    assert_eq!((first.2.uploads, first.2.column_bytes), (1, 0), "nothing is on the device");
    let again = drawn(PHONG);
    assert_eq!((again.0, again.1), (name.clone(), PassState::Reused));
    let other = drawn(FLAT);
    assert_eq!((other.0, other.1), (name, PassState::Ran), "it looks at the nearest alone");
    let counts = other.2.surfaces;
    assert_eq!((counts.visibility, counts.blended, counts.nearest), (2, 1, 1));
}

/// What a cloud lacks takes no memory on the device: the simplest scene less than half of the fullest.
#[test]
fn the_simplest_scene_takes_less_than_half_the_memory_of_the_fullest() {
    let n = 1000;
    let bytes_each = |surfels: &Surfels, unit: (&str, &str)| {
        // As on a graphics card.
        let (surfels_by, constant_radii) = (SurfelDrawing::Quads, Some(true));
        let options =
            EngineOptions { surfels: surfels_by, constant_radii, ..EngineOptions::default() };
        let mut engine = stage::engine_with(&GpuOptions::default(), &options);
        let mut renderer = stage::built_renderer(&engine, unit.0, unit.1);
        let cloud = surfels.cloud();
        let wide: Vec<f32> = (0..3 * n).map(|i| (i % 9) as f32 / 8.0).collect();
        let color = Column::new(columns::COLOR, 3, Buffer::F32(wide));
        let cloud = match surfels.ao.is_empty() {
            true => cloud,
            false => cloud.with_columns(vec![color]).unwrap(),
        };
        let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 32);
        let (scene, outputs) = (Scene::default(), [Output::Color]);
        stage::render(&mut engine, &mut renderer, &cloud, &scene, view, &outputs).unwrap();
        engine.counters().column_bytes / n as u64
    };
    let mut plain = Surfels { colors: Vec::new(), ..clouds::sphere(n, 1.0) };
    let alike = bytes_each(&plain, FLAT);
    plain.radii[0] *= 1.5;
    let mut full = clouds::sphere(n, 1.0).elliptical(0.5);
    full.ao = vec![0.5; n];
    full.materials = vec![1; n];
    let (least, most) = (bytes_each(&plain, FLAT), bytes_each(&full, PHONG));
    println!("{alike} or {least} bytes a surfel for the simplest scene, {most} for the fullest");
    assert_eq!(alike, 12 + 12, "positions and normals, and one radius for all in a constant");
    // Radii besides; half axes instead of radii, colours in half floats and accessibility. Materials,
    // which this renderer does not read, stay where they are.
    assert_eq!((least, most), (12 + 12 + 4, 12 + 12 + 24 + 8 + 4));
}

/// Invariant: of a column that differs in some surfels only these are sent
#[test]
fn an_edit_sends_what_it_changed_and_undo_sends_as_much() {
    use surfelshop_cloud::selection::{Region, with_value};
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 64);
    let draw = |engine: &mut Engine, cloud: &surfelshop_cloud::Cloud| {
        let mut renderer = stage::built_renderer(engine, PHONG.0, PHONG.1);
        let outputs = [Output::Color];
        let frame =
            stage::render(engine, &mut renderer, cloud, &Scene::default(), view, &outputs).unwrap();
        frame.images[0].1.data.clone()
    };
    let cloud = clouds::sphere(20_000, 1.0).cloud();
    let all = Region::All.select(&cloud).unwrap();
    let cloud = with_value(&cloud, &all, "color", &[200.0, 180.0, 160.0]).unwrap();
    let mut engine = quads();
    let first = draw(&mut engine, &cloud);
    let before = engine.counters();
    let some = Region::Sphere { center: DVec3::Z, radius: 0.2 }.select(&cloud).unwrap();
    let edited = with_value(&cloud, &some, "color", &[10.0, 240.0, 20.0]).unwrap();
    let changed = draw(&mut engine, &edited);
    let after = engine.counters();
    assert_ne!(first, changed);
    assert_eq!(
        (after.uploads, after.patched_columns),
        (before.uploads, before.patched_columns + 1)
    );
    let sent = after.sent_column_bytes - before.sent_column_bytes;
    let most = 4 * 16 * some.count() as u64;
    assert!(sent > 0 && sent <= most && sent < 20_000, "{sent} bytes for {} surfels", some.count());
    assert_eq!(changed, draw(&mut quads(), &edited), "as from nothing");
    // Undone it is what it was.
    assert_eq!(first, draw(&mut engine, &cloud));
    let undone = engine.counters();
    assert_eq!(undone.sent_column_bytes - after.sent_column_bytes, sent);
    assert_eq!(undone.uploads, before.uploads);
}
