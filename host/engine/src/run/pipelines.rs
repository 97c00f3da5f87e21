//! Pipelines by content: equal shaders, constants and formats are compiled once.

use super::RenderError;
use super::beside::Beside;
use super::recipe::{DrawKind, Pipeline, Recipe, Shader, Work, checked};
use super::variants::{Settings, Variants};
use crate::shader::{Library, on_large_stack};
use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;
use surfelshop_api::graph::Module;

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
pub(crate) struct Found {
    pub(crate) pipeline: Arc<Pipeline>,
    /// Whether it is what was asked for, or stands in for it while that is being compiled.
    pub(crate) is_it: bool,
}

/// A text, the modules it brings along and the names set for `#ifdef`.
type ShaderKey = (String, Vec<Module>, Vec<String>);

/// All shaders and pipelines of a device.
pub(crate) struct Pipelines {
    device: wgpu::Device,
    library: Library,
    shaders: HashMap<ShaderKey, Result<Arc<Shader>, String>>,
    made: HashMap<Stages, Variants<Pipeline>>,
    /// Pipelines that others stand in for meanwhile.
    beside: Beside<Stages>,
    /// Whether there are to be any.
    pub(crate) compiles_beside: bool,
    /// Grows with every pipeline that is asked for.
    now: u64,
    pub(crate) counts: CompileCounts,
}

impl Pipelines {
    pub(crate) fn new(device: wgpu::Device) -> Result<Self, RenderError> {
        let library = Library::new().map_err(|error| RenderError::Host(error.message))?;
        Ok(Self {
            beside: Beside::new(device.clone()),
            device,
            library,
            shaders: HashMap::new(),
            made: HashMap::new(),
            compiles_beside: false,
            now: 0,
            counts: CompileCounts::default(),
        })
    }

    /// The checked shader of this text; the same text is composed once, mistakes included.
    pub(crate) fn shader(&mut self, source: &str, defines: &[&str]) -> Result<Arc<Shader>, String> {
        self.shader_with(source, &[], defines)
    }

    /// The same of a text that brings modules along.
    pub(crate) fn shader_with(
        &mut self,
        source: &str,
        modules: &[Module],
        defines: &[&str],
    ) -> Result<Arc<Shader>, String> {
        let defined = defines.iter().map(|name| (*name).to_owned()).collect();
        let key = (source.to_owned(), modules.to_vec(), defined);
        if let Some(known) = self.shaders.get(&key) {
            return known.clone();
        }
        self.counts.modules += 1;
        let made = self.make_shader(source, modules, defines).map(Arc::new);
        self.shaders.insert(key, made.clone());
        made
    }

    fn make_shader(
        &mut self,
        source: &str,
        modules: &[Module],
        defines: &[&str],
    ) -> Result<Shader, String> {
        let serial = u64::from(self.counts.modules);
        let (library, device) = (&mut self.library, &self.device);
        on_large_stack(|| {
            let composed = library.compose(source, modules, defines);
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
    pub(crate) fn draw(&mut self, draw: &Draw<'_>) -> Result<Found, String> {
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
    ) -> Result<Found, String> {
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
    ) -> Result<Found, String> {
        self.now += 1;
        self.take_in();
        let variants = self.made.entry(stages.clone()).or_default();
        if let Some(pipeline) = variants.get(settings, self.now) {
            return Ok(Found { pipeline, is_it: true });
        }
        if self.compiles_beside
            && let Some(pipeline) = variants.stand_in(settings, self.now)
            && self.beside.make(&stages, settings, || recipe(settings))
        {
            return Ok(Found { pipeline, is_it: false });
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
        Ok(Found { pipeline, is_it: true })
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
