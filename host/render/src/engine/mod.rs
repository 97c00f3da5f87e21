//! One frame from request to pictures.

mod ablation;
mod column_buffers;
mod compute;
mod explain;
mod eye_dome;
mod frame_pass;
mod needs;
mod options;
mod output_request;
mod prepared_view;
mod release;
mod renderer_view;
mod request;
mod several;
mod surface_only;
mod surfel_buffers;
mod tool_device;
mod upload;

use crate::environment_map::Environments;
use crate::gpu::{Atomics, Gpu};
use crate::graph::{
    Lending, MadeFor, PassScratch, Pipelines, Plan, RenderError, Resources, SceneLights, checked,
};
use crate::stages::{Clocks, StageTime};
use crate::surfels::{
    ColumnBuffers, ColumnDemand, Columns, DrawnCloud, STOPPED, Samples, Surfaces, SurfelDrawing,
    geometry_of,
};
pub use ablation::Restored;
pub use explain::{Explanation, FeatureUse, OutputUse, PassUse, RendererUse};
use frame_pass::Submission;
use glam::Vec2;
pub use options::{Counters, EngineOptions};
use output_request::OutputRequest;
use renderer_view::next_serial;
pub use renderer_view::{Companion, RendererView};
pub use request::{PartOf, Parts, RenderRequest, Rendered, RendererPart};
use several::Shared;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::frame::OnDevice;
use surfelshop_api::graph::{Output, Structure, Work};
use surfelshop_api::{CloudView, FrameRequest};
use surfelshop_image::Image;
use surfelshop_runtime::boundary::decode;
pub use upload::{ColumnUploader, PreparedColumns};

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
    given: ColumnBuffers,
    scratch: PassScratch,
    /// Most splats whose columns are read at once.
    part_len: u32,
    surfels: SurfelDrawing,
    /// Whether equal radii are a constant.
    constant_radii: bool,
    /// Whether surfels that are seen from behind have a colour of their own.
    tints_backs: bool,
    /// What is drawn with although it need not be.
    keeping: ablation::Keeping,
    /// Whether depths of graphs that draw clouds themselves show the surface, too.
    whole_depths: bool,
    plans: u32,
    /// Frames that were stopped.
    stopped: u32,
    chunks: usize,
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
            given: ColumnBuffers::default(),
            scratch: PassScratch::default(),
            part_len: options.part_splats.max(1),
            surfels: options.surfels,
            constant_radii,
            tints_backs: false,
            keeping: ablation::Keeping::default(),
            whole_depths: false,
            plans: 0,
            stopped: 0,
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
            stopped: self.stopped,
            chunks: self.chunks,
            uploads: self.columns.uploads,
            patched_columns: self.columns.patches,
            sent_column_bytes: self.columns.sent_bytes,
            column_bytes: self.columns.bytes(),
            host_column_bytes: self.columns.host_bytes(),
            surfel_buffers: self.samples.made,
            column_buffers: self.given.made,
            given_column_bytes: self.given.bytes(),
            drawn_surfels: self.surfaces.n_drawn,
            resident_uploads: self.resources.resident().0,
            resident_bytes: self.resources.resident().1,
            environments: self.environments.uploads,
            environment_bytes: self.environments.bytes(),
            kept_bytes: self.surfaces.bytes()
                + self.resources.bytes()
                + self.scratch.bytes()
                + self.gpu.transfers.bytes(),
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

    /// Has what clouds are drawn from kept together with what painted ones are made of: 4 bytes a surfel, and for merged
    /// ones mostly one, at most 8. Without it a change of one surfel's colour puts all in order anew.
    pub fn expect_edits(&mut self, expects: bool) {
        self.columns.expects_edits = expects;
    }

    /// Has surfels that are seen from behind drawn with [`crate::BACK_ALBEDO`], which shows where their normals
    /// face: not in what a renderer draws itself. At first all have their own.
    pub fn tint_backs(&mut self, tints: bool) {
        self.tints_backs = tints;
    }

    /// Draws surfels anew in the next frame even where the same view of them was drawn: for frames
    /// whose time is to be theirs alone.
    pub fn forget_surfaces(&mut self) {
        self.surfaces.forget();
    }

    /// Says whether views are drawn one after the other and none again, as those of a film are. Of others the surfels of
    /// the last few are kept, for when one of them is drawn again; of these only the last, in whose memory the next is
    /// drawn. Pictures are the same. At first views may come again.
    pub fn draw_in_passing(&mut self, in_passing: bool) {
        self.surfaces.passing = in_passing;
    }

    /// From now until [`Engine::stages`] is called, tells what the stages of frames take: each is waited for by itself,
    /// so that a frame as a whole takes longer.
    pub fn tell_stages(&mut self, clocks: Clocks) {
        self.gpu.stages.begin(clocks);
    }

    /// Says that everything since the last stage was this one: what is done with a picture behind the engine.
    pub fn end_stage(&self, name: &str) {
        self.gpu.stages.end(name);
    }

    /// The stages that were told, in their order; those of several frames are added up.
    pub fn stages(&mut self) -> Vec<StageTime> {
        self.gpu.stages.take()
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
        self.render_shifted(renderer, request, Vec2::ZERO)
    }

    /// The same with the picture seen in each pixel at `shift_px` from its centre, pixels, y downwards, each less than
    /// half a pixel either way: one of the frames of an antialiased picture. The renderer is not told of it; what its
    /// graph draws by way of the view's projection, surface and shader modules is shifted, and its own cameras are not.
    ///
    /// # Errors
    /// As [`Engine::render`].
    pub fn render_shifted(
        &mut self,
        renderer: &mut RendererView,
        request: &RenderRequest<'_>,
        shift_px: Vec2,
    ) -> Result<Rendered, RenderError> {
        let rendered = match request.eye_dome {
            Some(how) if request.outputs.contains(&Output::Color) => {
                self.attempt_darkened(how, renderer, request, shift_px)
            }
            _ => self.attempt(renderer, request, shift_px),
        };
        rendered.map_err(|error| self.cause(error))
    }

    /// Has frames end with [`RenderError::Stopped`] soon after this becomes true, where the CPU draws surfels.
    pub fn stop_when(&mut self, stop: Arc<AtomicBool>) {
        self.surfaces.stop = Some(stop);
    }

    /// Everything fails on a lost device, each thing in words of its own; the loss is the cause. What was stopped did
    /// not fail.
    fn cause(&mut self, error: RenderError) -> RenderError {
        let stop = self.surfaces.stop.as_ref();
        let is_stopped = stop.is_some_and(|stop| stop.load(Ordering::Relaxed));
        match self.gpu.lost() {
            Some(reason) => RenderError::DeviceLost(reason.to_owned()),
            None if is_stopped && matches!(&error, RenderError::Host(text) if text == STOPPED) => {
                self.stopped += 1;
                RenderError::Stopped
            }
            None => error,
        }
    }

    fn attempt(
        &mut self,
        renderer: &mut RendererView,
        request: &RenderRequest<'_>,
        shift_px: Vec2,
    ) -> Result<Rendered, RenderError> {
        self.check_size(request.view.size_px)?;
        match renderer.others.is_empty() {
            true => self.attempt_one(renderer, request, shift_px),
            false => self.attempt_several(renderer, request, shift_px),
        }
    }

    /// The same of one renderer that draws all.
    fn attempt_one(
        &mut self,
        renderer: &mut RendererView,
        request: &RenderRequest<'_>,
        shift_px: Vec2,
    ) -> Result<Rendered, RenderError> {
        if let Some(missing) = needs::missing(&renderer.needs, request.facts) {
            return Err(RenderError::Needs(missing));
        }
        let asked = FrameRequest {
            view: request.view,
            scene: request.scene.clone(),
            cloud: request.facts.clone(),
            frame_index: request.frame_index,
            values: request.values.clone(),
            environment: request.environment.map(|given| given.environment.clone()),
        };
        let on_device = self.on_device(renderer);
        let encoded = renderer.hosted.frame_on_device(asked, request.stride, on_device);
        let encoded = encoded.map_err(RenderError::Plugin)?;
        let planned = self.replan(renderer, &encoded, request, false);
        renderer.graph = encoded;
        planned?;
        self.gpu.stages.end("graph");
        let plan = renderer.plan.as_ref();
        let shared = plan.map(|plan| Shared::alone(plan, request.detail_px)).unwrap_or_default();
        self.draw_with_whole_depths(renderer, request, Shared { shift_px, ..shared })
    }

    /// The bytes that a renderer need not send.
    fn on_device(&self, renderer: &RendererView) -> OnDevice {
        let resident = match renderer.sends_all {
            true => Vec::new(),
            false => self.resources.resident_of(&renderer.scope),
        };
        OnDevice { resident }
    }

    /// Runs the graph that a renderer described last; also returns the pictures that the host makes besides.
    fn draw_planned(
        &mut self,
        renderer: &RendererView,
        request: &RenderRequest<'_>,
        shared: &Shared,
    ) -> Result<(Rendered, Vec<Image>), RenderError> {
        let Some(plan) = &renderer.plan else {
            return Err(RenderError::Graph("there is none".to_owned()));
        };
        let outputs = self.keeping.outputs(request.outputs);
        let n_outputs = request.outputs.len();
        let request = &RenderRequest { outputs: &outputs, ..*request };
        let asked = OutputRequest::new(plan, request.outputs, &shared.entries)?;
        self.resources.next_frame(request.view.size_px);
        self.pipelines.next_frame();
        self.scratch.next_frame();
        let one_by_one = shared.one_by_one;
        let on_host = self.surfels.on_host(&self.gpu) && !one_by_one;
        let drawing = if one_by_one { SurfelDrawing::Quads } else { self.surfels };
        // Previews by the device have one surfel of so many: merged ones take memory.
        let merged = shared.detailed || on_host && request.stride > 1;
        // As data surfels are as the scene has them, in previews, too.
        let given = self.surfel_buffers(&asked, plan, request)?;
        let columns = self.column_buffers(&asked, plan, request)?;
        let mut scene = request.scene.clone();
        let request = &request.drawn(merged, &mut scene);
        let started = Instant::now();
        let demand = shared.demand.unwrap_or_else(|| asked.wanted());
        let clouds = self.drawn_clouds(request, Some(demand), on_host, &shared.taken)?;
        let columns_ms = started.elapsed().as_secs_f64() * 1e3;
        self.gpu.stages.end("columns");
        let device = self.gpu.device.clone();
        let work = Submission {
            gpu: &self.gpu,
            pipelines: &mut self.pipelines,
            surfaces: &mut self.surfaces,
            resources: &mut self.resources,
            environments: &mut self.environments,
            plan,
            lending: Lending { scope: &renderer.scope, view: renderer.serial, given, columns },
            data: &renderer.graph.data,
            own: shared.own.as_deref(),
            request,
            shift_px: shared.shift_px,
            asked,
            clouds: &clouds,
            scratch: &mut self.scratch,
            splats: self.surfels.of_splats(&self.gpu),
            drawing,
            tints_backs: self.tints_backs,
        };
        let done = checked(&device, || work.run()).map_err(RenderError::Device);
        match done.and_then(|done| done) {
            Ok(mut frame) => {
                frame.images.truncate(n_outputs);
                self.resources.give_back(frame.resources, &mut frame.written, plan);
                self.resources.save(&self.gpu);
                let rendered = Rendered {
                    images: frame.images,
                    passes: frame.passes,
                    graph_bytes: frame.graph_bytes,
                    merged,
                    columns_ms,
                    wants_another_frame: plan.structure.wants_another_frame,
                    parts: Vec::new(),
                };
                Ok((rendered, frame.of_host))
            }
            Err(error) => {
                self.surfaces.forget();
                Err(error)
            }
        }
    }

    /// The clouds as they are drawn, with the columns that are wanted where that happens; without a wish
    /// of its own a frame is drawn with what others want.
    fn drawn_clouds<'a>(
        &mut self,
        request: &RenderRequest<'a>,
        wanted: Option<ColumnDemand>,
        on_host: bool,
        taken: &[u32],
    ) -> Result<Vec<DrawnCloud<'a>>, RenderError> {
        self.columns.next_frame(wanted.map(|wanted| self.keeping.wanted(wanted)));
        for cloud in request.clouds {
            self.keeping.make(cloud);
        }
        let keeping = &self.keeping;
        let columns = &mut self.columns;
        let drawn = |(number, cloud): (usize, &CloudView<'a>)| {
            let PartOf { object, is_part, is_merged } = request.part_of(number);
            let merged = request.detail_px > 0.0 && !is_part;
            let drawn = match on_host {
                true => columns.on_host(&keeping.with(cloud), merged, &|_| true),
                false => columns.cloud(&keeping.with(cloud), merged, &|_| true),
            };
            let drawn = drawn?;
            let round_reach = if is_merged { f32::INFINITY } else { drawn.round_reach };
            // No column of it is among those that are made for clouds without them.
            let geometry = if on_host { Some(geometry_of(cloud)?) } else { None };
            Ok(DrawnCloud { object, round_reach, geometry, ..drawn })
        };
        let is_drawn = |(number, _): &(usize, _)| !taken.contains(&request.part_of(*number).object);
        let clouds = request.clouds.iter().enumerate().filter(is_drawn).map(drawn);
        let clouds = clouds.collect::<Result<Vec<_>, RenderError>>()?;
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
        request: &RenderRequest<'_>,
        hidden: bool,
    ) -> Result<(), RenderError> {
        let made_for = MadeFor {
            size: request.view.size_px,
            is_sandboxed: renderer.is_confined,
            lights: SceneLights::of(&request.scene.lights),
        };
        let known = renderer.plan.as_ref().is_some_and(|plan| plan.made_for == made_for)
            && renderer.hidden == hidden
            && renderer.planned_by == self.serial
            && renderer.graph.structure == encoded.structure;
        if known {
            return Ok(());
        }
        renderer.plan = None;
        let mut structure = decode(encoded).map_err(RenderError::Plugin)?;
        self.keeping.restore(&mut structure);
        if hidden {
            hide_splats(&mut structure);
        }
        self.plans += 1;
        renderer.plan = Some(Plan::new(structure, made_for, &self.gpu, &mut self.pipelines)?);
        (renderer.planned_by, renderer.hidden) = (self.serial, hidden);
        Ok(())
    }
}

/// Has the surface hide splats that are seen from the view's own camera.
fn hide_splats(structure: &mut Structure) {
    for pass in structure.passes.iter_mut().filter(|pass| pass.camera.is_none()) {
        if let Work::Splats(splats) = &mut pass.work {
            splats.tested = true;
        }
    }
}
