//! Pipelines by content: equal shaders, constants and formats are compiled once.

use crate::graph::RenderError;
use crate::graph::background::Beside;
use crate::graph::pipeline_desc::{DrawKind, Pipeline, Recipe, Shader, Work, checked};
use crate::graph::variants::{Settings, Variants};
use crate::shader_compiler::{Library, on_large_stack};
use std::borrow::Cow;
use std::collections::{HashMap, HashSet, VecDeque};
use std::sync::Arc;
use surfelshop_api::graph::{Module, SamplerKind};

/// Most pipelines that are kept besides those of the last frames: what was used longest ago goes first.
/// The program's own renderers have less than half of that, so that switching between them compiles
/// nothing anew.
pub(super) const MOST_PIPELINES: usize = 256;

/// Frames whose pipelines are kept, however many there are: several views may be drawn in turn.
const KEPT_FRAMES: usize = 64;

/// How many things were compiled since the engine was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct CompileCounts {
    /// Shader texts composed and checked.
    pub modules: u32,
    /// Pipelines made.
    pub pipelines: u32,
}

/// Entry points, with what they draw into.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Stages {
    Draw {
        vertex: (u64, String),
        fragment: (u64, String),
        formats: Vec<wgpu::TextureFormat>,
        kind: DrawKind,
    },
    Compute {
        shader: u64,
        entry: String,
    },
}

impl Stages {
    /// Numbers of the shaders.
    fn shaders(&self) -> Vec<u64> {
        match self {
            Self::Draw { vertex, fragment, .. } => vec![vertex.0, fragment.0],
            Self::Compute { shader, .. } => vec![*shader],
        }
    }
}

/// A fragment stage to be drawn.
pub(crate) struct Draw<'a> {
    pub(crate) label: &'a str,
    pub(crate) vertex: (&'a Arc<Shader>, &'a str),
    pub(crate) fragment: (&'a Arc<Shader>, &'a str),
    pub(crate) settings: &'a Settings,
    pub(crate) formats: &'a [wgpu::TextureFormat],
    pub(crate) kind: DrawKind,
}

/// A pipeline to draw with.
pub(crate) struct ReadyPipeline {
    pub(crate) pipeline: Arc<Pipeline>,
    /// Whether it is what was asked for, or stands in for it while that is being compiled.
    pub(crate) is_it: bool,
}

/// A text with the units of work of its loops, the modules it brings along and the names set for `#ifdef`.
type ShaderKey = ((String, Option<u32>), Vec<Module>, Vec<String>);

/// A shader, or what is wrong with it.
struct Known {
    shader: Result<Arc<Shader>, String>,
    last_used: u64,
}

/// All shaders and pipelines of a device.
pub(crate) struct Pipelines {
    device: wgpu::Device,
    library: Library,
    shaders: HashMap<ShaderKey, Known>,
    made: HashMap<Stages, Variants<Pipeline>>,
    /// Pipelines that others stand in for meanwhile.
    beside: Beside<Stages>,
    /// Whether there are to be any.
    pub(crate) compiles_beside: bool,
    /// Grows with every pipeline that is asked for.
    now: u64,
    /// What it was when each of the last frames began.
    began: VecDeque<u64>,
    pub(crate) counts: CompileCounts,
    /// Units of work that loops of graphs share, where they come from a sandboxed plugin.
    pub(crate) loop_units: Option<u32>,
    /// Samplers of graphs, each made once.
    samplers: HashMap<SamplerKind, wgpu::Sampler>,
}

impl Pipelines {
    pub(crate) fn new(device: wgpu::Device) -> Result<Self, RenderError> {
        let on_cpu = device.adapter_info().device_type == wgpu::DeviceType::Cpu;
        let library = Library::new(on_cpu).map_err(|error| RenderError::Host(error.message))?;
        Ok(Self {
            beside: Beside::new(device.clone()),
            device,
            library,
            shaders: HashMap::new(),
            made: HashMap::new(),
            compiles_beside: false,
            now: 0,
            began: VecDeque::new(),
            counts: CompileCounts::default(),
            loop_units: None,
            samplers: HashMap::new(),
        })
    }

    /// A sampler of graphs.
    pub(crate) fn sampler(&mut self, kind: SamplerKind) -> wgpu::Sampler {
        let device = &self.device;
        self.samplers.entry(kind).or_insert_with(|| sampler(device, kind)).clone()
    }

    /// How many pipelines are kept.
    pub(crate) fn n_pipelines(&self) -> usize {
        self.made.values().map(Variants::len).sum()
    }

    /// How many shader texts are kept.
    pub(crate) fn n_modules(&self) -> usize {
        self.shaders.len()
    }

    /// Lets go of what was used longest ago where there are too many, once a frame.
    pub(crate) fn next_frame(&mut self) {
        self.began.push_back(self.now);
        if self.began.len() <= KEPT_FRAMES {
            return;
        }
        let Some(recent) = self.began.pop_front() else { return };
        if self.n_pipelines() <= MOST_PIPELINES && self.shaders.len() <= MOST_PIPELINES {
            return;
        }
        let mut uses: Vec<u64> = self.made.values().flat_map(Variants::uses).collect();
        uses.sort_unstable_by(|a, b| b.cmp(a));
        let first_kept = uses.get(MOST_PIPELINES).map_or(0, |last| last + 1).min(recent);
        self.made.retain(|_, variants| {
            variants.let_go_before(first_kept);
            variants.len() > 0
        });
        // Texts whose pipelines are kept would get other numbers, and these pipelines never be found.
        let used: HashSet<u64> = self.made.keys().flat_map(Stages::shaders).collect();
        self.shaders.retain(|_, known| {
            let in_use = known.shader.as_ref().is_ok_and(|shader| used.contains(&shader.serial));
            in_use || known.last_used >= recent
        });
    }

    /// The checked shader of this text; the same text is composed once, mistakes included.
    pub(crate) fn shader(&mut self, source: &str, defines: &[&str]) -> Result<Arc<Shader>, String> {
        self.shader_of((source, None), &[], defines)
    }

    /// The same of a graph's text that brings modules along.
    pub(crate) fn shader_with(
        &mut self,
        source: &str,
        modules: &[Module],
        defines: &[&str],
    ) -> Result<Arc<Shader>, String> {
        self.shader_of((source, self.loop_units), modules, defines)
    }

    fn shader_of(
        &mut self,
        text: (&str, Option<u32>),
        modules: &[Module],
        defines: &[&str],
    ) -> Result<Arc<Shader>, String> {
        let (source, units) = text;
        let defined = defines.iter().map(|name| (*name).to_owned()).collect();
        let key = ((source.to_owned(), units), modules.to_vec(), defined);
        if let Some(known) = self.shaders.get_mut(&key) {
            known.last_used = self.now;
            return known.shader.clone();
        }
        self.counts.modules += 1;
        let shader = self.make_shader(text, modules, defines).map(Arc::new);
        self.shaders.insert(key, Known { shader: shader.clone(), last_used: self.now });
        shader
    }

    fn make_shader(
        &mut self,
        text: (&str, Option<u32>),
        modules: &[Module],
        defines: &[&str],
    ) -> Result<Shader, String> {
        let serial = u64::from(self.counts.modules);
        let (library, device) = (&mut self.library, &self.device);
        on_large_stack(|| {
            let composed = library.compose_with(text, modules, defines);
            let composed = composed.map_err(|error| error.message)?;
            let module = checked(device, || {
                device.create_shader_module(wgpu::ShaderModuleDescriptor {
                    label: None,
                    source: wgpu::ShaderSource::Naga(Cow::Owned(composed.module.clone())),
                })
            })?;
            Ok(Shader { composed, module, serial })
        })?
    }

    /// The pipeline of a draw.
    pub(crate) fn draw(&mut self, draw: &Draw<'_>) -> Result<ReadyPipeline, String> {
        let named = |(shader, entry): (&Arc<Shader>, &str)| (shader.serial, entry.to_owned());
        let stages = Stages::Draw {
            vertex: named(draw.vertex),
            fragment: named(draw.fragment),
            formats: draw.formats.to_vec(),
            kind: draw.kind,
        };
        let held = |(shader, entry): (&Arc<Shader>, &str)| (shader.clone(), entry.to_owned());
        self.find(stages, draw.settings, |settings| Recipe {
            label: draw.label.to_owned(),
            settings: settings.clone(),
            work: Work::Draw {
                vertex: held(draw.vertex),
                fragment: held(draw.fragment),
                formats: draw.formats.to_vec(),
                kind: draw.kind,
            },
        })
    }

    /// The pipeline of a compute entry point.
    pub(crate) fn compute(
        &mut self,
        label: &str,
        shader: &Arc<Shader>,
        entry: &str,
        settings: &Settings,
    ) -> Result<ReadyPipeline, String> {
        let stages = Stages::Compute { shader: shader.serial, entry: entry.to_owned() };
        self.find(stages, settings, |settings| Recipe {
            label: label.to_owned(),
            settings: settings.clone(),
            work: Work::Compute((shader.clone(), entry.to_owned())),
        })
    }

    /// The variant of these values. If pipelines are made beside drawing, one that can stand in for it is
    /// drawn with while it is made, and one that can stand in for all is made as soon as there is any.
    fn find(
        &mut self,
        stages: Stages,
        settings: &Settings,
        recipe: impl Fn(&Settings) -> Recipe,
    ) -> Result<ReadyPipeline, String> {
        self.now += 1;
        self.take_in();
        let variants = self.made.entry(stages.clone()).or_default();
        if let Some(pipeline) = variants.get(settings, self.now) {
            return Ok(ReadyPipeline { pipeline, is_it: true });
        }
        if self.compiles_beside
            && let Some(pipeline) = variants.stand_in(settings, self.now)
            && self.beside.make(&stages, settings, || recipe(settings))
        {
            return Ok(ReadyPipeline { pipeline, is_it: false });
        }
        let made = match self.beside.wait_for(&stages, settings) {
            Some(made) => made,
            None => {
                let (device, recipe) = (&self.device, recipe(settings));
                on_large_stack(|| recipe.make(device))??
            }
        };
        let pipeline = Arc::new(made);
        self.counts.pipelines += 1;
        variants.keep(settings.clone(), pipeline.clone(), self.now);
        let general = settings.general();
        if self.compiles_beside && variants.get(&general, self.now).is_none() {
            self.beside.make(&stages, &general, || recipe(&general));
        }
        Ok(ReadyPipeline { pipeline, is_it: true })
    }

    /// Takes in what was made beside.
    fn take_in(&mut self) {
        for (stages, settings, pipeline) in self.beside.made() {
            self.counts.pipelines += 1;
            let variants = self.made.entry(stages).or_default();
            variants.keep(settings, Arc::new(pipeline), self.now);
        }
    }
}

fn sampler(device: &wgpu::Device, kind: SamplerKind) -> wgpu::Sampler {
    let filter = match kind {
        SamplerKind::Nearest => wgpu::FilterMode::Nearest,
        _ => wgpu::FilterMode::Linear,
    };
    let address = match kind {
        SamplerKind::LinearRepeat => wgpu::AddressMode::Repeat,
        _ => wgpu::AddressMode::ClampToEdge,
    };
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: None,
        address_mode_u: address,
        address_mode_v: address,
        address_mode_w: address,
        mag_filter: filter,
        min_filter: filter,
        mipmap_filter: match kind {
            SamplerKind::Nearest => wgpu::MipmapFilterMode::Nearest,
            _ => wgpu::MipmapFilterMode::Linear,
        },
        ..Default::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::Gpu;

    #[test]
    fn pipelines_are_bounded_and_the_oldest_goes() {
        let gpu = Gpu::noop().unwrap();
        let mut pipelines = Pipelines::new(gpu.device.clone()).unwrap();
        let made = |pipelines: &mut Pipelines, i: usize| {
            let source = format!("const N = {i}u;\n@compute @workgroup_size(1) fn main() {{}}");
            let shader = pipelines.shader(&source, &[]).unwrap();
            pipelines.compute("test", &shader, "main", &Settings::default()).unwrap();
            pipelines.counts.pipelines
        };
        let n = MOST_PIPELINES + 2 * KEPT_FRAMES;
        for i in 0..n {
            pipelines.next_frame();
            made(&mut pipelines, i);
            // Those of the last frames are kept in any case.
            assert!(pipelines.n_pipelines() <= MOST_PIPELINES + KEPT_FRAMES + 1);
        }
        (0..=KEPT_FRAMES).for_each(|_| pipelines.next_frame());
        assert_eq!(pipelines.n_pipelines(), MOST_PIPELINES);
        assert!(pipelines.n_modules() <= MOST_PIPELINES + 1);
        let before = pipelines.counts.pipelines;
        assert_eq!(made(&mut pipelines, n - 1), before, "the newest is there");
        assert_eq!(made(&mut pipelines, 0), before + 1, "the oldest is made anew");
    }
}
