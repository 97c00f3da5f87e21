//! Buffers that a frame finds as the one before left them.

use crate::graph::cameras::bench::{Bench, CameraSlot, back_to_back, show, show_as};
use surfelshop_api::graph::{BufferId, Output};
use surfelshop_api::prelude::*;

const ADD: &str = "
    override amount: f32 = 1.0;
    var<storage, read_write> sums: array<vec4<f32>>;
    @compute @workgroup_size(1) fn add() { sums[0] += vec4(amount); }
";

fn add(graph: &mut Graph, amount: f64) -> BufferId {
    add_of(graph, 16, amount)
}

fn add_of(graph: &mut Graph, size: u64, amount: f64) -> BufferId {
    let sums = graph.buffer("sums", Buffer::new(size).history());
    let pass = Pass::compute("add", ADD, "add", Groups::Fixed([1; 3]));
    graph.pass(pass.constant("amount", amount).bind("sums", sums));
    sums
}

fn bench() -> Bench {
    Bench::new(vec![back_to_back()])
}

fn sum(bench: &mut Bench, seat: &mut CameraSlot) -> f32 {
    bench.values(seat)[0][0]
}

/// Adds one in each frame.
fn ones(bench: &Bench) -> CameraSlot {
    bench.seat(|_, graph| {
        let sums = add(graph, 1.0);
        show(graph, sums);
    })
}

/// Invariant: what a frame leaves for the next is found by the same view alone, and forgotten
/// with its size and its passes
#[test]
fn a_frame_finds_what_the_one_before_left() {
    let mut bench = bench();
    let mut views = [ones(&bench), ones(&bench)];
    assert_eq!(sum(&mut bench, &mut views[0]), 1.0, "zero at first");
    assert_eq!(sum(&mut bench, &mut views[0]), 2.0);
    assert_eq!(sum(&mut bench, &mut views[1]), 1.0, "views know nothing of each other");
    assert_eq!(sum(&mut bench, &mut views[0]), 3.0);
    assert_eq!(sum(&mut bench, &mut views[1]), 2.0);
    let mut third = ones(&bench);
    assert_eq!(sum(&mut bench, &mut third), 1.0);
}

#[test]
fn it_is_forgotten_when_its_size_changes_back_too() {
    let mut bench = bench();
    let mut seat = bench.seat(|frame, graph| {
        let sums = add_of(graph, 16 * u64::from(frame.view.size_px[0]), 1.0);
        show(graph, sums);
    });
    for (size, expected) in [(32, 1.0), (32, 2.0), (16, 1.0), (32, 1.0), (32, 2.0)] {
        bench.view.size_px = [size; 2];
        assert_eq!(sum(&mut bench, &mut seat), expected, "{size}");
    }
}

/// What other passes added up is another sum.
#[test]
fn it_is_forgotten_when_other_passes_fill_it() {
    let mut bench = bench();
    let mut seat = bench.seat(|frame, graph| {
        let is_wide = frame.view.size_px[1] == 32;
        let sums = add(graph, if is_wide { 1.0 } else { 10.0 });
        show(graph, sums);
    });
    for (size, expected) in [(32, 1.0), (32, 2.0), (16, 10.0), (16, 20.0), (32, 1.0)] {
        bench.view.size_px = [size; 2];
        assert_eq!(sum(&mut bench, &mut seat), expected);
    }
}

/// A buffer that comes before it in the graph changes neither which one it is, nor which one the other.
#[test]
fn it_is_told_apart_by_label_and_place() {
    let mut bench = bench();
    let mut seat = bench.seat(|frame, graph| {
        let both = |graph: &mut Graph, label: &str, amount: f64| {
            let sums = graph.buffer(label, Buffer::new(16).history());
            let pass = Pass::compute(label, ADD, "add", Groups::Fixed([1; 3])).bind("sums", sums);
            graph.pass(pass.constant("amount", amount));
            sums
        };
        if frame.view.size_px[0] == 16 {
            let other = both(graph, "before", 1.0);
            show_as(graph, other, Output::Debug("other".to_owned()));
        }
        let sums = both(graph, "sums", 1.0);
        show(graph, sums);
    });
    assert_eq!(sum(&mut bench, &mut seat), 1.0);
    bench.outputs.push(Output::Debug("other".to_owned()));
    bench.view.size_px = [16; 2];
    let rendered = bench.draw(&mut seat).unwrap();
    let other = rendered.image(&Output::Debug("other".to_owned())).unwrap();
    assert_eq!(other.data[0], 1.0, "not what another buffer at its place had");
}

#[test]
fn passes_that_nobody_asked_for_add_nothing() {
    let mut bench = bench();
    let mut seat = bench.seat(|_, graph| {
        let sums = add(graph, 1.0);
        show_as(graph, sums, Output::Debug("sums".to_owned()));
        let nothing = graph.upload("nothing", &[0; 16]);
        show(graph, nothing);
    });
    let sums = Output::Debug("sums".to_owned());
    let mut shown = |bench: &mut Bench| {
        let rendered = bench.draw(&mut seat).unwrap();
        rendered.image(&sums).map(|image| image.data[0])
    };
    assert_eq!(shown(&mut bench), None);
    bench.outputs.push(sums.clone());
    assert_eq!(shown(&mut bench), Some(1.0));
    bench.outputs.pop();
    assert_eq!(shown(&mut bench), None);
    bench.outputs.push(sums.clone());
    assert_eq!(shown(&mut bench), Some(2.0));
}

#[test]
fn it_is_forgotten_after_many_frames_of_other_views() {
    let mut bench = bench();
    bench.view.size_px = [1; 2];
    let mut views = [ones(&bench), ones(&bench)];
    assert_eq!(sum(&mut bench, &mut views[0]), 1.0);
    for _ in 0..60 {
        bench.draw(&mut views[1]).unwrap();
    }
    assert_eq!(sum(&mut bench, &mut views[0]), 2.0);
    for _ in 0..70 {
        bench.draw(&mut views[1]).unwrap();
    }
    assert_eq!(sum(&mut bench, &mut views[0]), 1.0);
    assert_eq!(sum(&mut bench, &mut views[1]), 131.0);
}

/// A frame that is refused leaves nothing.
#[test]
fn a_refused_frame_adds_nothing() {
    let mut bench = bench();
    let mut seat = bench.seat(|frame, graph| {
        let sums = add(graph, 1.0);
        show(graph, sums);
        if frame.view.size_px[0] == 16 {
            graph.pass(Pass::fullscreen("broken", "nonsense", "show"));
        }
    });
    assert_eq!(sum(&mut bench, &mut seat), 1.0);
    bench.view.size_px = [16; 2];
    assert!(bench.draw(&mut seat).is_err());
    bench.view.size_px = [32; 2];
    assert_eq!(sum(&mut bench, &mut seat), 2.0);
}
