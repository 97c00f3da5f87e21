//! Surfels added up in fixed point by compute: where their visibility was computed, and on devices
//! that cannot blend floats.

use crate::gpu::{Atomics, Gpu};
use crate::graph::{Attachment, Pipelines, Recorder};
use crate::surfels::quads::{DISC, Drawing, FOOTPRINT, Lookup, each_of};
use crate::surfels::surface::Surface;
use surfelshop_api::Uniform;
use surfelshop_api::columns::NEUTRAL_ALBEDO;

const ACCUMULATE: &str = include_str!("accumulate_fixed.wgsl");

/// What a weight of 1 is in the sums.
const SCALE: f32 = (1u64 << 36) as f32;

/// Bytes of a sum.
const SUM_BYTES: u64 = 8;

/// Rows of a picture whose sums lie in one buffer.
struct Band {
    first: u32,
    rows: u32,
    /// Sums of each pixel.
    channels: u32,
}

impl Band {
    fn uniform(&self, gpu: &Gpu) -> wgpu::Buffer {
        let bytes = Uniform::new()
            .u32(self.first)
            .u32(self.rows)
            .u32(self.channels)
            .f32(SCALE)
            .vec3(NEUTRAL_ALBEDO.into())
            .into_bytes();
        gpu.filled_buffer("band", &bytes, wgpu::BufferUsages::UNIFORM)
    }
}

impl Drawing<'_> {
    /// Adds up surfels in fixed point and divides. `floats` are sums of those that are large, where
    /// the device can blend them.
    pub(crate) fn blend_fixed(
        &self,
        surface: &Surface,
        target: &wgpu::TextureView,
        floats: Option<&[wgpu::TextureView; 2]>,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<(), String> {
        if floats.is_none() {
            // Rasterised discs and computed ones may differ at the edge: no pixel stays empty.
            self.lookup(Lookup::Surface, surface, target, recorder, pipelines)?;
        }
        // Where no surfel has a colour or an accessibility of its own there is nothing to add up.
        let plain = |chunk: &crate::surfels::chunk::Chunk<'_>| {
            let own = ["COLOR8", "COLOR16", "AO", "LIT", "TINTED_BACKS"];
            !chunk.defines().iter().any(|name| own.contains(name))
        };
        let channels = if self.chunks.iter().all(plain) { 4 } else { 8 };
        let [width, height] = self.input.size;
        let row = SUM_BYTES * u64::from(channels) * u64::from(width);
        let most = recorder.gpu.device.limits().max_storage_buffer_binding_size;
        // A picture whose sums do not fit one binding is made in bands of rows.
        let rows = u32::try_from(most / row).unwrap_or(u32::MAX).clamp(1, height);
        let mut first = 0;
        while first < height {
            let band = Band { first, rows: rows.min(height - first), channels };
            self.blend_band(&band, surface, target, floats, recorder, pipelines)?;
            first += band.rows;
        }
        Ok(())
    }

    fn blend_band(
        &self,
        band: &Band,
        surface: &Surface,
        target: &wgpu::TextureView,
        floats: Option<&[wgpu::TextureView; 2]>,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<(), String> {
        let gpu = recorder.gpu;
        let pixels = u64::from(self.input.size[0]) * u64::from(band.rows);
        let sums = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("fixed sums"),
            size: SUM_BYTES * u64::from(band.channels) * pixels,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        recorder.encoder.clear_buffer(&sums, 0, None);
        let uniform = band.uniform(gpu);
        let name = match self.is_computed() {
            true => "surfels: compute accumulate",
            false => "surfels: accumulate",
        };
        let more = [
            ("sums", sums.as_entire_binding()),
            ("nearest", wgpu::BindingResource::TextureView(surface.winners()?)),
            ("band", uniform.as_entire_binding()),
        ];
        let mut dispatches = Vec::new();
        for chunk in &self.chunks {
            let source = format!("{DISC}\n{FOOTPRINT}\n{ACCUMULATE}");
            let mut defines = chunk.defines();
            defines.extend((gpu.atomics == Atomics::All64).then_some("ATOMIC64_ALL"));
            defines.extend((band.channels == 4).then_some("PLAIN"));
            defines.extend(floats.is_some().then_some("LARGE_ARE_DRAWN"));
            let shader = pipelines.shader(&source, &defines)?;
            let pipeline = pipelines.compute(name, &shader, "accumulate", &self.none)?.pipeline;
            let group = self.bind(gpu, &pipeline, chunk, &more)?;
            dispatches.push((pipeline, group, chunk.drawn(self.input.stride)));
        }
        recorder.compute(name, |pass| {
            for (pipeline, group, surfels) in &dispatches {
                each_of(pass, pipeline, group, *surfels);
            }
        });
        let mut more =
            vec![("fixed_sums", sums.as_entire_binding()), ("band", uniform.as_entire_binding())];
        let mut entry = "resolve_fixed";
        if let Some([normal_weight, albedo_ao]) = floats {
            entry = "resolve_both";
            let of = |view| wgpu::BindingResource::TextureView(view);
            more.push(("sum_normal_weight", of(normal_weight)));
            more.push(("sum_albedo_ao", of(albedo_ao)));
            let n_large = self.n_large.as_ref();
            more.extend(n_large.map(|total| ("total", total.as_entire_binding())));
        }
        let clear = floats.is_some() && band.first == 0;
        let target = Attachment { view: target, clear, slice: None };
        self.resolve(entry, surface, &target, &more, recorder, pipelines)
    }
}
