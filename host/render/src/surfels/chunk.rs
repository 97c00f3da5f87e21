//! A chunk of a cloud on its way through the passes that draw it.

use crate::gpu::Gpu;
use crate::surfels::render_cloud::DrawnCloud;
use std::ops::Range;

/// What compute has found of a chunk's surfels.
pub(crate) struct Computed {
    /// Where each of them is, and whether it is small.
    pub(crate) boxes: wgpu::Buffer,
    /// How many are large among each 64.
    pub(crate) blocks: wgpu::Buffer,
    /// The large ones, and the arguments of their indirect draw.
    pub(crate) list: wgpu::Buffer,
    pub(crate) large: wgpu::Buffer,
}

/// Invocations of a run, as in disc.wgsl.
const RUN: u32 = 256;

/// Places of a chunk that are drawn, in runs.
pub(crate) struct Runs {
    pub(crate) places: wgpu::Buffer,
    n: u32,
}

impl Runs {
    /// What a chunk of places has of those that are drawn, counted from its first.
    pub(crate) fn new(all: &[Range<u32>], chunk: Range<u32>, gpu: &Gpu) -> Self {
        let before = all.partition_point(|run| run.end <= chunk.start);
        let here = all[before..].iter().take_while(|run| run.start < chunk.end);
        let mut runs: Vec<[u32; 2]> = Vec::new();
        for run in here {
            let (start, end) = (run.start.max(chunk.start), run.end.min(chunk.end));
            let firsts = (start..end).step_by(RUN as usize);
            runs.extend(firsts.map(|at| [at, end.min(at + RUN)].map(|at| at - chunk.start)));
        }
        if runs.is_empty() {
            // A binding has at least an element.
            runs.push([0, 0]);
        }
        let bytes: &[u8] = bytemuck::cast_slice(&runs);
        let places = gpu.filled_buffer("drawn places", bytes, wgpu::BufferUsages::STORAGE);
        Self { places, n: runs.len() as u32 }
    }
}

/// A chunk with its uniform.
pub(crate) struct Chunk<'a> {
    pub(crate) cloud: &'a DrawnCloud<'a>,
    /// Which of the cloud's.
    pub(crate) position: usize,
    /// Places in it.
    pub(crate) count: u32,
    pub(crate) uniform: wgpu::Buffer,
    /// What its surfels radiate, where they were shaded one by one.
    pub(crate) lit: Option<wgpu::Buffer>,
    /// Whether its surfels are cut.
    pub(crate) clipped: bool,
    /// Whether those that are seen from behind have a colour of their own.
    pub(crate) tints_backs: bool,
    /// Whether its surfels' normals are drawn as fields, where they have some.
    pub(crate) fields: bool,
    /// The places that are drawn, where they were chosen.
    pub(crate) runs: Option<Runs>,
    /// Where compute has drawn its small surfels: quads are then drawn of the large ones alone.
    pub(crate) computed: Option<Computed>,
}

impl Chunk<'_> {
    pub(crate) fn defines(&self) -> Vec<&'static str> {
        let mut defines = self.cloud.defines.clone();
        defines.extend(self.lit.is_some().then_some("LIT"));
        defines.extend(self.computed.is_some().then_some("COMPUTED"));
        defines.extend(self.runs.is_some().then_some("RUNS"));
        defines.extend(self.tints_backs.then_some("TINTED_BACKS"));
        let fields = self.fields && self.cloud.has_fields();
        defines.extend(self.clipped.then_some("CLIP"));
        defines.extend(fields.then_some("FIELD"));
        defines.extend((self.clipped || fields).then_some("LOCAL"));
        defines
    }

    /// Number of surfels that are drawn, runs filled up.
    pub(crate) fn drawn(&self, stride: u32) -> u32 {
        match &self.runs {
            Some(runs) => runs.n * RUN,
            None => self.count.div_ceil(stride),
        }
    }
}
