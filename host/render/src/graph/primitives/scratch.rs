//! Memory for passes of splats, sorts and sums that is used again from frame to frame.

use crate::gpu::Gpu;
use surfelshop_raster::composition::Composer;

/// Frames that a buffer survives without being used.
const KEPT_FRAMES: u64 = 64;

/// A buffer that waits for its next use.
struct Waiting {
    buffer: wgpu::Buffer,
    last_used: u64,
}

/// What passes of splats, sorts and sums need besides resources of graphs.
#[derive(Default)]
pub(crate) struct PassScratch {
    pub(in crate::graph) composer: Composer,
    waiting: Vec<Waiting>,
    frame: u64,
}

impl PassScratch {
    /// Drops what has not been used for a while; called once a frame.
    pub(crate) fn next_frame(&mut self) {
        self.frame += 1;
        let oldest = self.frame.saturating_sub(KEPT_FRAMES);
        self.waiting.retain(|waiting| waiting.last_used >= oldest);
    }

    /// Bytes of the buffers that are kept.
    pub(crate) fn bytes(&self) -> u64 {
        self.waiting.iter().map(|waiting| waiting.buffer.size()).sum()
    }

    /// A buffer of so many bytes, with anything in it.
    pub(in crate::graph) fn take(
        &mut self,
        gpu: &Gpu,
        label: &str,
        bytes: u64,
        usage: wgpu::BufferUsages,
    ) -> wgpu::Buffer {
        let size = bytes.max(16).next_multiple_of(4);
        let fits = |w: &Waiting| w.buffer.size() == size && w.buffer.usage() == usage;
        if let Some(at) = self.waiting.iter().position(fits) {
            return self.waiting.swap_remove(at).buffer;
        }
        gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: false,
        })
    }

    /// Takes a buffer back that the device is done with, or that is used in its order.
    pub(in crate::graph) fn give(&mut self, buffer: wgpu::Buffer) {
        self.waiting.push(Waiting { buffer, last_used: self.frame });
    }
}
