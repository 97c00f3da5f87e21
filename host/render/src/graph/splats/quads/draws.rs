//! The draws and dispatches of splats as quads.

use super::{Bound, Quads};
use crate::graph::bind;
use crate::graph::pipeline_desc::{DrawKind, Shader, Stage};
use crate::graph::pipelines::Draw;
use crate::graph::plan::defines_of;
use crate::graph::recorder::Attachment;
use crate::graph::splats::device::name_of;
use crate::graph::splats::parameters::Parameters;
use crate::graph::splats::part_of;
use crate::graph::splats::source::{
    CHANCE, EXTENT, FOOTPRINT, MET, MOMENTS, PREFIX, SHOWN, behind,
};
use crate::graph::variants::Settings;
use std::sync::Arc;
use surfelshop_api::graph::{Composition, SplatDepth};

const SPLAT_QUADS: &str = include_str!("splat_quads.wgsl");
const GATHER: &str = include_str!("gather.wgsl");

/// Pixels on a side of a workgroup.
const GROUP: u32 = 8;

/// Splats that a software driver draws before it gets more: it keeps all triangles until their pixels are drawn.
const AT_A_TIME: u32 = 1 << 16;

/// A picture that is drawn.
pub(super) struct Drawn<'a> {
    pub(super) view: &'a wgpu::TextureView,
    pub(super) format: wgpu::TextureFormat,
}

/// A draw of all quads.
#[derive(Clone, Copy)]
pub(super) struct QuadDraw<'a> {
    /// Of the vertex and the fragment stage.
    pub(super) entries: [&'a str; 2],
    pub(super) kind: DrawKind,
    pub(super) into: &'a [Drawn<'a>],
    pub(super) depth: Option<&'a wgpu::TextureView>,
    /// Whether the nearest have been drawn before.
    pub(super) reads_nearest: bool,
}

/// The text of quads of splats that carry so many vectors, blended into so many pictures from the first on.
pub(super) fn quads_source(
    n_payloads: usize,
    planes: Option<[u32; 2]>,
    is_per_pixel: bool,
) -> String {
    let shown = if is_per_pixel { SHOWN } else { "" };
    let mut text = format!(
        "const N_PAYLOADS = {n_payloads}u;\n{}\n",
        [FOOTPRINT, EXTENT, MET, CHANCE, shown, SPLAT_QUADS].join("\n")
    );
    if let Some([first, n]) = planes {
        let member = |k: u32| format!("@location({k}) plane_{k}: vec4<f32>,\n");
        let value = |k: u32| format!("plane(number, hit, reach.origin, {}u),\n", first + k);
        let members: String = (0..n).map(member).collect();
        let values: String = (0..n).map(value).collect();
        text.push_str(&format!(
            "struct Planes {{\n{members}}}\n\
             @fragment\nfn blend_from_{first}(c: Corner) -> Planes {{\n\
                 let hit = seen(c);\n\
                 let reach = reach_of(c, hit.distance);\n\
                 if !hit.inside || !reach.is_near {{ discard; }}\n\
                 let number = numbers[c.rank];\n\
                 return Planes({values});\n}}\n"
        ));
    }
    text
}

/// The text that makes pictures of so many that were blended.
pub(super) fn gather_source(n_payloads: usize, n_planes: u32, is_per_pixel: bool) -> String {
    let texture = |k: u32| format!("var plane_{k}: texture_2d<f32>;\n");
    let read = |k: u32| format!("case {k}u: {{ return textureLoad(plane_{k}, pixel, 0); }}\n");
    let textures: String = (0..n_planes).map(texture).collect();
    let reads: String = (0..n_planes).map(read).collect();
    let shown = if is_per_pixel { [MET, SHOWN].join("\n") } else { String::new() };
    format!(
        "const N_PAYLOADS = {n_payloads}u;\n{}\n{textures}\
         fn plane_at(pixel: vec2<u32>, k: u32) -> vec4<f32> {{\n\
             switch k {{\n{reads}default: {{ return vec4(0.0); }}\n}}\n}}\n",
        [FOOTPRINT, MOMENTS, &shown, GATHER].join("\n")
    )
}

impl Quads<'_, '_, '_> {
    /// A picture of the view's size.
    pub(super) fn picture(
        &mut self,
        label: &str,
        format: wgpu::TextureFormat,
    ) -> wgpu::TextureView {
        let gpu = self.device.recorder.gpu;
        let texture = self.device.scratch.take_texture(gpu, label, format, self.size);
        let view = texture.create_view(&Default::default());
        self.textures.push(texture);
        view
    }

    fn defines(&self, reads_nearest: bool) -> Vec<&'static str> {
        let is_mean = matches!(self.splats.composition, Composition::Normalized { .. });
        let wants = |which: SplatDepth| self.wants(which);
        let all = [
            (is_mean, "NORMALIZED"),
            (reads_nearest, "FROM_NEAREST"),
            (wants(SplatDepth::Distortion), "DISTORTION"),
            (wants(SplatDepth::Expected), "EXPECTED"),
        ];
        all.into_iter().filter(|(is_set, _)| *is_set).map(|(_, name)| name).collect()
    }

    /// The shader of a text of the host, with the author's before it where the pass has a function of pixels.
    fn shader(&mut self, text: &str, mut defines: Vec<&str>) -> Result<Arc<Shader>, String> {
        let pipelines = &mut *self.device.pipelines;
        let Some(function) = &self.splats.per_pixel else {
            return pipelines.shader(text, &defines);
        };
        let pass = self.variables.pass;
        defines.extend(defines_of(pass));
        defines.push("PER_PIXEL");
        pipelines.shader_with(&behind(pass, function, text), &pass.modules, &defines)
    }

    /// What an entry point is called there.
    fn entry(&self, name: &str) -> String {
        let prefix = if self.splats.per_pixel.is_some() { PREFIX } else { "" };
        format!("{prefix}{name}")
    }

    /// Constants and features of the pass that a shader has.
    fn settings(&self, shader: &Shader) -> Settings {
        self.variables.planned.settings_of(shader)
    }

    /// What a variable is bound to: one of these of the host, or what the pass says.
    fn bound<'b>(
        &'b self,
        variable: &str,
        buffers: &[(&str, &'b wgpu::Buffer)],
        textures: &[(&str, &'b wgpu::TextureView)],
    ) -> Option<wgpu::BindingResource<'b>> {
        let own = match self.splats.per_pixel {
            Some(_) => variable.strip_prefix(PREFIX).unwrap_or_default(),
            None => variable,
        };
        if let Some((_, view)) = textures.iter().find(|(name, _)| *name == own) {
            return Some(wgpu::BindingResource::TextureView(view));
        }
        if let Some((_, buffer)) = buffers.iter().find(|(name, _)| *name == own) {
            return Some(buffer.as_entire_binding());
        }
        match part_of(self.variables, variable, 0) {
            Some(part) => Some(part.buffer.as_entire_binding()),
            None => self.variables.resource(variable),
        }
    }

    /// Draws all quads, in parts where the driver is software.
    pub(super) fn draw_quads(
        &mut self,
        draw: &QuadDraw<'_>,
        view: &Parameters,
        bound: &Bound,
    ) -> Result<(), String> {
        let n = bound.order.n;
        let params = self.device.uniform(&view.words(n));
        let [vertex, fragment] = draw.entries;
        let first = fragment.strip_prefix("blend_from_").and_then(|first| first.parse().ok());
        let planes = first.map(|first| [first, draw.into.len() as u32]);
        let is_per_pixel = self.splats.per_pixel.is_some();
        let source = quads_source(self.splats.targets.len(), planes, is_per_pixel);
        let defines = match first {
            Some(_) => self.defines(draw.reads_nearest),
            None => Vec::new(),
        };
        let shader = self.shader(&source, defines)?;
        let settings = self.settings(&shader);
        let formats: Vec<wgpu::TextureFormat> =
            draw.into.iter().map(|drawn| drawn.format).collect();
        let name = match first {
            Some(_) => name_of("blend quads"),
            None => name_of(&format!("{fragment} quads")),
        };
        let pipeline = self.device.pipelines.draw(&Draw {
            label: &name,
            vertex: (&shader, &self.entry(vertex)),
            fragment: (&shader, &self.entry(fragment)),
            settings: &settings,
            formats: &formats,
            kind: draw.kind,
        })?;
        let pipeline = pipeline.pipeline;
        let buffers = [
            ("params", &params),
            ("footprints", &self.made.footprints),
            ("payloads", &self.made.payloads),
            ("numbers", &bound.order.numbers),
            ("surface", &bound.surface),
            ("passed", &bound.passed),
        ];
        let nearest = [("nearest", &bound.nearest)];
        let group = bind(self.device.recorder.gpu, &pipeline, |variable| {
            self.bound(variable, &buffers, &nearest)
        })?;
        let recorder = &mut *self.device.recorder;
        let at_once = if recorder.gpu.is_software() { AT_A_TIME } else { u32::MAX };
        // One part at least, so that pictures are cleared.
        let parts = (0..n.max(1)).step_by(at_once as usize);
        let record = |from: u32| {
            let (pipeline, group) = (&pipeline, &group);
            move |pass: &mut wgpu::RenderPass<'_>| {
                if let Stage::Render(stage) = &pipeline.stage {
                    pass.set_pipeline(stage);
                    pass.set_bind_group(0, group, &[]);
                    pass.draw(0..4, from..from.saturating_add(at_once).min(n));
                }
            }
        };
        let colors: Vec<Attachment<'_>> =
            draw.into.iter().map(|drawn| Attachment::cleared(drawn.view)).collect();
        let depth = draw.depth.map(|depth| (depth, true));
        recorder.render_parts(&name, &colors, depth, parts.map(record));
        Ok(())
    }

    /// Runs an entry point for each pixel.
    pub(super) fn gather(
        &mut self,
        entry: &str,
        view: &Parameters,
        buffers: &[(&str, &wgpu::Buffer)],
        textures: &[(&str, &wgpu::TextureView)],
    ) -> Result<(), String> {
        let params = self.device.uniform(&view.words(self.made.n));
        let has = |wanted: &str| textures.iter().any(|(name, _)| *name == wanted);
        let n_planes = if entry == "finish" { self.n_planes() } else { 1 };
        let mut defines = self.defines(false);
        if has("middle") {
            defines.push("MEDIAN");
        }
        let is_per_pixel = self.splats.per_pixel.is_some();
        let source = gather_source(self.splats.targets.len(), n_planes, is_per_pixel);
        let shader = self.shader(&source, defines)?;
        let settings = self.settings(&shader);
        let (name, entry) = (name_of(entry), self.entry(entry));
        let found = self.device.pipelines.compute(&name, &shader, &entry, &settings)?;
        let pipeline = found.pipeline;
        let own = [
            ("params", &params),
            ("payloads", &self.made.payloads),
            ("footprints", &self.made.footprints),
        ];
        let buffers = [buffers, &own].concat();
        let group = bind(self.device.recorder.gpu, &pipeline, |variable| {
            self.bound(variable, &buffers, textures)
        })?;
        let groups = self.size.map(|side| side.div_ceil(GROUP));
        self.device.dispatch(&name, &pipeline, &group, groups);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::Gpu;
    use crate::graph::pipelines::Pipelines;
    use surfelshop_api::graph::{Footprint, Pass};

    const HALF: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
    const ONE: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;

    /// The entry point of fragments, the pictures that are blended from the first on, and what they draw into.
    type Drawn = (&'static str, Option<[u32; 2]>, &'static [wgpu::TextureFormat], DrawKind);

    const DRAWS: [Drawn; 5] = [
        ("pick", None, &[wgpu::TextureFormat::Rg32Uint], DrawKind::NearestSplats),
        ("hide", None, &[ONE], DrawKind::SplatsOver),
        ("middle", None, &[ONE], DrawKind::ReplacedSplats),
        ("blend_from_0", Some([0, 4]), &[HALF; 4], DrawKind::SplatsOver),
        ("blend_from_4", Some([4, 3]), &[HALF; 3], DrawKind::AddedSplats),
    ];

    /// Makes all draws and dispatches of texts that `put` changes, whose entry points begin with `prefix`.
    fn compile(put: impl Fn(String) -> String, prefix: &str, own: &[&str]) {
        let gpu = Gpu::noop().unwrap();
        let mut pipelines = Pipelines::new(gpu.device.clone()).unwrap();
        let is_per_pixel = !own.is_empty();
        for (entry, planes, formats, kind) in DRAWS {
            for defines in [&[][..], &["FROM_NEAREST"], &["NORMALIZED"]] {
                let text = put(quads_source(4, planes, is_per_pixel));
                let shader = pipelines.shader(&text, &[own, defines].concat()).unwrap();
                let made = pipelines.draw(&Draw {
                    label: entry,
                    vertex: (&shader, &format!("{prefix}from_far")),
                    fragment: (&shader, &format!("{prefix}{entry}")),
                    settings: &Settings::default(),
                    formats,
                    kind,
                });
                made.map(|_| ()).unwrap_or_else(|e| panic!("{entry}: {e}"));
            }
        }
        for entry in ["halve", "gather", "finish"] {
            for defines in [&[][..], &["EXPECTED", "MEDIAN"], &["NORMALIZED", "DISTORTION"]] {
                let text = put(gather_source(4, 7, is_per_pixel));
                let shader = pipelines.shader(&text, &[own, defines].concat()).unwrap();
                let name = format!("{prefix}{entry}");
                let made = pipelines.compute(entry, &shader, &name, &Settings::default());
                made.map(|_| ()).unwrap_or_else(|e| panic!("{entry}: {e}"));
            }
        }
    }

    #[test]
    fn every_draw_compiles_for_any_device() {
        compile(|text| text, "", &[]);
    }

    /// Behind an author's text that has names of the host's.
    #[test]
    fn every_draw_compiles_with_a_function_of_pixels() {
        let wgsl = "#import surfelshop::splat
            var<storage, read> numbers: array<f32>;
            var<storage, read> surface: array<f32>;
            fn pick(i: u32) -> splat::Splat { return splat::nothing(); }
            fn met(p: splat::Pixel) -> splat::Fragment {
                return splat::Fragment(p.opacity + numbers[p.index] + surface[0], p.payload);
            }";
        let pass = Pass::splats("splats", wgsl, "pick", Footprint::Conic, 3);
        compile(|text| behind(&pass, "met", &text), PREFIX, &["PER_PIXEL"]);
    }
}
