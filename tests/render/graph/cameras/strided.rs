//! What graphs are told of how much is drawn.

use crate::graph::cameras::bench::{Bench, back_to_back, look, show};
use surfelshop_api::graph::Output;
use surfelshop_api::prelude::*;

/// Invariant: renderers are told how much is drawn while something moves
#[test]
fn renderers_are_told_how_much_is_drawn() {
    let mut bench = Bench::new(vec![back_to_back()]);
    let mut seat = bench.seat(|_, graph| {
        let told = [graph.stride() as f32, 0.0, 0.0, 1.0];
        let told = graph.upload("told", &told.map(f32::to_le_bytes).concat());
        show(graph, told);
    });
    for (stride, told) in [(1, 1), (4, 4), (64, 64), (0, 1), (u32::MAX, u32::MAX)] {
        bench.stride = stride;
        assert_eq!(bench.values(&mut seat)[0], [told as f32, 0.0, 0.0, 1.0], "{stride}");
    }
    // One that was not asked for by a host draws the whole.
    assert_eq!(Graph::new().stride(), 1);
}

/// Being told changes nothing by itself: a graph that does not ask is not planned again.
#[test]
fn graphs_that_do_not_ask_stay_as_they_are() {
    let mut bench = Bench::new(vec![back_to_back()]);
    let mut seat = bench.seat(|_, graph| look(graph, None, Output::Color));
    let mut plans = |stride| {
        bench.stride = stride;
        bench.draw(&mut seat).unwrap();
        bench.engine.counters().plans
    };
    assert_eq!([plans(1), plans(4)], [1, 1]);
}
