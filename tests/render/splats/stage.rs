//! Ways to draw, and pictures of splats.

use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_render::{Engine, EngineOptions, GpuOptions, Rendered, RendererView, SurfelDrawing};
use surfelshop_tests::stage;

/// A way to draw surfels, with the renderer.
pub(crate) struct Way {
    pub(crate) name: &'static str,
    pub(crate) engine: Engine,
    pub(crate) renderer: RendererView,
}

impl Way {
    fn new(name: &'static str, options: EngineOptions) -> Self {
        let engine = stage::engine_with(&GpuOptions::default(), &options);
        let renderer =
            stage::built_renderer(&engine, "surfelshop_phong_splatting", "phong-splatting");
        Self { name, engine, renderer }
    }

    /// Every way to draw.
    pub(crate) fn all() -> [Self; 4] {
        let as_ = |surfels| EngineOptions { surfels, ..EngineOptions::default() };
        let narrow = EngineOptions { only_32_bit_atomics: true, ..as_(SurfelDrawing::Compute) };
        [
            Self::new("quads", as_(SurfelDrawing::Quads)),
            Self::new("compute", as_(SurfelDrawing::Compute)),
            Self::new("compute with 32 bits", narrow),
            Self::new("processor", as_(SurfelDrawing::Processor)),
        ]
    }

    /// Pictures of a cloud with these settings of the renderer.
    pub(crate) fn draw(
        &mut self,
        cloud: &Cloud,
        scene: &Scene,
        view: View,
        values: &Values,
        outputs: &[Output],
    ) -> Rendered {
        let (engine, renderer) = (&mut self.engine, &mut self.renderer);
        stage::render_with(engine, renderer, cloud, scene, view, values, outputs).unwrap()
    }
}

/// A choice of the renderer's.
pub(crate) fn choice(id: &str, value: &str) -> (String, Value) {
    (id.to_owned(), Value::Text(value.to_owned()))
}

/// A mode of the renderer.
pub(crate) fn mode(mode: &str) -> Values {
    [choice("mode", mode)].into()
}
