//! A device, an engine and a renderer: what a picture is made with.

use crate::input::environment_map;
use crate::options::check_isolated;
use crate::options::values::Setting;
use crate::options::{BackendChoice, DeviceArguments, PluginFiles, SurfelChoice};
use crate::output::{files, terminal};
use crate::parameters;
use crate::setup::SelectedView;
use anyhow::{Context as _, anyhow};
use glam::Vec2;
use std::time::Instant;
use surfelshop_api::params::Values;
use surfelshop_api::{HostInfo, UnitKind};
use surfelshop_render::{
    Backend, DiskCache, Engine, EngineOptions, Explanation, Gpu, GpuOptions, PassReport, PassState,
    RenderError, RenderRequest, Rendered, RendererView, SurfelDrawing,
};
use surfelshop_runtime::plugins::{self, LoadedUnit, Origin, Registry, Timeouts, UnitRef};

/// Frames a renderer that refines its picture may take before the last one is taken.
const MAX_FRAMES: u32 = 1024;

/// The plugins at hand: those installed and these files.
///
/// A file that was named and is no good is a failure: another plugin with the same renderer would
/// silently take its place. One that `SURFELSHOP_PLUGINS` names is reported and passed over.
pub fn registry(plugins: &PluginFiles) -> anyhow::Result<Registry> {
    let registry = Registry::scan(&plugins.search()?);
    check_isolated(&plugins.isolate, &registry)?;
    files::protect(registry.entries().iter().map(|entry| entry.file.as_path()));
    for entry in registry.entries() {
        let Some(refusal) = entry.refusal() else { continue };
        match entry.origin {
            Origin::CommandLine => anyhow::bail!("{refusal}"),
            Origin::Environment => terminal::note(format!("passed over: {refusal}")),
            Origin::BesideProgram | Origin::UserFolder => {}
        }
    }
    Ok(registry)
}

/// Loads a unit; ends the program where the system is still loading it after that.
pub fn load(reference: &UnitRef, patience: &Timeouts) -> anyhow::Result<LoadedUnit> {
    match reference.load(patience) {
        Err(error) if plugins::loader_is_busy() => terminal::leave(&error.into()),
        loaded => Ok(loaded?),
    }
}

/// The device that was asked for.
pub fn gpu_options(device: &DeviceArguments) -> GpuOptions {
    let backend = device.backend.map(|choice| match choice {
        BackendChoice::Vulkan => Backend::Vulkan,
        BackendChoice::Gl => Backend::Gl,
        BackendChoice::Metal => Backend::Metal,
        BackendChoice::Dx12 => Backend::Dx12,
    });
    GpuOptions { backend, adapter: device.adapter.clone(), small_blocks: device.small_blocks }
}

/// How surfels are to be drawn.
pub fn surfel_drawing(device: &DeviceArguments) -> SurfelDrawing {
    match device.surfels {
        SurfelChoice::Auto => SurfelDrawing::Automatic,
        SurfelChoice::Quads => SurfelDrawing::Quads,
        SurfelChoice::Compute => SurfelDrawing::Compute,
        SurfelChoice::Cpu => SurfelDrawing::Processor,
    }
}

/// Makes pictures on one device.
pub struct RenderSession {
    /// The engine on it.
    pub engine: Engine,
    host: HostInfo,
    patience: Timeouts,
}

/// A renderer in memory, ready to be put into a view.
pub struct LoadedRenderer {
    /// The unit as it was named.
    pub reference: UnitRef,
    /// The unit, loaded.
    pub unit: LoadedUnit,
    /// Its parameters.
    pub values: Values,
    /// The view.
    pub view: RendererView,
    /// Renderers that draw some clouds beside it.
    pub beside: Vec<LoadedCompanion>,
}

impl LoadedRenderer {
    /// All that draw.
    pub fn references(&self) -> Vec<UnitRef> {
        let beside = self.beside.iter().map(|other| other.reference.clone());
        std::iter::once(self.reference.clone()).chain(beside).collect()
    }

    /// The ids of all that draw, for people.
    pub fn ids(&self) -> String {
        let beside = self.beside.iter().map(|other| other.reference.id.as_str());
        let mut ids: Vec<&str> =
            std::iter::once(self.reference.id.as_str()).chain(beside).collect();
        ids.dedup();
        ids.join(" + ")
    }

    /// The renderer that a frame failed by.
    fn failed_by(&self) -> String {
        let name = self.view.at_fault();
        let other = self.view.others().iter().position(|other| Some(other.name.as_str()) == name);
        let other = other.and_then(|at| self.beside.get(at));
        other.map_or(&self.reference, |other| &other.reference).to_string()
    }
}

/// A renderer that draws clouds beside another, in memory.
pub struct LoadedCompanion {
    /// The unit as it was named.
    pub reference: UnitRef,
    /// The unit, loaded.
    pub unit: LoadedUnit,
    /// Its parameters.
    pub values: Values,
    /// Its clouds.
    pub clouds: Vec<u32>,
}

/// A frame that does not change any more, or one on the way there.
pub struct ConvergedFrame {
    /// The outputs and passes.
    pub rendered: Rendered,
    /// Frames since something changed, this one included.
    pub n_frames: u32,
    /// What the frames drawn in one go took.
    pub milliseconds: f64,
    /// Of these, what the first frame took, and within it the way of the columns to where they are
    /// drawn.
    pub first_ms: f64,
    /// Milliseconds for the columns of the clouds, the first time.
    pub columns_ms: f64,
    /// Milliseconds of the renderer's own passes in these frames, without the host's; none where the
    /// device does not tell.
    pub own_passes_ms: Option<f64>,
    /// Settled pictures, each seen at another place of every pixel, whose mean the colour is; 1 without antialiasing.
    pub n_samples: u32,
}

impl ConvergedFrame {
    /// Whether another frame would change the picture.
    pub fn refines(&self) -> bool {
        self.rendered.wants_another_frame && self.n_frames < MAX_FRAMES
    }
}

/// Milliseconds of a frame's own passes, without the host's; none where the device does not tell.
fn own_passes(passes: &[PassReport]) -> Option<f64> {
    let own = passes.iter().filter(|pass| {
        pass.state == PassState::Ran
            && !pass.name.starts_with("surfels:")
            && !pass.name.starts_with("host:")
    });
    own.map(|pass| pass.gpu_ms).sum()
}

impl RenderSession {
    /// Opens the device.
    pub fn open(device: &DeviceArguments, plugins: &PluginFiles) -> anyhow::Result<Self> {
        Self::open_with(device, plugins, environment_map::store())
    }

    /// Opens the device; what is stored for the next start is found and kept in `store`.
    pub fn open_with(
        device: &DeviceArguments,
        plugins: &PluginFiles,
        store: Option<DiskCache>,
    ) -> anyhow::Result<Self> {
        let gpu = Gpu::headless(&gpu_options(device))?;
        let host = gpu.host_info();
        let options =
            EngineOptions { store, surfels: surfel_drawing(device), ..EngineOptions::default() };
        let engine = Engine::new(gpu, &options)?;
        Ok(Self { engine, host, patience: plugins.patience() })
    }

    /// Loads a renderer by name and reads the parameters meant for it.
    pub fn choose(
        &self,
        registry: &Registry,
        name: &str,
        typed: &[Setting],
    ) -> anyhow::Result<LoadedRenderer> {
        self.choose_for(registry.find(UnitKind::Renderer, name)?, None, typed)
    }

    /// Loads a renderer and reads the parameters meant for it: what was typed counts instead of
    /// what the view of a scene says.
    pub fn choose_for(
        &self,
        reference: UnitRef,
        view: Option<&SelectedView<'_>>,
        typed: &[Setting],
    ) -> anyhow::Result<LoadedRenderer> {
        let unit = load(&reference, &self.patience)?;
        let declared = &unit.description.params;
        let (values, unknown) = parameters::resolved(&reference, declared, view, typed)?;
        unknown.iter().for_each(terminal::warn);
        self.start(reference, unit, values)
    }

    /// Makes an instance of a renderer that is in memory.
    pub fn start(
        &self,
        reference: UnitRef,
        unit: LoadedUnit,
        values: Values,
    ) -> anyhow::Result<LoadedRenderer> {
        let hosted = unit
            .start(&self.host, &self.patience)
            .map_err(|fault| anyhow!("{reference} could not start: {fault}"))?;
        let view = RendererView::new(hosted, unit.scope()).needing(&unit.description.needs);
        Ok(LoadedRenderer { reference, unit, values, view, beside: Vec::new() })
    }

    /// Renders until the picture does not change any more.
    pub fn settle(
        &mut self,
        chosen: &mut LoadedRenderer,
        request: &RenderRequest<'_>,
    ) -> anyhow::Result<ConvergedFrame> {
        let settled = self.settle_view(&mut chosen.view, request);
        settled.with_context(|| chosen.failed_by())
    }

    /// The same for a renderer in a view.
    pub fn settle_view(
        &mut self,
        view: &mut RendererView,
        request: &RenderRequest<'_>,
    ) -> Result<ConvergedFrame, RenderError> {
        self.settle_shifted(view, request, Vec2::ZERO)
    }

    /// The same, seen in each pixel at a place that lies so many pixels from its centre.
    pub(crate) fn settle_shifted(
        &mut self,
        view: &mut RendererView,
        request: &RenderRequest<'_>,
        shift_px: Vec2,
    ) -> Result<ConvergedFrame, RenderError> {
        self.settle_with(view, request, shift_px, |_| ())
    }

    /// Renders the frame of the request's index alone, seen in each pixel so many pixels from its centre.
    pub fn frame_view(
        &mut self,
        view: &mut RendererView,
        request: &RenderRequest<'_>,
        shift_px: Vec2,
    ) -> Result<ConvergedFrame, RenderError> {
        let started = Instant::now();
        let rendered = self.engine.render_shifted(view, request, shift_px)?;
        let (n_frames, columns_ms) = (request.frame_index + 1, rendered.columns_ms);
        let milliseconds = started.elapsed().as_secs_f64() * 1e3;
        let (first_ms, own_passes_ms) = (milliseconds, own_passes(&rendered.passes));
        Ok(ConvergedFrame {
            rendered,
            n_frames,
            milliseconds,
            first_ms,
            columns_ms,
            own_passes_ms,
            n_samples: 1,
        })
    }

    /// Renders until the picture does not change any more; `each` is shown every frame.
    fn settle_with(
        &mut self,
        view: &mut RendererView,
        request: &RenderRequest<'_>,
        shift_px: Vec2,
        mut each: impl FnMut(&mut Rendered),
    ) -> Result<ConvergedFrame, RenderError> {
        let started = Instant::now();
        let mut n_frames = 0;
        let mut first = None;
        let mut own_passes_ms = Some(0.0);
        loop {
            let request = RenderRequest { frame_index: n_frames, ..*request };
            let mut rendered = self.engine.render_shifted(view, &request, shift_px)?;
            each(&mut rendered);
            n_frames += 1;
            own_passes_ms = own_passes_ms.zip(own_passes(&rendered.passes)).map(|(a, b)| a + b);
            let since = || started.elapsed().as_secs_f64() * 1e3;
            let (first_ms, columns_ms) = *first.get_or_insert((since(), rendered.columns_ms));
            let milliseconds = since();
            let settled = ConvergedFrame {
                rendered,
                n_frames,
                milliseconds,
                first_ms,
                columns_ms,
                own_passes_ms,
                n_samples: 1,
            };
            if !settled.refines() {
                return Ok(settled);
            }
        }
    }

    /// Renders until the picture does not change any more, and explains it: a pass that ran in one of the
    /// frames ran.
    pub fn explain(
        &mut self,
        chosen: &mut LoadedRenderer,
        request: &RenderRequest<'_>,
    ) -> anyhow::Result<Explanation> {
        let mut ran: Vec<PassReport> = Vec::new();
        let settled = self.settle_with(&mut chosen.view, request, Vec2::ZERO, |rendered| {
            for pass in &mut rendered.passes {
                match ran.iter().find(|known| known.name == pass.name) {
                    Some(known) if pass.state == PassState::Reused => *pass = known.clone(),
                    None if pass.state == PassState::Ran => ran.push(pass.clone()),
                    _ => {}
                }
            }
        });
        let settled = settled.with_context(|| chosen.failed_by())?;
        Ok(self.engine.explain(&chosen.view, request, &settled.rendered))
    }
}
