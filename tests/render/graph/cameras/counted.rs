//! What cameras cost, by count: nothing where nothing changed.

use crate::graph::cameras::bench::{Bench, back_to_back, behind, in_state, look};
use glam::DVec3;
use std::sync::{Arc, Mutex};
use surfelshop_api::View;
use surfelshop_api::graph::Output;
use surfelshop_render::{PassState, SurfelDrawing};

const WAYS: [SurfelDrawing; 2] = [SurfelDrawing::Quads, SurfelDrawing::Processor];

#[test]
fn a_moved_camera_plans_and_compiles_nothing() {
    for surfels in WAYS {
        let mut bench = Bench::drawing(surfels, vec![back_to_back()]);
        let view = Arc::new(Mutex::new(behind()));
        let given = Arc::clone(&view);
        let mut seat = bench.seat(move |_, graph| {
            let camera = graph.camera("behind", &given.lock().unwrap());
            look(graph, Some(camera), Output::Color);
        });
        let mut look_from = |eye: DVec3| {
            view.lock().unwrap().camera.eye = eye;
            let rendered = bench.draw(&mut seat).unwrap();
            (bench.engine.counters(), rendered)
        };
        let (first, _) = look_from(DVec3::new(0.0, 0.0, -3.0));
        let (moved, _) = look_from(DVec3::new(0.5, 0.0, -3.0));
        assert_eq!(first.compiled, moved.compiled);
        assert_eq!((first.plans, first.uploads), (moved.plans, moved.uploads));
        assert_eq!(moved.surfaces.visibility, first.surfaces.visibility + 1);
        // And one that was there before finds what it saw.
        let (again, rendered) = look_from(DVec3::new(0.0, 0.0, -3.0));
        assert_eq!(again.surfaces, moved.surfaces);
        let reused = in_state(&rendered, PassState::Reused);
        assert!(reused.iter().all(|name| name.ends_with(" (behind)")), "{reused:?}");
        assert!(!reused.is_empty());
    }
}

/// Cameras side by side, of which each looks at another place.
fn row(n: usize) -> Vec<View> {
    let eye = |i: usize| DVec3::new(0.1 * i as f64, 0.0, -3.0);
    let mut views = vec![behind(); n];
    for (i, view) in views.iter_mut().enumerate() {
        view.camera.eye = eye(i);
    }
    views
}

#[test]
fn cameras_that_rest_keep_what_they_see_while_other_views_are_drawn() {
    for surfels in WAYS {
        let mut bench = Bench::drawing(surfels, vec![back_to_back()]);
        let mut many = bench.seat(|_, graph| {
            for (i, view) in row(12).iter().enumerate() {
                let camera = graph.camera(&format!("{i}"), view);
                let output = if i == 0 { Output::Color } else { Output::Debug(format!("{i}")) };
                look(graph, Some(camera), output);
            }
        });
        let mut none = bench.seat(|_, graph| look(graph, None, Output::Color));
        let debugs = (1..12).map(|i| Output::Debug(i.to_string()));
        let all: Vec<Output> = std::iter::once(Output::Color).chain(debugs).collect();
        let mut counts = Vec::new();
        for _ in 0..3 {
            bench.outputs.clone_from(&all);
            bench.draw(&mut many).unwrap();
            bench.outputs = vec![Output::Color];
            bench.draw(&mut none).unwrap();
            counts.push(bench.engine.counters().surfaces.visibility);
        }
        assert_eq!(counts, [13, 13, 13], "{surfels:?}");
    }
}

#[test]
fn nothing_is_drawn_for_passes_that_nobody_asked_for() {
    for surfels in WAYS {
        let mut bench = Bench::drawing(surfels, vec![back_to_back()]);
        let mut seat = bench.seat(|_, graph| {
            let camera = graph.camera("behind", &behind());
            look(graph, Some(camera), Output::Debug("behind".to_owned()));
            look(graph, None, Output::Color);
        });
        let rendered = bench.draw(&mut seat).unwrap();
        let of_camera = |name: &&str| name.ends_with("(behind)");
        assert!(!in_state(&rendered, PassState::Ran).iter().any(of_camera));
        assert_eq!(bench.engine.counters().surfaces.visibility, 1);
        bench.outputs.push(Output::Debug("behind".to_owned()));
        let rendered = bench.draw(&mut seat).unwrap();
        assert!(in_state(&rendered, PassState::Ran).iter().any(of_camera));
        assert_eq!(bench.engine.counters().surfaces.visibility, 2);
    }
}

/// Compute draws what a camera sees wherever it draws what the view shows.
#[test]
fn each_camera_is_drawn_as_its_own_size_allows() {
    let mut bench = Bench::drawing(SurfelDrawing::Compute, vec![back_to_back()]);
    let limits = bench.engine.gpu().device.limits();
    let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / 8;
    let side = limits.max_texture_dimension_2d;
    let mut seat = bench.seat(move |_, graph| {
        let camera = graph.camera("behind", &behind());
        look(graph, Some(camera), Output::Color);
    });
    let rendered = bench.draw(&mut seat).unwrap();
    let computed = |name: &&str| name.starts_with("surfels: compute") && name.contains("(behind)");
    assert!(in_state(&rendered, PassState::Ran).iter().any(computed), "{:?}", rendered.passes);
    // A few pixels more than fit, where the device has textures of that size.
    let height = u32::try_from(most / u64::from(side) + 1).unwrap();
    if height > 1024 {
        return;
    }
    let mut seat = bench.seat(move |_, graph| {
        let camera = graph.camera("wide", &View { size_px: [side, height], ..behind() });
        look(graph, Some(camera), Output::Color);
    });
    let rendered = bench.draw(&mut seat).unwrap();
    let ran = in_state(&rendered, PassState::Ran);
    assert!(!ran.iter().any(|name| name.starts_with("surfels: compute")), "{ran:?}");
}
