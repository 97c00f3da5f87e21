//! The passes that make a surface buffer out of surfels.

mod chunk_uniform;
mod rims;

use crate::gpu::Gpu;
use crate::graph::{
    Attachment, Draw, DrawKind, Pipeline, Pipelines, Recorder, Settings, Stage, bind,
};
use crate::surfels::chunk::{Chunk, Runs};
use crate::surfels::columns::elements::linear_of_srgb;
use crate::surfels::spare_textures::texture;
use crate::surfels::surface::{Surface, SurfaceInput};
use chunk_uniform::{PlacedChunk, chunk_uniform};
use std::ops::Range;
use std::sync::Arc;
use surfelshop_raster::{Cloud, places};

pub(crate) const DISC: &str = concat!(include_str!("disc.wgsl"), include_str!("local.wgsl"),);
const DRAW: &str = include_str!("draw_surfels.wgsl");
pub(crate) const FOOTPRINT: &str = include_str!("footprint.wgsl");
pub(crate) const RESOLVE: &str =
    concat!(include_str!("resolve.wgsl"), "\n", include_str!("../../graph/cover_screen.wgsl"));

/// What is looked up of the nearest surfels.
#[derive(Clone, Copy)]
pub(crate) enum Lookup {
    /// The packed surface.
    Surface,
    /// The material's index.
    Material,
    /// The cloud's number, from 0.
    Object,
}

/// A draw of every chunk.
pub(crate) struct Step<'a> {
    pub(crate) name: &'a str,
    /// Vertex and fragment entry point.
    pub(crate) entries: [&'a str; 2],
    pub(crate) formats: &'a [wgpu::TextureFormat],
    pub(crate) kind: DrawKind,
}

/// How a chunk is drawn: pipeline, bindings and number of surfels.
pub(crate) type ChunkDraw = (Arc<Pipeline>, wgpu::BindGroup, u32);

/// One surface being drawn.
pub(crate) struct Drawing<'a> {
    pub(crate) input: &'a SurfaceInput<'a>,
    pub(crate) chunks: Vec<Chunk<'a>>,
    /// Surfels that are drawn of all.
    pub(crate) n_drawn: usize,
    linear_of_srgb: wgpu::Buffer,
    /// How many surfels of all chunks are large, where compute has drawn the small ones.
    pub(crate) n_large: Option<wgpu::Buffer>,
    pub(crate) none: Settings,
}

impl<'a> Drawing<'a> {
    pub(crate) fn new(input: &'a SurfaceInput<'a>, gpu: &Gpu) -> Self {
        let (mut chunks, mut n_drawn) = (Vec::new(), 0);
        // Number 0 is left for "no surfel".
        let mut first_of_cloud = 1;
        for cloud in input.clouds {
            let view_from_chunk = input.view_from_offset(cloud.origin);
            let round_reach = input.round_reach(cloud);
            let chosen = cloud.merged.as_deref().map(|columns| {
                let view_from_cloud = view_from_chunk;
                let (object, geometry) = (cloud.object, None);
                let cloud =
                    Cloud { columns, geometry, view_from_cloud, first: 1, object, round_reach };
                places(&cloud, input.raster_view)
            });
            n_drawn += match &chosen {
                Some(runs) => runs.iter().map(ExactSizeIterator::len).sum(),
                None => cloud.n_surfels.div_ceil(input.stride) as usize,
            };
            for (position, (first, count)) in cloud.chunks().into_iter().enumerate() {
                let runs = chosen.as_ref().map(|all| Runs::new(all, first..first + count, gpu));
                let placed = PlacedChunk {
                    view_from_chunk,
                    first: first_of_cloud + first,
                    count,
                    object: cloud.object,
                    equal_radius: cloud.equal_radius.unwrap_or(0.0),
                    round_reach,
                    n_own: cloud.n_surfels.saturating_sub(first).min(count),
                };
                let bytes =
                    chunk_uniform(input.settings, input.unit, input.stride, &placed).into_bytes();
                let uniform = gpu.filled_buffer("chunk", &bytes, wgpu::BufferUsages::UNIFORM);
                chunks.push(Chunk {
                    cloud,
                    position,
                    count,
                    uniform,
                    lit: None,
                    clipped: first >= cloud.n_whole,
                    tints_backs: input.tints_backs,
                    fields: false,
                    runs,
                    computed: None,
                });
            }
            first_of_cloud += cloud.n_places;
        }
        let linear_of_srgb =
            gpu.filled_buffer("linear of sRGB", &linear_of_srgb(), wgpu::BufferUsages::UNIFORM);
        let (n_large, none) = (None, Settings::default());
        Self { input, chunks, n_drawn, linear_of_srgb, n_large, none }
    }

    /// Says whether normals are drawn as fields, where surfels have some.
    pub(crate) fn with_fields(&mut self, fields: bool) -> &Self {
        for chunk in &mut self.chunks {
            chunk.fields = fields;
        }
        self
    }

    /// Surfels in each chunk.
    pub(crate) fn counts(&self) -> impl Iterator<Item = u32> {
        self.chunks.iter().map(|chunk| chunk.count)
    }

    /// The columns that a chunk has.
    pub(crate) fn defines(&self, chunk: usize) -> &[&'static str] {
        self.chunks.get(chunk).map_or(&[], |chunk| &chunk.cloud.defines)
    }

    /// Binds a pipeline to a chunk.
    ///
    /// # Errors
    /// Where a variable has no such resource.
    pub(crate) fn bind_chunk(
        &self,
        gpu: &Gpu,
        pipeline: &Pipeline,
        chunk: usize,
        more: &[(&str, wgpu::BindingResource<'_>)],
    ) -> Result<wgpu::BindGroup, String> {
        let chunk = self.chunks.get(chunk).ok_or("there is no such chunk")?;
        self.bind(gpu, pipeline, chunk, more)
    }

    /// Has a chunk drawn with what its surfels radiate instead of their albedo.
    pub(crate) fn light(&mut self, chunk: usize, radiance: wgpu::Buffer) {
        if let Some(chunk) = self.chunks.get_mut(chunk) {
            chunk.lit = Some(radiance);
        }
    }

    pub(crate) fn bind(
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
                "linear_of_srgb" => Some(self.linear_of_srgb.as_entire_binding()),
                "chunk" => Some(chunk.uniform.as_entire_binding()),
                "lit" => Some(chunk.lit.as_ref()?.as_entire_binding()),
                "runs" => Some(chunk.runs.as_ref()?.places.as_entire_binding()),
                "boxes" => Some(chunk.computed.as_ref()?.boxes.as_entire_binding()),
                "blocks" => Some(chunk.computed.as_ref()?.blocks.as_entire_binding()),
                "list" => Some(chunk.computed.as_ref()?.list.as_entire_binding()),
                "large" => Some(chunk.computed.as_ref()?.large.as_entire_binding()),
                "total" => Some(self.n_large.as_ref()?.as_entire_binding()),
                "surfelshop::view::view" => Some(self.input.view_uniform.as_entire_binding()),
                _ => {
                    let columns = &chunk.cloud.columns;
                    let (_, buffers) = columns.iter().find(|(column, _)| *column == name)?;
                    Some(buffers.get(chunk.position)?.as_entire_binding())
                }
            }
        })
    }

    /// Pipelines and bindings of a step, chunk by chunk: which columns a chunk has decides which
    /// variant of the shader draws it.
    pub(crate) fn prepare(
        &self,
        step: &Step<'_>,
        gpu: &Gpu,
        pipelines: &mut Pipelines,
        more: &[(&str, wgpu::BindingResource<'_>)],
    ) -> Result<Vec<ChunkDraw>, String> {
        let screen = pipelines.shader(RESOLVE, &[])?;
        let mut prepared = Vec::with_capacity(self.chunks.len());
        for chunk in &self.chunks {
            let footprint = chunk.computed.as_ref().map_or("", |_| FOOTPRINT);
            let source = format!("{DISC}\n{footprint}\n{DRAW}");
            let mut defines = chunk.defines();
            if !gpu.keeps_reversed_depth() {
                defines.push("EXPLICIT_DEPTH");
            }
            let shader = pipelines.shader(&source, &defines)?;
            let vertex = if step.kind == DrawKind::Fullscreen { &screen } else { &shader };
            let pipeline = pipelines
                .draw(&Draw {
                    label: step.name,
                    vertex: (vertex, step.entries[0]),
                    fragment: (&shader, step.entries[1]),
                    settings: &self.none,
                    formats: step.formats,
                    kind: step.kind,
                })?
                .pipeline;
            let group = self.bind(gpu, &pipeline, chunk, more)?;
            prepared.push((pipeline, group, chunk.drawn(self.input.stride)));
        }
        Ok(prepared)
    }

    /// Finds the nearest surfels in the way that is asked for.
    pub(crate) fn nearest(
        &mut self,
        surface: &Surface,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<(), String> {
        match self.input.computes {
            true => self.compute_visibility(surface, recorder, pipelines),
            false => self.visibility(surface, recorder, pipelines),
        }
    }

    /// Adds up surfels and divides, in the way that their visibility was found.
    pub(crate) fn blended(
        &self,
        surface: &Surface,
        target: &wgpu::TextureView,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<(), String> {
        match (self.n_large.is_some(), recorder.gpu.blends_f32) {
            (true, true) => self.blend_computed(surface, target, recorder, pipelines),
            (false, true) => self.blend(surface, target, recorder, pipelines),
            (_, false) => self.blend_fixed(surface, target, None, recorder, pipelines),
        }
    }

    fn visibility(
        &self,
        surface: &Surface,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<(), String> {
        let step = NEAREST_QUADS;
        let draws = self.prepare(&step, recorder.gpu, pipelines, &[])?;
        let colors = [Attachment::cleared(surface.winners()?)];
        draw_quads(&draws, &step, &colors, (depth_of(surface)?, true), recorder);
        Ok(())
    }

    /// Fills a texture with what is looked up of the nearest surfels.
    pub(crate) fn lookup(
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
            Lookup::Object => ("surfels: object", "object_fragment", wgpu::TextureFormat::R32Uint),
        };
        let more = [("nearest", wgpu::BindingResource::TextureView(surface.winners()?))];
        let entries = ["cover_screen", entry];
        let step = Step { name, entries, formats: &[format], kind: DrawKind::Fullscreen };
        let draws = self.prepare(&step, recorder.gpu, pipelines, &more)?;
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
        let sums = self.sums(recorder.gpu);
        let step = ADDED_QUADS;
        let more = [("nearest", wgpu::BindingResource::TextureView(surface.winners()?))];
        let draws = self.prepare(&step, recorder.gpu, pipelines, &more)?;
        let colors = [Attachment::cleared(&sums[0]), Attachment::cleared(&sums[1])];
        draw_quads(&draws, &step, &colors, (depth_of(surface)?, false), recorder);
        let more = [
            ("sum_normal_weight", wgpu::BindingResource::TextureView(&sums[0])),
            ("sum_albedo_ao", wgpu::BindingResource::TextureView(&sums[1])),
        ];
        self.resolve("resolve", surface, &Attachment::cleared(target), &more, recorder, pipelines)
    }

    /// Textures for the sums of blending.
    pub(crate) fn sums(&self, gpu: &Gpu) -> [wgpu::TextureView; 2] {
        let format = wgpu::TextureFormat::Rgba32Float;
        std::array::from_fn(|_| texture(gpu, "sums", self.input.size, format))
    }

    pub(crate) fn resolve(
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
        let pipeline = pipelines
            .draw(&Draw {
                label: name,
                vertex: (&shader, "cover_screen"),
                fragment: (&shader, entry),
                settings: &self.none,
                formats: &[wgpu::TextureFormat::Rgba32Uint],
                kind: DrawKind::Fullscreen,
            })?
            .pipeline;
        let group = bind(recorder.gpu, &pipeline, |name| {
            if let Some((_, resource)) = more.iter().find(|(other, _)| *other == name) {
                return Some(resource.clone());
            }
            match name {
                "surfelshop::view::view" => Some(self.input.view_uniform.as_entire_binding()),
                "nearest" => surface.winners.as_ref().map(wgpu::BindingResource::TextureView),
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

/// All quads, added up where they are seen.
pub(crate) const ADDED_QUADS: Step<'_> = Step {
    name: "surfels: accumulate",
    entries: ["blended_vertex", "blended_fragment"],
    formats: &[wgpu::TextureFormat::Rgba32Float; 2],
    kind: DrawKind::AddedSurfels,
};

/// The nearest of all quads.
pub(crate) const NEAREST_QUADS: Step<'_> = Step {
    name: "surfels: visibility",
    entries: ["nearest_vertex", "nearest_fragment"],
    formats: &[wgpu::TextureFormat::Rg32Uint],
    kind: DrawKind::NearestSurfels,
};

/// The depth of a surface that the device draws.
pub(crate) fn depth_of(surface: &Surface) -> Result<&wgpu::TextureView, String> {
    surface.depth.as_ref().ok_or_else(|| "the surface has no depth".to_owned())
}

/// WebGPU's smallest limit of workgroups per direction.
const MAX_GROUPS: u32 = 65_535;

/// Runs an entry point with groups of 64 for each of so many surfels.
pub(crate) fn each_of(
    pass: &mut wgpu::ComputePass<'_>,
    pipeline: &Pipeline,
    group: &wgpu::BindGroup,
    surfels: u32,
) {
    let groups = surfels.div_ceil(64);
    if let Stage::Compute(stage) = &pipeline.stage
        && groups > 0
    {
        let rows = groups.div_ceil(MAX_GROUPS);
        pass.set_pipeline(stage);
        pass.set_bind_group(0, group, &[]);
        pass.dispatch_workgroups(groups.div_ceil(rows), rows, 1);
    }
}

pub(crate) fn set(pass: &mut wgpu::RenderPass<'_>, pipeline: &Pipeline, group: &wgpu::BindGroup) {
    if let Stage::Render(stage) = &pipeline.stage {
        pass.set_pipeline(stage);
        pass.set_bind_group(0, group, &[]);
    }
}

/// Surfels that a software driver draws before it gets more.
///
/// Such a driver keeps every triangle from its vertices until its pixels, at 300 to 400 bytes each,
/// and prepares triangles ahead of its pixels without a bound worth the name. Waiting costs it
/// some overlap of the two: half as many surfels save nothing more, twice as many draw a tenth
/// faster and take 40 MB more.
const AT_A_TIME: u32 = 1 << 16;

/// Draws all chunks, in parts where the driver is software.
fn draw_quads(
    draws: &[ChunkDraw],
    step: &Step<'_>,
    colors: &[Attachment<'_>],
    (depth, clear): (&wgpu::TextureView, bool),
    recorder: &mut Recorder<'_>,
) {
    let most = if recorder.gpu.is_software() { AT_A_TIME } else { u32::MAX };
    let counts: Vec<u32> = draws.iter().map(|(_, _, count)| *count).collect();
    let parts = parts(&counts, most);
    let records = parts.iter().map(|part| {
        move |pass: &mut wgpu::RenderPass<'_>| {
            for (chunk, surfels) in part {
                let (pipeline, group, _) = &draws[*chunk];
                set(pass, pipeline, group);
                pass.draw(0..4, surfels.clone());
            }
        }
    });
    recorder.render_parts(step.name, colors, Some((depth, clear)), records);
}

/// Chunks of so many surfels in parts of at most `most`: each part names chunks and surfels of
/// them. There is at least one part, so that a pass without surfels clears what it draws into.
fn parts(counts: &[u32], most: u32) -> Vec<Vec<(usize, Range<u32>)>> {
    let mut parts = vec![Vec::new()];
    let mut room = most;
    for (chunk, &count) in counts.iter().enumerate() {
        let mut start = 0;
        while start < count {
            if room == 0 {
                parts.push(Vec::new());
                room = most;
            }
            let end = start + room.min(count - start);
            if let Some(part) = parts.last_mut() {
                part.push((chunk, start..end));
            }
            room -= end - start;
            start = end;
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_hold_every_surfel_once_and_in_order() {
        assert_eq!(parts(&[], 5), [vec![]]);
        assert_eq!(parts(&[3, 2], u32::MAX), [vec![(0, 0..3), (1, 0..2)]]);
        assert_eq!(
            parts(&[3, 9, 1], 5),
            [vec![(0, 0..3), (1, 0..2)], vec![(1, 2..7)], vec![(1, 7..9), (2, 0..1)]]
        );
        assert_eq!(parts(&[5, 5], 5), [vec![(0, 0..5)], vec![(1, 0..5)]]);
    }
}
