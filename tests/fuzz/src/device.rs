//! An engine on a device that computes nothing, and a small scene to draw with it.

use glam::DVec3;
use std::sync::Mutex;
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::columns::{NORMAL, POSITION, RADIUS};
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{Camera, Projection, Scene, View};
use surfelshop_cloud::{Buffer, Cloud, Column};
use surfelshop_render::{
    Engine, EngineOptions, Gpu, RenderError, RenderRequest, Rendered, RendererView, SurfelDrawing,
};
use surfelshop_runtime::plugins::Hosted;

/// Inputs after which the engine is made anew, so that what it keeps of each adds up to little.
const INPUTS_OF_AN_ENGINE: u32 = 64;

/// Draws a graph of a third party, and computes it as a tool's.
pub(crate) fn draw(graph: &EncodedGraph) {
    // Not of a thread: wgpu cannot end a device while a thread ends.
    static ENGINE: Mutex<Option<(Engine, u32)>> = Mutex::new(None);
    crate::allow_contained_panics();
    // An engine that a panic left behind is not used again: the fuzzer ends, and tests have failed.
    let mut kept = ENGINE.lock().expect("no input panicked");
    let (engine, used) = kept.get_or_insert_with(|| (engine(), 0));
    // Any answer is right as long as there is one.
    drop(draw_with(engine, graph));
    drop(engine.compute(graph, &[0]));
    *used += 1;
    if *used == INPUTS_OF_AN_ENGINE {
        *kept = None;
    }
}

/// Draws it twice: the second frame is the one that is recognised.
fn draw_with(engine: &mut Engine, graph: &EncodedGraph) -> Result<Rendered, RenderError> {
    let cloud = cloud();
    let camera = Camera {
        eye: 3.0 * DVec3::Z,
        target: DVec3::ZERO,
        up: DVec3::Y,
        projection: Projection::Perspective { fov_y: 0.8 },
    };
    let hosted = Hosted::replaying(graph.clone()).expect("there is a thread");
    let mut view = RendererView::new(hosted, "fuzz");
    let outputs = [Output::Color, Output::Depth];
    let request = RenderRequest {
        clouds: &[cloud.view()],
        facts: cloud.facts(),
        scene: &Scene::default(),
        view: View { camera, size_px: [16, 9], near: 0.01, far: 10.0 },
        values: &Values::new(),
        outputs: &outputs,
        frame_index: 0,
        environment: None,
        stride: 1,
        detail_px: 0.0,
        parts: None,
        eye_dome: None,
    };
    engine.render(&mut view, &request)?;
    engine.render(&mut view, &request)
}

/// An engine without a driver behind it, and with the limits that WebGPU promises.
fn engine() -> Engine {
    let gpu = Gpu::noop().expect("the no-op device is always there");
    let options = EngineOptions { surfels: SurfelDrawing::Quads, ..EngineOptions::default() };
    Engine::new(gpu, &options).expect("the host's shaders compose")
}

/// Three surfels.
fn cloud() -> Cloud {
    let column = |name: &str, components: u32, values: Vec<f32>| {
        Column::new(name, components, Buffer::F32(values))
    };
    let columns = vec![
        column(POSITION, 3, vec![0.0, 0.0, 0.0, 0.5, 0.0, 0.1, 0.0, 0.5, -0.1]),
        column(NORMAL, 3, vec![0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]),
        column(RADIUS, 1, vec![0.3, 0.2, 0.4]),
    ];
    Cloud::new(DVec3::ZERO, columns).expect("columns of three surfels")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_good_graph_asks_for_is_done_on_a_device_that_computes_nothing() {
        for bytes in [
            include_bytes!("../../stored/3.3/flat.graph").as_slice(),
            include_bytes!("../corpus/graph/seeds/cameras.graph"),
            include_bytes!("../corpus/graph/seeds/ink.graph"),
            include_bytes!("../corpus/graph/seeds/procedural.graph"),
        ] {
            let graph = EncodedGraph::from_file(bytes).unwrap();
            let rendered =
                draw_with(&mut engine(), &graph).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(rendered.images.len(), 2);
        }
    }
}
