//! The surface buffer: made once for a view and shared by every renderer that looks through it.

use super::columns::DrawnCloud;
use crate::gpu::Gpu;
use crate::run::{
    Attachment, Draw, DrawKind, PassState, Pipeline, Pipelines, Recorder, Stage, bind,
};
use glam::DVec3;
use std::collections::BTreeMap;
use std::rc::Rc;
use surfelshop_api::columns::NEUTRAL_ALBEDO;
use surfelshop_api::graph::SurfaceMode;
use surfelshop_api::{SurfaceSettings, Uniform};
use wgpu::util::DeviceExt as _;

const DISC: &str = include_str!("../../../../shaders/host/disc.wgsl");
const DRAW: &str = include_str!("../../../../shaders/host/draw_surfels.wgsl");
const ACCUMULATE_FIXED: &str = include_str!("../../../../shaders/host/accumulate_fixed.wgsl");
pub(crate) const RESOLVE: &str = include_str!("../../../../shaders/host/resolve.wgsl");

/// Surface buffers kept for views that are no longer drawn every frame.
const KEPT_SURFACES: usize = 4;

/// Which parts of the surface a frame needs; each needs the ones before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct SurfaceParts {
    /// Depth and index of the nearest surfel.
    pub(crate) visibility: bool,
    /// The surface of the nearest surfels.
    pub(crate) nearest: bool,
    /// The surface of blended surfels.
    pub(crate) blended: bool,
    /// The material of the nearest surfels.
    pub(crate) material: bool,
}

impl SurfaceParts {
    pub(crate) fn add(&mut self, mode: SurfaceMode) {
        self.visibility = true;
        match mode {
            SurfaceMode::Nearest => self.nearest = true,
            SurfaceMode::Blended => self.blended = true,
        }
    }
}

/// How often parts of surface buffers were made since the engine was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct SurfaceCounts {
    /// Times the nearest surfels were found.
    pub visibility: u32,
    /// Times the nearest surfels' surface was made.
    pub nearest: u32,
    /// Times the blended surface was made.
    pub blended: u32,
}

/// The surface buffer of one view.
pub(crate) struct Surface {
    depth: wgpu::TextureView,
    /// Number and distance of the nearest surfels.
    pub(crate) winners: wgpu::TextureView,
    nearest: Option<wgpu::TextureView>,
    blended: Option<wgpu::TextureView>,
    pub(crate) material: Option<wgpu::TextureView>,
    visible: bool,
}

impl Surface {
    /// Size in pixels.
    pub(crate) fn size(&self) -> wgpu::Extent3d {
        self.depth.texture().size()
    }

    /// The packed surface of a mode, once made.
    pub(crate) fn packed(&self, mode: SurfaceMode) -> Option<&wgpu::TextureView> {
        match mode {
            SurfaceMode::Nearest => self.nearest.as_ref(),
            SurfaceMode::Blended => self.blended.as_ref(),
        }
    }
}

/// What a surface buffer is made from.
pub(crate) struct SurfaceInput<'a> {
    pub(crate) clouds: &'a [DrawnCloud],
    pub(crate) settings: &'a SurfaceSettings,
    pub(crate) view_uniform: &'a wgpu::Buffer,
    /// Rigid motion to view space for positions relative to an origin.
    pub(crate) view_from_offset: &'a dyn Fn(DVec3) -> glam::Mat4,
    pub(crate) size: [u32; 2],
    /// Equal keys mean equal surfaces.
    pub(crate) key: Vec<u8>,
}

/// Surface buffers by key.
#[derive(Default)]
pub(crate) struct Surfaces {
    kept: Vec<(Vec<u8>, Surface)>,
    pub(crate) counts: SurfaceCounts,
}

impl Surfaces {
    /// Records what is missing of a view's surface and returns it.
    ///
    /// # Errors
    /// Where a pipeline cannot be made.
    pub(crate) fn ensure(
        &mut self,
        parts: SurfaceParts,
        input: &SurfaceInput<'_>,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<&Surface, String> {
        let mut surface = match self.kept.iter().position(|(key, _)| *key == input.key) {
            Some(at) => self.kept.remove(at).1,
            None => Surface::new(recorder.gpu, input.size),
        };
        let drawing = Drawing::new(input, recorder.gpu);
        let reused = |recorder: &mut Recorder<'_>, name| recorder.note(name, PassState::Reused);
        if parts.visibility {
            if surface.visible {
                reused(recorder, "surfels: visibility");
            } else {
                drawing.visibility(&surface, recorder, pipelines)?;
                surface.visible = true;
                self.counts.visibility += 1;
            }
        }
        if parts.nearest {
            if surface.nearest.is_some() {
                reused(recorder, "surfels: nearest");
            } else {
                let view = packed_texture(recorder.gpu, input.size);
                drawing.lookup(Lookup::Surface, &surface, &view, recorder, pipelines)?;
                surface.nearest = Some(view);
                self.counts.nearest += 1;
            }
        }
        if parts.blended {
            if surface.blended.is_some() {
                reused(recorder, "surfels: blend");
            } else {
                let view = packed_texture(recorder.gpu, input.size);
                if recorder.gpu.blends_f32 {
                    drawing.blend(&surface, &view, recorder, pipelines)?;
                } else {
                    drawing.blend_fixed(&surface, &view, recorder, pipelines)?;
                }
                surface.blended = Some(view);
                self.counts.blended += 1;
            }
        }
        if parts.material {
            if surface.material.is_some() {
                reused(recorder, "surfels: material");
            } else {
                let format = wgpu::TextureFormat::R32Uint;
                let view = texture(recorder.gpu, "material", input.size, format);
                drawing.lookup(Lookup::Material, &surface, &view, recorder, pipelines)?;
                surface.material = Some(view);
            }
        }
        self.kept.insert(0, (input.key.clone(), surface));
        self.kept.truncate(KEPT_SURFACES);
        Ok(&self.kept[0].1)
    }

    /// Forgets every surface: after a frame that failed half way.
    pub(crate) fn clear(&mut self) {
        self.kept.clear();
    }
}

impl Surface {
    fn new(gpu: &Gpu, size: [u32; 2]) -> Self {
        Self {
            depth: texture(gpu, "nearest depth", size, wgpu::TextureFormat::Depth32Float),
            winners: texture(gpu, "nearest surfels", size, wgpu::TextureFormat::Rg32Uint),
            nearest: None,
            blended: None,
            material: None,
            visible: false,
        }
    }
}

fn packed_texture(gpu: &Gpu, size: [u32; 2]) -> wgpu::TextureView {
    texture(gpu, "surface", size, wgpu::TextureFormat::Rgba32Uint)
}

fn texture(
    gpu: &Gpu,
    label: &str,
    size: [u32; 2],
    format: wgpu::TextureFormat,
) -> wgpu::TextureView {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// What is looked up of the nearest surfels.
#[derive(Clone, Copy)]
enum Lookup {
    /// The packed surface.
    Surface,
    /// The material's index.
    Material,
}

/// A chunk with its uniform.
struct Chunk<'a> {
    cloud: &'a DrawnCloud,
    position: usize,
    count: u32,
    uniform: wgpu::Buffer,
}

/// One surface being drawn.
struct Drawing<'a> {
    input: &'a SurfaceInput<'a>,
    chunks: Vec<Chunk<'a>>,
    none: BTreeMap<String, f64>,
}

impl<'a> Drawing<'a> {
    fn new(input: &'a SurfaceInput<'a>, gpu: &Gpu) -> Self {
        let mut chunks = Vec::new();
        // Number 0 is left for "no surfel".
        let mut first_of_cloud = 1;
        for cloud in input.clouds {
            let view_from_chunk = (input.view_from_offset)(cloud.origin);
            for (position, (first, count)) in cloud.chunks().enumerate() {
                let bytes = Uniform::new()
                    .mat4(view_from_chunk)
                    .u32(first_of_cloud + first)
                    .u32(count)
                    .f32(input.settings.radius_scale)
                    .f32(input.settings.depth_tolerance)
                    .u32(u32::from(input.settings.two_sided))
                    .vec3(NEUTRAL_ALBEDO.into())
                    .into_bytes();
                let uniform = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                    label: Some("chunk"),
                    contents: &bytes,
                    usage: wgpu::BufferUsages::UNIFORM,
                });
                chunks.push(Chunk { cloud, position, count, uniform });
            }
            first_of_cloud += cloud.n_surfels;
        }
        Self { input, chunks, none: BTreeMap::new() }
    }

    fn bind(
        &self,
        gpu: &Gpu,
        pipeline: &Pipeline,
        chunk: &Chunk<'_>,
        more: &[(&str, wgpu::BindingResource<'_>)],
    ) -> Result<wgpu::BindGroup, String> {
        bind(gpu, pipeline, |name| {
            if let Some((_, resource)) = more.iter().find(|(other, _)| *other == name) {
                return Some(resource.clone());
            }
            match name {
                "chunk" => Some(chunk.uniform.as_entire_binding()),
                "surfelshop::view::view" => Some(self.input.view_uniform.as_entire_binding()),
                _ => {
                    let columns = &chunk.cloud.columns;
                    let (_, buffers) = columns.iter().find(|(column, _)| *column == name)?;
                    Some(buffers.get(chunk.position)?.as_entire_binding())
                }
            }
        })
    }

    /// The pipeline for each chunk's set of columns.
    fn pipeline(
        &self,
        gpu: &Gpu,
        chunk: &Chunk<'_>,
        pipelines: &mut Pipelines,
        label: &str,
        [vertex, fragment]: [&str; 2],
        formats: &[wgpu::TextureFormat],
        kind: DrawKind,
    ) -> Result<Rc<Pipeline>, String> {
        let mut defines = chunk.cloud.defines.clone();
        if !gpu.keeps_reversed_depth() {
            defines.push("EXPLICIT_DEPTH");
        }
        let shader = pipelines.shader(&format!("{DISC}\n{DRAW}"), &defines)?;
        let screen = pipelines.shader(RESOLVE, &[])?;
        let vertex_shader = if kind == DrawKind::Fullscreen { &screen } else { &shader };
        pipelines.draw(&Draw {
            label,
            vertex: (vertex_shader, vertex),
            fragment: (&shader, fragment),
            constants: &self.none,
            formats,
            kind,
        })
    }

    fn prepare(
        &self,
        gpu: &Gpu,
        pipelines: &mut Pipelines,
        label: &str,
        entries: [&str; 2],
        formats: &[wgpu::TextureFormat],
        kind: DrawKind,
        more: &[(&str, wgpu::BindingResource<'_>)],
    ) -> Result<Vec<(Rc<Pipeline>, wgpu::BindGroup, u32)>, String> {
        self.chunks
            .iter()
            .map(|chunk| {
                let pipeline =
                    self.pipeline(gpu, chunk, pipelines, label, entries, formats, kind)?;
                let group = self.bind(gpu, &pipeline, chunk, more)?;
                Ok((pipeline, group, chunk.count))
            })
            .collect()
    }

    fn visibility(
        &self,
        surface: &Surface,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<(), String> {
        let name = "surfels: visibility";
        let entries = ["nearest_vertex", "nearest_fragment"];
        let formats = [wgpu::TextureFormat::Rg32Uint];
        let kind = DrawKind::NearestSurfels;
        let draws = self.prepare(recorder.gpu, pipelines, name, entries, &formats, kind, &[])?;
        let colors = [Attachment::cleared(&surface.winners)];
        recorder.render(name, &colors, Some((&surface.depth, true)), |pass| {
            draw_quads(pass, &draws);
        });
        Ok(())
    }

    /// Fills a texture with what is looked up of the nearest surfels.
    fn lookup(
        &self,
        what: Lookup,
        surface: &Surface,
        target: &wgpu::TextureView,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<(), String> {
        let (name, entry, format) = match what {
            Lookup::Surface => {
                ("surfels: nearest", "lookup_fragment", wgpu::TextureFormat::Rgba32Uint)
            }
            Lookup::Material => {
                ("surfels: material", "material_fragment", wgpu::TextureFormat::R32Uint)
            }
        };
        let more = [("nearest", wgpu::BindingResource::TextureView(&surface.winners))];
        let entries = ["cover_screen", entry];
        let formats = [format];
        let kind = DrawKind::Fullscreen;
        let draws = self.prepare(recorder.gpu, pipelines, name, entries, &formats, kind, &more)?;
        recorder.render(name, &[Attachment::cleared(target)], None, |pass| {
            for (pipeline, group, _) in &draws {
                set(pass, pipeline, group);
                pass.draw(0..3, 0..1);
            }
        });
        Ok(())
    }

    /// Adds up surfels by blending and divides.
    fn blend(
        &self,
        surface: &Surface,
        target: &wgpu::TextureView,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<(), String> {
        let name = "surfels: accumulate";
        let formats = [wgpu::TextureFormat::Rgba32Float; 2];
        let sums = formats.map(|format| texture(recorder.gpu, "sums", self.input.size, format));
        let entries = ["blended_vertex", "blended_fragment"];
        let kind = DrawKind::AddedSurfels;
        let more = [("nearest", wgpu::BindingResource::TextureView(&surface.winners))];
        let draws = self.prepare(recorder.gpu, pipelines, name, entries, &formats, kind, &more)?;
        let colors = [Attachment::cleared(&sums[0]), Attachment::cleared(&sums[1])];
        recorder.render(name, &colors, Some((&surface.depth, false)), |pass| {
            draw_quads(pass, &draws);
        });
        let more = [
            ("sum_normal_weight", wgpu::BindingResource::TextureView(&sums[0])),
            ("sum_albedo_ao", wgpu::BindingResource::TextureView(&sums[1])),
        ];
        self.resolve("resolve", surface, &Attachment::cleared(target), &more, recorder, pipelines)
    }

    /// Adds up surfels in fixed point and divides, over the nearest surfels.
    fn blend_fixed(
        &self,
        surface: &Surface,
        target: &wgpu::TextureView,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<(), String> {
        self.lookup(Lookup::Surface, surface, target, recorder, pipelines)?;
        let gpu = recorder.gpu;
        let pixels = u64::from(self.input.size[0]) * u64::from(self.input.size[1]);
        let sums = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("fixed sums"),
            size: 32 * pixels,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        recorder.encoder.clear_buffer(&sums, 0, None);
        let name = "surfels: accumulate";
        let more = [
            ("sums", sums.as_entire_binding()),
            ("nearest", wgpu::BindingResource::TextureView(&surface.winners)),
        ];
        let mut dispatches = Vec::new();
        for chunk in &self.chunks {
            let source = format!("{DISC}\n{ACCUMULATE_FIXED}");
            let shader = pipelines.shader(&source, &chunk.cloud.defines)?;
            let pipeline = pipelines.compute(name, &shader, "accumulate", &self.none)?;
            let group = self.bind(gpu, &pipeline, chunk, &more)?;
            dispatches.push((pipeline, group, chunk.count.div_ceil(64)));
        }
        recorder.compute(name, |pass| {
            for (pipeline, group, groups) in &dispatches {
                if let Stage::Compute(stage) = &pipeline.stage {
                    pass.set_pipeline(stage);
                    pass.set_bind_group(0, group, &[]);
                    let rows = groups.div_ceil(MAX_GROUPS);
                    pass.dispatch_workgroups(groups.div_ceil(rows), rows, 1);
                }
            }
        });
        let more = [("fixed_sums", sums.as_entire_binding())];
        let target = Attachment { view: target, clear: false, slice: None };
        self.resolve("resolve_fixed", surface, &target, &more, recorder, pipelines)
    }

    fn resolve(
        &self,
        entry: &str,
        surface: &Surface,
        target: &Attachment<'_>,
        more: &[(&str, wgpu::BindingResource<'_>)],
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<(), String> {
        let name = "surfels: resolve";
        let shader = pipelines.shader(RESOLVE, &[])?;
        let pipeline = pipelines.draw(&Draw {
            label: name,
            vertex: (&shader, "cover_screen"),
            fragment: (&shader, entry),
            constants: &self.none,
            formats: &[wgpu::TextureFormat::Rgba32Uint],
            kind: DrawKind::Fullscreen,
        })?;
        let group = bind(recorder.gpu, &pipeline, |name| {
            if let Some((_, resource)) = more.iter().find(|(other, _)| *other == name) {
                return Some(resource.clone());
            }
            match name {
                "surfelshop::view::view" => Some(self.input.view_uniform.as_entire_binding()),
                "nearest" => Some(wgpu::BindingResource::TextureView(&surface.winners)),
                _ => None,
            }
        })?;
        let target = [Attachment { view: target.view, clear: target.clear, slice: None }];
        recorder.render(name, &target, None, |pass| {
            set(pass, &pipeline, &group);
            pass.draw(0..3, 0..1);
        });
        Ok(())
    }
}

/// WebGPU's smallest limit of workgroups per direction.
const MAX_GROUPS: u32 = 65_535;

fn set(pass: &mut wgpu::RenderPass<'_>, pipeline: &Pipeline, group: &wgpu::BindGroup) {
    if let Stage::Render(stage) = &pipeline.stage {
        pass.set_pipeline(stage);
        pass.set_bind_group(0, group, &[]);
    }
}

fn draw_quads(pass: &mut wgpu::RenderPass<'_>, draws: &[(Rc<Pipeline>, wgpu::BindGroup, u32)]) {
    for (pipeline, group, count) in draws {
        set(pass, pipeline, group);
        pass.draw(0..4, 0..*count);
    }
}
