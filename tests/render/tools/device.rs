//! Graphs that tools have run on the device.

use crate::tools::fixture::{cloud, done, end, generations, options, start, values};
use surfelshop_api::params::{Value, Values};
use surfelshop_render::GpuOptions;
use surfelshop_runtime::boundary::Fault;
use surfelshop_runtime::tools::{Ended, ToolOptions};

#[test]
fn a_graph_computes_and_its_buffers_come_back() {
    // No multiple of a workgroup.
    let cloud = cloud(1001);
    let done = done("doubles-on-gpu", &Values::new(), &cloud, &options());
    let edited = done.edited.unwrap();
    let expected: Vec<f32> = cloud.radii().iter().map(|radius| 2.0 * radius).collect();
    assert_eq!(edited.cloud.floats("doubled", 1), expected, "doubling is exact");
    assert!(done.device.is_some());
}

#[test]
fn what_only_pictures_have_is_refused_with_the_reason() {
    for (graph, words) in [
        ("draws", "a tool's graph has compute passes only; pass `shade` draws"),
        ("keeps", "a tool's graph keeps nothing on the device; `doubled` is to be kept"),
        ("adds up", "a tool's graph keeps nothing on the device; `doubled` is to be kept"),
        ("looks", "a tool's graph has nothing to look at; camera `lamp` looks"),
        ("reads surfels", "a tool's graph has no scene to fill `surfels` with surfels of"),
        ("sees", "pass `look`: `surfelshop::view::view` belongs to pictures"),
        ("broken", "pass `double`: `doubled` (a writable storage buffer) is not bound"),
    ] {
        let (cloud, graph) = (cloud(100), values([("graph", Value::Text(graph.to_owned()))]));
        let before = generations(&cloud);
        let ended = end(start("doubles-on-gpu", &graph, &cloud, &options()));
        let Ended::Failed(Fault::Error(line)) = ended else { panic!("{ended:?}") };
        assert!(line.contains(words), "{line}");
        assert_eq!(generations(&cloud), before);
    }
}

#[test]
fn a_tool_is_told_where_there_is_no_device() {
    let device =
        GpuOptions { adapter: Some("no such adapter".to_owned()), ..GpuOptions::default() };
    let options = ToolOptions { device: device.into(), ..options() };
    let ended = end(start("doubles-on-gpu", &Values::new(), &cloud(10), &options));
    let Ended::Failed(Fault::Error(line)) = ended else { panic!("{ended:?}") };
    assert!(line.contains("no graphics adapter"), "{line}");
}
