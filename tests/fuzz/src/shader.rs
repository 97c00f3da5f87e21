//! WGSL: composing, bounding loops, validating, reflecting and compiling it.

use crate::device::draw;
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::graph::{Format, Graph, Groups, Output, Pass, Texture};

/// Takes the bytes as the text of a shading function, a compute pass and a module.
pub fn shader(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let mut graph = Graph::new();
    let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
    graph.pass(Pass::shading("shade", &text, "shade").target(color));
    graph.output(Output::Color, color);
    run(&graph);

    let mut graph = Graph::new();
    graph.pass(Pass::compute("main", &text, "main", Groups::Fixed([1; 3])));
    run(&graph);

    let wgsl = "#import own::module\n@compute @workgroup_size(1) fn main() {}";
    let mut graph = Graph::new();
    let pass = Pass::compute("main", wgsl, "main", Groups::Fixed([1; 3]));
    graph.pass(pass.module("own::module", "own.wgsl", &text));
    run(&graph);
}

fn run(graph: &Graph) {
    let structure = rmp_serde::to_vec_named(graph.structure()).expect("structures are encoded");
    draw(&EncodedGraph { structure, data: graph.data().to_vec() });
}
