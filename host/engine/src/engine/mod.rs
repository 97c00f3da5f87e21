//! One frame from request to pictures.

mod alone;
mod compute;
mod explain;
mod given;
mod held;
mod kept;
mod submission;
mod supply;
mod uniforms;

use crate::environment::Environments;
use crate::gpu::{Atomics, Gpu};
use crate::plugins::Hosted;
use crate::run::{
    CompileCounts, Image, Lending, PassReport, Pipelines, Plan, RenderError, Resources, checked,
    decode,
};
use crate::store::Store;
use crate::surfels::{
    Columns, DrawnCloud, Samples, SurfaceCounts, Surfaces, SurfelDrawing, Wanted,
};
pub use explain::{Explanation, FeatureUse, OutputUse, PassUse, ResourceUse};
pub use kept::Kept;
use std::time::Instant;
use submission::{Asked, Done, Submission};
pub use supply::{Supplier, Supply};
use surfelshop_api::abi::host_side::EncodedGraph;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{CloudFacts, CloudView, EnvironmentView, FrameRequest, Scene, View};

/// How an engine works.
#[derive(Clone, Debug)]
pub struct EngineOptions {
    /// Most surfels in one chunk; fewer where the device's bindings are smaller.
    pub chunk_surfels: u32,
    /// How surfels are drawn.
    pub surfels: SurfelDrawing,
    /// Whether 64-bit atomics are left unused, as on devices that have none.
    pub only_32_bit_atomics: bool,
    /// Whether radii that are all the same are a constant, where the device draws, and no column; by
    /// default on graphics cards. On software drivers the column takes no more: Mesa's llvmpipe was seen
    /// to take 2 bytes a surfel more while it draws without it.
    pub constant_radii: Option<bool>,
    /// Where textures that graphs want stored are kept for the next start, if anywhere.
    pub store: Option<Store>,
}

impl Default for EngineOptions {
    fn default() -> Self {
        Self {
            chunk_surfels: 1 << 20,
            surfels: SurfelDrawing::default(),
            only_32_bit_atomics: false,
            constant_radii: None,
            store: None,
        }
    }
}

/// What the engine did since it was made; tests and reports read it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counters {
    /// Shaders and pipelines compiled.
    pub compiled: CompileCounts,
    /// Parts of surface buffers made.
    pub surfaces: SurfaceCounts,
    /// Structures decoded and checked.
    pub plans: u32,
    /// Chunks of the last frame's clouds.
    pub chunks: usize,
    /// Columns uploaded.
    pub uploads: u32,
    /// Bytes of columns on the device now.
    pub column_bytes: u64,
    /// Bytes of columns in memory now, as the processor draws them.
    pub host_column_bytes: u64,
    /// Buffers of surfels made for graphs that read them as data.
    pub surfel_buffers: u32,
    /// Surfels that were drawn last, merged ones counting once. Where the processor draws, or a detail
    /// is asked for, those left out with their blocks are not among them, and groups are filled up to
    /// sixteen.
    pub drawn_surfels: usize,
    /// Environment maps uploaded.
    pub environments: u32,
    /// Bytes of environment maps on the device now.
    pub environment_bytes: u64,
    /// Bytes of surface buffers and of graphs' textures and buffers that are kept for frames to come.
    pub kept_bytes: u64,
    /// Pipelines that are kept.
    pub kept_pipelines: usize,
    /// Shader texts that are kept, composed and checked.
    pub kept_modules: usize,
}

/// A frame to be rendered.
#[derive(Clone, Copy)]
pub struct RenderRequest<'a> {
    /// The clouds of the scene.
    pub clouds: &'a [CloudView<'a>],
    /// Facts of the clouds.
    pub facts: &'a CloudFacts,
    /// Lights, exposure and surface settings.
    pub scene: &'a Scene,
    /// Camera, size and depth range.
    pub view: View,
    /// The light around the scene, where it has one.
    pub environment: Option<EnvironmentView<'a>>,
    /// The renderer's parameters.
    pub values: &'a Values,
    /// The pictures wanted.
    pub outputs: &'a [Output],
    /// Frames since something in this view changed.
    pub frame_index: u32,
    /// One surfel of so many is drawn, evenly along the curve that orders them in space, and so
    /// much larger that they cover the same area: a preview where 1, the whole, takes too long. 0
    /// is taken as 1. Where surfels are merged, it makes these coarser instead.
    pub stride: u32,
    /// Several surfels are drawn as one where that has at most this radius in pixels; 0, or a renderer
    /// that does not take merged surfels, draws all.
    pub detail_px: f32,
}

/// Merged surfels of this radius in pixels are about as many as the pixels that they cover.
const MOVING_DETAIL_PX: f32 = 1.0;

impl<'a> RenderRequest<'a> {
    /// The request as surfels are drawn: a preview has fewer and larger ones, or merged ones where
    /// these can be had.
    fn drawn(&self, merged: bool, scene: &'a mut Scene) -> Self {
        let stride = self.stride.max(1);
        let coarser = (stride as f32).sqrt();
        if merged {
            let least = if stride > 1 { MOVING_DETAIL_PX * coarser } else { 0.0 };
            return RenderRequest { stride: 1, detail_px: self.detail_px.max(least), ..*self };
        }
        scene.surface.radius_scale *= coarser;
        RenderRequest { scene, stride, detail_px: 0.0, ..*self }
    }
}

/// A rendered frame.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The requested pictures, in the order of the request.
    pub images: Vec<(Output, Image)>,
    /// The passes in the order they stand in the frame.
    pub passes: Vec<PassReport>,
    /// Bytes of the textures and buffers of the renderer's graph that the frame used, kept ones
    /// included.
    pub graph_bytes: u64,
    /// Whether surfels were merged where a detail asked for it: not all renderers take merged ones.
    pub merged: bool,
    /// Milliseconds in which columns were put in order and brought to where they are drawn.
    pub columns_ms: f64,
    /// Whether the renderer says that another frame would refine the picture.
    pub wants_another_frame: bool,
}

impl Rendered {
    /// The picture of an output, where it was requested.
    #[must_use]
    pub fn image(&self, output: &Output) -> Option<&Image> {
        self.images.iter().find(|(other, _)| other == output).map(|(_, image)| image)
    }
}

/// A renderer in a view: its instance, on a thread of its own, and the plan of its last structure.
pub struct RendererView {
    hosted: Hosted,
    scope: String,
    /// What it described last.
    graph: EncodedGraph,
    plan: Option<Plan>,
    /// The engine that made the plan, whose device its pipelines belong to.
    planned_by: u64,
    /// Tells this view from all others.
    serial: u64,
}

impl RendererView {
    /// Puts an instance of a renderer into a view; `scope` keeps the persistent resources of
    /// different renderers apart and is usually
    /// [`LoadedUnit::scope`](crate::plugins::LoadedUnit::scope).
    #[must_use]
    pub fn new(hosted: Hosted, scope: impl Into<String>) -> Self {
        let (graph, scope) = (EncodedGraph::default(), scope.into());
        Self { hosted, scope, graph, plan: None, planned_by: 0, serial: next_serial() }
    }

    /// The graph of the last frame.
    #[must_use]
    pub fn graph(&self) -> &EncodedGraph {
        &self.graph
    }
}

/// The device side: columns, pipelines, surfaces and resources of all views.
pub struct Engine {
    /// Tells this engine from all others of the process.
    serial: u64,
    gpu: Gpu,
    pipelines: Pipelines,
    columns: Columns,
    surfaces: Surfaces,
    resources: Resources,
    environments: Environments,
    samples: Samples,
    surfels: SurfelDrawing,
    /// Whether equal radii are a constant.
    constant_radii: bool,
    /// What is drawn with although it need not be.
    keeping: kept::Keeping,
    plans: u32,
    chunks: usize,
}

/// Tells engines apart, and what was planned by one before it was to keep something else.
fn next_serial() -> u64 {
    use std::sync::atomic::{AtomicU64, Ordering};
    static NEXT: AtomicU64 = AtomicU64::new(1);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

impl Engine {
    /// An engine on a device.
    ///
    /// # Errors
    /// Where a shader module of the host is broken.
    pub fn new(mut gpu: Gpu, options: &EngineOptions) -> Result<Self, RenderError> {
        if options.only_32_bit_atomics {
            gpu.atomics = Atomics::Only32;
        }
        let constant_radii = options.constant_radii.unwrap_or(!gpu.is_software());
        let mut columns =
            Columns::new(gpu.device.clone(), gpu.queue.clone(), options.chunk_surfels);
        columns.keep_radii(!constant_radii);
        Ok(Self {
            serial: next_serial(),
            pipelines: Pipelines::new(gpu.device.clone())?,
            columns,
            surfaces: Surfaces::default(),
            resources: Resources::with_store(options.store.clone()),
            environments: Environments::default(),
            samples: Samples::default(),
            surfels: options.surfels,
            constant_radii,
            keeping: kept::Keeping::default(),
            plans: 0,
            chunks: 0,
            gpu,
        })
    }

    /// The device.
    #[must_use]
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// What was done so far.
    #[must_use]
    pub fn counters(&self) -> Counters {
        Counters {
            compiled: self.pipelines.counts,
            surfaces: self.surfaces.counts,
            plans: self.plans,
            chunks: self.chunks,
            uploads: self.columns.uploads,
            column_bytes: self.columns.bytes(),
            host_column_bytes: self.columns.host_bytes(),
            surfel_buffers: self.samples.made,
            drawn_surfels: self.surfaces.n_drawn,
            environments: self.environments.uploads,
            environment_bytes: self.environments.bytes(),
            kept_bytes: self.surfaces.bytes() + self.resources.bytes(),
            kept_pipelines: self.pipelines.n_pipelines(),
            kept_modules: self.pipelines.n_modules(),
        }
    }

    /// Says whether a pipeline that leaves out what a scene lacks is compiled beside drawing, where one
    /// that has it can stand in, which makes the same picture. Else, and at first, drawing waits for it.
    pub fn compile_beside(&mut self, beside: bool) {
        self.pipelines.compiles_beside = beside;
    }

    /// Has clouds of so many surfels and more drawn with all columns that they have, whether something
    /// reads them or not: putting so many in order once more, for a column that is read after all, takes
    /// seconds.
    pub fn keep_whole_from(&mut self, n_surfels: usize) {
        self.columns.keep_whole_from(n_surfels);
    }

    /// Draws surfels anew in the next frame even where the same view of them was drawn: for frames
    /// whose time is to be theirs alone.
    pub fn forget_surfaces(&mut self) {
        self.surfaces.forget();
    }

    /// Has a renderer describe a frame and runs it.
    ///
    /// # Errors
    /// Where the plugin fails, its graph breaks a rule, a cloud cannot be drawn, or the device
    /// fails. The engine can be used on, unless its device is lost.
    pub fn render(
        &mut self,
        renderer: &mut RendererView,
        request: &RenderRequest<'_>,
    ) -> Result<Rendered, RenderError> {
        let rendered = self.attempt(renderer, request);
        rendered.map_err(|error| self.cause(error))
    }

    /// Everything fails on a lost device, each thing in words of its own; the loss is the cause.
    fn cause(&self, error: RenderError) -> RenderError {
        match self.gpu.lost() {
            Some(reason) => RenderError::DeviceLost(reason.to_owned()),
            None => error,
        }
    }

    fn attempt(
        &mut self,
        renderer: &mut RendererView,
        request: &RenderRequest<'_>,
    ) -> Result<Rendered, RenderError> {
        self.check_size(request.view.size_px)?;
        let asked = FrameRequest {
            view: request.view,
            scene: request.scene.clone(),
            cloud: request.facts.clone(),
            frame_index: request.frame_index,
            values: request.values.clone(),
            environment: request.environment.map(|given| given.environment.clone()),
        };
        let encoded = renderer.hosted.frame_in_motion(asked, request.stride);
        let encoded = encoded.map_err(RenderError::Plugin)?;
        let drawn = self.draw(renderer, &encoded, request);
        renderer.graph = encoded;
        drawn
    }

    fn draw(
        &mut self,
        renderer: &mut RendererView,
        encoded: &EncodedGraph,
        request: &RenderRequest<'_>,
    ) -> Result<Rendered, RenderError> {
        self.replan(renderer, encoded, request.view.size_px)?;
        let Some(plan) = &renderer.plan else {
            return Err(RenderError::Graph("there is none".to_owned()));
        };
        let outputs = self.keeping.outputs(request.outputs);
        let n_outputs = request.outputs.len();
        let request = &RenderRequest { outputs: &outputs, ..*request };
        let asked = Asked::new(plan, request.outputs)?;
        self.resources.next_frame(request.view.size_px);
        self.pipelines.next_frame();
        let one_by_one = plan.shades_surfels();
        let on_host = self.surfels.on_host(&self.gpu) && !one_by_one;
        let drawing = if one_by_one { SurfelDrawing::Quads } else { self.surfels };
        let detailed = request.detail_px > 0.0 && plan.takes_merged_surfels() && !one_by_one;
        // Previews by the device have one surfel of so many: merged ones take memory.
        let merged = detailed || on_host && request.stride > 1;
        // As data surfels are as the scene has them, in previews, too.
        let given = self.surfel_buffers(&asked, plan, request)?;
        let mut scene = request.scene.clone();
        let request = &request.drawn(merged, &mut scene);
        let started = Instant::now();
        let clouds = self.drawn_clouds(request, Some(asked.wanted()), on_host)?;
        let columns_ms = started.elapsed().as_secs_f64() * 1e3;
        let device = self.gpu.device.clone();
        let work = Submission {
            gpu: &self.gpu,
            pipelines: &mut self.pipelines,
            surfaces: &mut self.surfaces,
            resources: &mut self.resources,
            environments: &mut self.environments,
            plan,
            lending: Lending { scope: &renderer.scope, view: renderer.serial, given },
            data: &encoded.data,
            request,
            asked,
            clouds: &clouds,
            drawing,
        };
        let done = checked(&device, || work.run()).map_err(RenderError::Device);
        match done.and_then(|done| done) {
            Ok((mut rendered, Done { lent, written })) => {
                rendered.images.truncate(n_outputs);
                self.resources.give_back(lent, &written);
                self.resources.save(&self.gpu);
                Ok(Rendered { columns_ms, merged, ..rendered })
            }
            Err(error) => {
                self.surfaces.forget();
                Err(error)
            }
        }
    }

    /// The clouds as they are drawn, with the columns that are wanted where that happens; without a wish
    /// of its own a frame is drawn with what others want.
    fn drawn_clouds(
        &mut self,
        request: &RenderRequest<'_>,
        wanted: Option<Wanted>,
        on_host: bool,
    ) -> Result<Vec<DrawnCloud>, RenderError> {
        self.columns.next_frame(wanted.map(|wanted| self.keeping.wanted(wanted)));
        for cloud in request.clouds {
            self.keeping.make(cloud);
        }
        let keeping = &self.keeping;
        let drawn = |cloud: &CloudView<'_>| match on_host {
            true => self.columns.on_host(&keeping.with(cloud), request.detail_px > 0.0, &|_| true),
            false => self.columns.cloud(&keeping.with(cloud), request.detail_px > 0.0, &|_| true),
        };
        let clouds = request.clouds.iter().map(drawn).collect::<Result<Vec<_>, _>>()?;
        self.chunks = clouds.iter().map(DrawnCloud::n_chunks).sum();
        Ok(clouds)
    }

    fn check_size(&self, size: [u32; 2]) -> Result<(), RenderError> {
        let most = self.gpu.device.limits().max_texture_dimension_2d;
        if size.iter().any(|&side| side == 0 || side > most) {
            return Err(RenderError::Device(format!(
                "a picture of {} x {} was asked for; each side must be 1 to {most}",
                size[0], size[1]
            )));
        }
        Ok(())
    }

    /// Decodes and checks the structure, unless it is the one planned last.
    fn replan(
        &mut self,
        renderer: &mut RendererView,
        encoded: &EncodedGraph,
        size: [u32; 2],
    ) -> Result<(), RenderError> {
        let known = renderer.plan.as_ref().is_some_and(|plan| plan.size == size)
            && renderer.planned_by == self.serial
            && renderer.graph.structure == encoded.structure;
        if known {
            return Ok(());
        }
        renderer.plan = None;
        let mut structure = decode(encoded).map_err(RenderError::Plugin)?;
        self.keeping.restore(&mut structure);
        self.plans += 1;
        renderer.plan = Some(Plan::new(structure, size, &self.gpu, &mut self.pipelines)?);
        renderer.planned_by = self.serial;
        Ok(())
    }
}
