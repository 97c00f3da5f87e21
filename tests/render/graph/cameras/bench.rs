//! Renderers that describe what a test tells them, and frames that they make.

use glam::{DVec3, Vec3};
use std::sync::{Mutex, PoisonError};
use surfelshop_api::graph::{BufferId, CameraId, Output};
use surfelshop_api::params::{Value, Values};
use surfelshop_api::prelude::*;
use surfelshop_api::{CloudFacts, Scene, View, static_plugin};
use surfelshop_cloud::Cloud;
use surfelshop_render::{
    Engine, EngineOptions, GpuOptions, PassState, RenderError, RenderRequest, Rendered,
    RendererView, SurfelDrawing,
};
use surfelshop_tests::clouds::Surfels;
use surfelshop_tests::stage;

static_plugin! { id: "org.surfelshop.test.seats", renderers: [Description] }

params! {
    /// Which graph.
    pub struct Script {
        /// Its number.
        script: u32 { default: 0, range: 0..=10_000 },
    }
}

type Describe = Box<dyn Fn(&Frame<Script>, &mut Graph) + Send>;

static SCRIPTS: Mutex<Vec<Describe>> = Mutex::new(Vec::new());

/// Describes what the script of its number says.
struct Description;

impl Renderer for Description {
    const INFO: UnitInfo = UnitInfo::new("told", "Description", "Describes what it is told.");
    type Params = Script;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, frame: &Frame<Script>, graph: &mut Graph) -> Result<()> {
        let scripts = SCRIPTS.lock().unwrap_or_else(PoisonError::into_inner);
        scripts[frame.params.script as usize](frame, graph);
        Ok(())
    }
}

/// A renderer in a view of its own.
pub(crate) struct CameraSlot {
    renderer: RendererView,
    values: Values,
}

/// An engine, and what is drawn with it.
pub(crate) struct Bench {
    pub engine: Engine,
    pub clouds: Vec<Cloud>,
    pub scene: Scene,
    pub view: View,
    pub outputs: Vec<Output>,
    pub stride: u32,
}

/// Pixels on a side of the pictures.
pub(crate) const SIZE: u32 = 32;

impl Bench {
    pub(crate) fn new(clouds: Vec<Cloud>) -> Self {
        Self::drawing(SurfelDrawing::Automatic, clouds)
    }

    pub(crate) fn drawing(surfels: SurfelDrawing, clouds: Vec<Cloud>) -> Self {
        // Clouds of the tests have several chunks.
        let options = EngineOptions { surfels, chunk_surfels: 64, ..EngineOptions::default() };
        Self {
            engine: stage::engine_with(&GpuOptions::default(), &options),
            clouds,
            scene: Scene::default(),
            view: stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, SIZE),
            outputs: vec![Output::Color],
            stride: 1,
        }
    }

    /// A renderer that describes this.
    pub(crate) fn seat(
        &self,
        describe: impl Fn(&Frame<Script>, &mut Graph) + Send + 'static,
    ) -> CameraSlot {
        let mut scripts = SCRIPTS.lock().unwrap_or_else(PoisonError::into_inner);
        scripts.push(Box::new(describe));
        let number = Value::Int(scripts.len() as i64 - 1);
        drop(scripts);
        let renderer = stage::static_renderer::<SurfelshopPackage>(&self.engine, 0);
        CameraSlot { renderer, values: [("script".to_owned(), number)].into() }
    }

    pub(crate) fn draw(
        &mut self,
        seat: &mut CameraSlot,
    ) -> std::result::Result<Rendered, RenderError> {
        let clouds: Vec<_> = self.clouds.iter().map(Cloud::view).collect();
        let request = RenderRequest {
            clouds: &clouds,
            facts: &together(&self.clouds),
            scene: &self.scene,
            view: self.view,
            environment: None,
            values: &seat.values,
            outputs: &self.outputs,
            frame_index: 0,
            stride: self.stride,
            detail_px: 0.0,
            parts: None,
            eye_dome: None,
        };
        self.engine.render(&mut seat.renderer, &request)
    }

    /// What a renderer shows of a buffer of four floats each.
    pub(crate) fn values(&mut self, seat: &mut CameraSlot) -> Vec<[f32; 4]> {
        let rendered = self.draw(seat).unwrap();
        rendered.image(&Output::Color).unwrap().data.as_chunks::<4>().0.to_vec()
    }

    /// The one line that it is refused with; the engine works on afterwards.
    pub(crate) fn refusal(&mut self, seat: &mut CameraSlot) -> String {
        let line = self.draw(seat).unwrap_err().to_string();
        assert!(!line.contains('\n'), "more than a line: {line}");
        let mut good = self.seat(|_, graph| {
            let values = graph.upload("values", &[0; 16]);
            show(graph, values);
        });
        self.draw(&mut good).unwrap();
        line
    }
}

fn together(clouds: &[Cloud]) -> CloudFacts {
    let mut whole = clouds.first().map(|cloud| cloud.facts().clone()).unwrap_or_default();
    for facts in clouds.iter().skip(1).map(Cloud::facts) {
        whole.n_surfels += facts.n_surfels;
        whole.bounds_min = whole.bounds_min.min(facts.bounds_min);
        whole.bounds_max = whole.bounds_max.max(facts.bounds_max);
        whole.objects.extend(&facts.objects);
        whole.colored.extend(&facts.colored);
    }
    whole
}

const SHOW: &str = "
    #import surfelshop::view
    var<storage, read> values: array<vec4<f32>>;
    @fragment fn show(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {
        let i = u32(p.x) + u32(p.y) * u32(view::view.size_px.x);
        return select(vec4(0.0), values[min(i, arrayLength(&values) - 1u)], i < arrayLength(&values));
    }
";

/// Shows a buffer as the picture, four floats a pixel.
pub(crate) fn show(graph: &mut Graph, values: BufferId) {
    show_as(graph, values, Output::Color);
}

pub(crate) fn show_as(graph: &mut Graph, values: BufferId, output: Output) {
    let name = output.name();
    let picture = graph.texture(&name, Texture::view_sized(Format::Rgba32Float));
    let pass = Pass::fullscreen(&format!("show {name}"), SHOW, "show");
    graph.pass(pass.bind("values", values).target(picture));
    graph.output(output, picture);
}

/// What a pass sees in the middle of its picture, in four rows: albedo and whether something is there,
/// position and depth, to the eye and width, towards the first light and height.
pub(crate) const LOOK: &str = "
    #import surfelshop::surface
    #import surfelshop::view
    #import surfelshop::light as lamps
    var<storage, read_write> found: array<vec4<f32>>;
    @compute @workgroup_size(1) fn look() {
        let size = view::view.size_px;
        let s = surface::surface_at(vec2<u32>(size) / 2u);
        found[0] = vec4(s.albedo, select(0.0, 1.0, s.covered));
        found[1] = vec4(s.position, s.depth);
        found[2] = vec4(s.to_eye, size.x);
        found[3] = vec4(lamps::arriving(0u, s.position).towards, size.y);
    }
";

/// Looks from a camera, or from the view's own, and shows what it finds.
pub(crate) fn look(graph: &mut Graph, camera: Option<CameraId>, output: Output) {
    let found = graph.buffer("found", Buffer::new(64));
    let name = format!("look for {}", output.name());
    let pass = Pass::compute(&name, LOOK, "look", Groups::Fixed([1; 3])).bind("found", found);
    graph.pass(match camera {
        Some(camera) => pass.seen_from(camera),
        None => pass,
    });
    show_as(graph, found, output);
}

/// A red disc that faces the viewer, a blue one behind it that faces away.
pub(crate) fn back_to_back() -> Cloud {
    let mut discs = Surfels::default();
    discs.push(Vec3::new(0.0, 0.0, 0.1), Vec3::Z, 0.5);
    discs.push(Vec3::new(0.0, 0.0, -0.1), Vec3::NEG_Z, 0.5);
    discs.colors = vec![[255, 0, 0], [0, 0, 255]];
    discs.cloud()
}

/// A view from behind.
pub(crate) fn behind() -> View {
    let view = stage::view(DVec3::new(0.0, 0.0, -3.0), DVec3::ZERO, 1);
    View { size_px: [5, 7], ..view }
}

/// Passes that ran, and those that were kept.
pub(crate) fn in_state(rendered: &Rendered, state: PassState) -> Vec<&str> {
    let passes = rendered.passes.iter().filter(|pass| pass.state == state);
    passes.map(|pass| pass.name.as_str()).collect()
}
