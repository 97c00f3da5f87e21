//! Surfels drawn by compute: one invocation goes through the pixels of each small disc; large ones
//! are drawn as quads in the same frame.

pub(crate) mod fixed_point;

use crate::gpu::{Atomics, Gpu};
use crate::graph::{Attachment, Draw, DrawKind, Pipelines, Recorder, Stage, bind};
use crate::surfels::chunk::Computed;
use crate::surfels::quads::{
    ADDED_QUADS, DISC, Drawing, FOOTPRINT, NEAREST_QUADS, RESOLVE, Step, depth_of, each_of, set,
};
use crate::surfels::surface::Surface;
use surfelshop_api::Uniform;

const VISIBILITY: &str = include_str!("compute_visibility.wgsl");
const LIST: &str = include_str!("list_large.wgsl");
const SEED: &str = include_str!("seed.wgsl");

/// Bytes of a pixel's nearest number and distance.
const KEY_BYTES: u64 = 8;
/// Bytes of what is kept of a surfel.
const BOX_BYTES: u64 = 8;

/// Whether compute can draw pictures of a size: they must fit one binding.
pub(crate) fn fits(gpu: &Gpu, size: [u32; 2]) -> bool {
    let limits = gpu.device.limits();
    let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    u64::from(size[0]) * u64::from(size[1]) * KEY_BYTES <= most
}

impl Computed {
    /// Room for what is found of so many surfels.
    fn new(gpu: &Gpu, surfels: u32) -> Self {
        let buffer = |label: &str, size: u64| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            })
        };
        let n = u64::from(surfels.max(1));
        // Four corners each, and no surfels so far.
        let arguments = Uniform::new().u32(4).u32(0).u32(0).u32(0).into_bytes();
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDIRECT;
        Self {
            boxes: buffer("surfel boxes", BOX_BYTES * n),
            blocks: buffer("large surfels of blocks", 4 * n.div_ceil(64)),
            list: buffer("large surfels", 4 * n),
            large: gpu.filled_buffer("draw of large surfels", &arguments, usage),
        }
    }
}

impl Drawing<'_> {
    /// Whether compute has drawn the small surfels.
    pub(crate) fn is_computed(&self) -> bool {
        self.n_large.is_some()
    }

    /// Finds the nearest surfels by compute, and draws the large ones over them.
    pub(crate) fn compute_visibility(
        &mut self,
        surface: &Surface,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<(), String> {
        let gpu = recorder.gpu;
        let stride = self.input.stride;
        let none = gpu.filled_buffer("number of large", &[0; 4], wgpu::BufferUsages::STORAGE);
        self.n_large = Some(none);
        for chunk in &mut self.chunks {
            chunk.computed = Some(Computed::new(gpu, chunk.drawn(stride)));
        }
        let pixels = u64::from(self.input.size[0]) * u64::from(self.input.size[1]);
        let keys = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("nearest keys"),
            size: KEY_BYTES * pixels,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        recorder.encoder.clear_buffer(&keys, 0, None);
        let steps: &[(&str, u32)] = match gpu.atomics {
            Atomics::Only32 => &[
                ("surfels: compute visibility, distances", 0),
                ("surfels: compute visibility, numbers", 1),
            ],
            Atomics::Max64 | Atomics::All64 => &[("surfels: compute visibility", 0)],
        };
        for (name, number) in steps {
            self.offer_all(name, *number, &keys, recorder, pipelines)?;
        }
        self.list_large(recorder, pipelines)?;
        // What is drawn already stays: only what blending needs besides was found again.
        match surface.visible {
            true => Ok(()),
            false => self.merge(&keys, surface, recorder, pipelines),
        }
    }

    /// Has every small surfel offer itself to the pixels it covers.
    fn offer_all(
        &self,
        name: &str,
        number: u32,
        keys: &wgpu::Buffer,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<(), String> {
        let gpu = recorder.gpu;
        let step = Uniform::new().u32(number).into_bytes();
        let step = gpu.filled_buffer("step", &step, wgpu::BufferUsages::UNIFORM);
        let more = [("keys", keys.as_entire_binding()), ("step", step.as_entire_binding())];
        let atomics: &[&str] = match gpu.atomics {
            Atomics::Only32 => &[],
            Atomics::Max64 => &["ATOMIC64"],
            Atomics::All64 => &["ATOMIC64", "ATOMIC64_ALL"],
        };
        let source = format!("{DISC}\n{FOOTPRINT}\n{VISIBILITY}");
        let mut dispatches = Vec::new();
        for chunk in &self.chunks {
            let mut defines = chunk.defines();
            defines.extend(atomics);
            let shader = pipelines.shader(&source, &defines)?;
            let label = "surfels: compute visibility";
            let pipeline = pipelines.compute(label, &shader, "find_nearest", &self.none)?.pipeline;
            let group = self.bind(gpu, &pipeline, chunk, &more)?;
            dispatches.push((pipeline, group, chunk.drawn(self.input.stride)));
        }
        recorder.compute(name, |pass| {
            for (pipeline, group, surfels) in &dispatches {
                each_of(pass, pipeline, group, *surfels);
            }
        });
        Ok(())
    }

    /// Lists the large surfels of each chunk.
    fn list_large(
        &self,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<(), String> {
        let name = "surfels: list large";
        let source = format!("{DISC}\n{FOOTPRINT}\n{LIST}");
        let mut dispatches = Vec::new();
        for chunk in &self.chunks {
            let shader = pipelines.shader(&source, &chunk.defines())?;
            let pipeline = pipelines.compute(name, &shader, "list_large", &self.none)?.pipeline;
            let group = self.bind(recorder.gpu, &pipeline, chunk, &[])?;
            dispatches.push((pipeline, group));
        }
        recorder.compute(name, |pass| {
            for (pipeline, group) in &dispatches {
                // One workgroup for each chunk.
                each_of(pass, pipeline, group, 1);
            }
        });
        Ok(())
    }

    /// Writes what compute found where quads are drawn, and draws the large surfels among it.
    fn merge(
        &self,
        keys: &wgpu::Buffer,
        surface: &Surface,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<(), String> {
        let name = "surfels: large visibility";
        let screen = pipelines.shader(RESOLVE, &[])?;
        let shader = pipelines.shader(SEED, &[])?;
        let seed = pipelines
            .draw(&Draw {
                label: name,
                vertex: (&screen, "cover_screen"),
                fragment: (&shader, "seed"),
                settings: &self.none,
                formats: NEAREST_QUADS.formats,
                kind: DrawKind::SeededSurfels,
            })?
            .pipeline;
        let group = bind(recorder.gpu, &seed, |name| match name {
            "surfelshop::view::view" => Some(self.input.view_uniform.as_entire_binding()),
            "keys" => Some(keys.as_entire_binding()),
            _ => None,
        })?;
        let draws = self.prepare(&Step { name, ..NEAREST_QUADS }, recorder.gpu, pipelines, &[])?;
        let colors = [Attachment::cleared(surface.winners()?)];
        recorder.render(name, &colors, Some((depth_of(surface)?, true)), |pass| {
            set(pass, &seed, &group);
            pass.draw(0..3, 0..1);
            self.draw_large(pass, &draws);
        });
        Ok(())
    }

    /// Adds up surfels whose visibility was computed, large ones in floats, and divides.
    pub(crate) fn blend_computed(
        &self,
        surface: &Surface,
        target: &wgpu::TextureView,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<(), String> {
        let sums = self.sums(recorder.gpu);
        let step = Step { name: "surfels: large accumulate", ..ADDED_QUADS };
        let more = [("nearest", wgpu::BindingResource::TextureView(surface.winners()?))];
        let draws = self.prepare(&step, recorder.gpu, pipelines, &more)?;
        let colors = [Attachment::cleared(&sums[0]), Attachment::cleared(&sums[1])];
        recorder.render(step.name, &colors, Some((depth_of(surface)?, false)), |pass| {
            self.draw_large(pass, &draws);
        });
        self.blend_fixed(surface, target, Some(&sums), recorder, pipelines)
    }

    /// Draws the quads of large surfels; nothing where no surfel of a chunk is.
    fn draw_large(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        draws: &[crate::surfels::quads::ChunkDraw],
    ) {
        for ((pipeline, group, _), chunk) in draws.iter().zip(&self.chunks) {
            if let (Stage::Render(_), Some(computed)) = (&pipeline.stage, &chunk.computed) {
                set(pass, pipeline, group);
                pass.draw_indirect(&computed.large, 0);
            }
        }
    }
}
