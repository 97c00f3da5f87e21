//! What a frame was made of, what was left out of it, and why.

mod graph;

use crate::engine::request::RendererPart;
use crate::engine::several::is_of_host;
use crate::engine::{Engine, RenderRequest, Rendered, RendererView};
use crate::graph::{PassReport, PassState, Plan, confines};
use crate::resource_use::ResourceUse;
use crate::shader_features::ShaderFeature;
use crate::surfels::{ColumnUse, DrawnHow, SurfelDrawing, columns_used};
use graph::Graph;
use serde::Serialize;
use surfelshop_api::graph::Output;

/// A frame, explained.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Explanation {
    /// Where several renderers draw the picture, which clouds each draws and what that takes; else empty.
    pub renderers: Vec<RendererUse>,
    /// Columns of the clouds, and those that drawing knows and the clouds lack.
    pub columns: Vec<ColumnUse>,
    /// How surfels were drawn, and why so.
    pub surfels: Vec<String>,
    /// Passes of the host and of the renderer, in order.
    pub passes: Vec<PassUse>,
    /// Textures and buffers: the host's own, then those of the renderer's graph.
    pub resources: Vec<ResourceUse>,
    /// Outputs of the graph, and whether they were asked for.
    pub outputs: Vec<OutputUse>,
    /// What the adapter has that drawing can use, and what it lacks.
    pub features: Vec<FeatureUse>,
}

/// A renderer among several.
#[derive(Clone, Debug, Serialize)]
pub struct RendererUse {
    /// What it draws, and the bytes of its graph.
    pub part: RendererPart,
    /// Milliseconds of its passes on the device, where known.
    pub gpu_ms: Option<f64>,
}

/// A pass.
#[derive(Clone, Debug, Serialize)]
pub struct PassUse {
    /// Its name.
    pub name: String,
    /// Whether it ran.
    pub state: PassState,
    /// Milliseconds on the device, where known.
    pub gpu_ms: Option<f64>,
    /// Why it ran or did not.
    pub why: String,
    /// Values of its `override` constants.
    pub constants: Vec<(String, f64)>,
    /// Whether what its shader guards is there; what is not is left out of the shader.
    pub features: Vec<(String, bool)>,
}

/// An output of the graph.
#[derive(Clone, Debug, Serialize)]
pub struct OutputUse {
    /// Its name.
    pub name: String,
    /// Whether it was asked for.
    pub wanted: bool,
}

/// Something an adapter may have.
#[derive(Clone, Debug, Serialize)]
pub struct FeatureUse {
    /// Its name.
    pub name: &'static str,
    /// Whether the adapter has it.
    pub here: bool,
    /// What is done with it, or instead.
    pub means: &'static str,
    /// Whether this frame would be made otherwise if the adapter had it, or lacked it.
    pub counts: bool,
}

impl Engine {
    /// Explains the frame that a renderer made last.
    ///
    /// Milliseconds and states are those of `rendered`; what the graph would have is that of its last
    /// structure.
    #[must_use]
    pub fn explain(
        &self,
        renderer: &RendererView,
        request: &RenderRequest<'_>,
        rendered: &Rendered,
    ) -> Explanation {
        let mut explained = Explanation {
            columns: columns_used(request.clouds, &self.drawn_how(renderer, rendered.merged)),
            surfels: self.surfels_used(renderer, request, rendered),
            features: self.features(renderer, request, rendered),
            ..Explanation::default()
        };
        explained.resources = self.surfaces.textures();
        explained.resources.extend(self.environments.textures());
        if !rendered.parts.is_empty() {
            explain_several(&mut explained, renderer, request, rendered);
        } else if let Some(plan) = &renderer.plan {
            let graph = Graph::new(plan, request.outputs);
            explained.passes = graph.passes(&rendered.passes);
            explained.resources.extend(graph.resources());
            explained.outputs = graph.outputs_used();
        } else {
            explained.resources.clear();
        }
        explained
    }

    /// Whether a renderer makes a picture itself, by the frame that it made last; else the host does.
    #[must_use]
    pub fn makes(&self, renderer: &RendererView, output: &Output) -> bool {
        let others = renderer.others.iter().map(|other| &other.view);
        let mut plans =
            std::iter::once(renderer).chain(others).filter_map(|view| view.plan.as_ref());
        plans.any(|plan| plan.structure.outputs.iter().any(|(own, _)| own == output))
    }

    /// How a renderer's surfels are drawn.
    fn drawn_how(&self, renderer: &RendererView, merged: bool) -> DrawnHow<'_> {
        let one_by_one = renderer.plan.as_ref().is_some_and(Plan::shades_surfels);
        let on_host = self.surfels.on_host(&self.gpu) && !one_by_one;
        DrawnHow { held: &self.columns, on_host, merged }
    }

    /// Lines about how surfels were drawn.
    fn surfels_used(
        &self,
        renderer: &RendererView,
        request: &RenderRequest<'_>,
        rendered: &Rendered,
    ) -> Vec<String> {
        let mut lines = Vec::new();
        let one_by_one = renderer.plan.as_ref().is_some_and(Plan::shades_surfels);
        let gpu = &self.gpu;
        let on_host = self.drawn_how(renderer, rendered.merged).on_host;
        lines.push(if one_by_one {
            "as quads by the device: the renderer shades surfels one by one".to_owned()
        } else {
            let why = match (self.surfels, gpu.is_software()) {
                (SurfelDrawing::Automatic, true) => "the adapter is software",
                (SurfelDrawing::Automatic, false) => "the adapter is a graphics card",
                _ => "asked for",
            };
            let size = request.view.size_px;
            let how = match (on_host, self.surfels.computes(gpu, size)) {
                (true, _) => "by the processor",
                (_, true) => "small discs by compute, large ones as quads",
                _ => "as quads by the device",
            };
            format!("{how}: {why}")
        });
        let all: usize = request.clouds.iter().map(|cloud| cloud.len).sum();
        let n_drawn = self.surfaces.n_drawn;
        lines.push(match on_host || rendered.merged {
            true => format!(
                "{n_drawn} drawn of {all}: blocks that cannot be seen are left out, and what is left \
                 is filled up to sixteens"
            ),
            false => format!("{n_drawn} drawn of {all}: the device is given all"),
        });
        lines.push(match (rendered.merged, request.detail_px > 0.0) {
            (true, _) => format!(
                "merged where one of at most {} px can stand for several",
                request.detail_px
            ),
            (false, true) => "none merged: the renderer's passes take no merged surfels".to_owned(),
            (false, false) => "none merged: no detail was asked for".to_owned(),
        });
        let counters = self.counters();
        let megabytes = |bytes: u64| bytes as f64 / 1e6;
        lines.push(format!(
            "columns as they are drawn take {:.2} MB on the device and {:.2} MB in memory",
            megabytes(counters.column_bytes),
            megabytes(counters.host_column_bytes)
        ));
        let counts = counters.compiled;
        lines.push(format!(
            "{} shader texts and {} pipelines compiled so far, only those that passes need",
            counts.modules, counts.pipelines
        ));
        lines
    }

    fn features(
        &self,
        renderer: &RendererView,
        request: &RenderRequest<'_>,
        rendered: &Rendered,
    ) -> Vec<FeatureUse> {
        use crate::gpu::Atomics;
        let gpu = &self.gpu;
        let draws = !self.drawn_how(renderer, rendered.merged).on_host;
        let computes = draws && self.surfels.computes(gpu, request.view.size_px);
        let textures = renderer.plan.as_ref().map(|plan| &plan.structure.textures);
        let has_volumes = textures.is_some_and(|all| all.iter().any(|texture| texture.volume));
        let feature = |name, here, [with, without]: [&'static str; 2], counts| FeatureUse {
            name,
            here,
            means: if here { with } else { without },
            counts,
        };
        let mut all = vec![
            feature(
                "blending of 32-bit floats",
                gpu.blends_f32,
                [
                    "quads are added up by blending",
                    "surfels that the device draws are added up in fixed point by compute",
                ],
                draws,
            ),
            feature(
                "timestamps",
                gpu.times_passes,
                [
                    match gpu.is_software() {
                        true => "passes are timed, but for frames that compute, in software",
                        false => "passes are timed on the device",
                    },
                    "passes have no times",
                ],
                true,
            ),
            feature(
                "64-bit atomics",
                gpu.atomics != Atomics::Only32,
                [
                    "compute finds the nearest surfel in one step",
                    "compute takes two steps, distances first",
                ],
                computes,
            ),
            feature(
                "reversed depth",
                gpu.keeps_reversed_depth(),
                [
                    "depth comes from clip space",
                    "OpenGL would round it away: fragments write depth themselves",
                ],
                draws,
            ),
            feature(
                "stores into volumes",
                gpu.stores_into_volumes(),
                ["compute passes fill volumes", "passes that store into a volume are refused"],
                has_volumes,
            ),
            feature(
                "checks of bounds",
                confines(gpu).is_ok(),
                [
                    "graphs of sandboxed plugins run, within their share of the device",
                    "graphs of sandboxed plugins are refused",
                ],
                renderer.is_confined,
            ),
            feature(
                "a graphics card",
                !gpu.is_software(),
                [
                    "shaders run on it",
                    "shaders run on the processor; only trusted plugins' graphs should",
                ],
                true,
            ),
        ];
        all.extend(renderer.plan.as_ref().map(|plan| self.needed(plan)).unwrap_or_default());
        all
    }

    /// What passes of a graph need of the device, and what it lacks of that.
    fn needed(&self, plan: &Plan) -> Vec<FeatureUse> {
        let has = self.gpu.device.features();
        let is_needed = |feature: &ShaderFeature| {
            let quoted = format!("`{}`", feature.word);
            let mut lacks = plan.passes.iter().filter_map(|pass| pass.instead_of.as_deref());
            let mut needs = plan.structure.passes.iter().flat_map(|pass| &pass.needs);
            needs.any(|word| word == feature.word) || lacks.any(|why| why.contains(&quoted))
        };
        let use_of = |feature: ShaderFeature| FeatureUse {
            name: feature.word,
            here: feature.is_of(has),
            means: match feature.is_of(has) {
                true => "passes that need it run",
                false => "passes that need it are left to others that run instead",
            },
            counts: true,
        };
        ShaderFeature::ALL.into_iter().filter(is_needed).map(use_of).collect()
    }
}

/// Explains what each of several renderers did.
fn explain_several(
    explained: &mut Explanation,
    renderer: &RendererView,
    request: &RenderRequest<'_>,
    rendered: &Rendered,
) {
    let others = renderer.others.iter().map(|other| (other.name.as_str(), &other.view));
    let all: Vec<(&str, &RendererView)> =
        std::iter::once((renderer.name.as_str(), renderer)).chain(others).collect();
    // Passes of the host stand with those of the renderer that they were for.
    let mut left = rendered.passes.as_slice();
    for part in &rendered.parts {
        let found = all.iter().find(|(name, _)| *name == part.renderer);
        let Some(plan) = found.and_then(|(_, view)| view.plan.as_ref()) else { continue };
        let prefix = format!("{}: ", part.renderer);
        let n = left
            .iter()
            .position(|pass| !is_of_host(&pass.name) && !pass.name.starts_with(&prefix))
            .unwrap_or(left.len());
        let (own, rest) = left.split_at(n);
        left = rest;
        let stripped = |pass: &PassReport| {
            let name = pass.name.strip_prefix(&prefix).unwrap_or(&pass.name).to_owned();
            PassReport { name, ..pass.clone() }
        };
        let reports: Vec<PassReport> = own.iter().map(stripped).collect();
        let graph = Graph::new(plan, request.outputs);
        let mut gpu_ms = Some(0.0);
        for (mut pass, report) in graph.passes(&reports).into_iter().zip(own) {
            if !is_of_host(&report.name) && report.state == PassState::Ran {
                gpu_ms = gpu_ms.zip(report.gpu_ms).map(|(sum, ms): (f64, f64)| sum + ms);
            }
            pass.name.clone_from(&report.name);
            explained.passes.push(pass);
        }
        let named = |resource: ResourceUse| ResourceUse {
            label: format!("{prefix}{}", resource.label),
            ..resource
        };
        explained.resources.extend(graph.resources().into_iter().map(named));
        explained.outputs.extend(
            graph
                .outputs_used()
                .into_iter()
                .map(|output| OutputUse { name: format!("{prefix}{}", output.name), ..output }),
        );
        explained.renderers.push(RendererUse { part: part.clone(), gpu_ms });
    }
}
