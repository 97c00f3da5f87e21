//! Buffers through which pictures cross to and from the device, used again from frame to frame: a new one is memory
//! that the system clears page by page while it is written first, which takes longer than the copy itself.

use crate::gpu::Gpu;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::mpsc;
use surfelshop_raster::Rectangle;

/// Most buffers that wait for a frame to come: what goes up and what comes down, of two sizes of picture.
const MAX_FREE: usize = 8;

/// Buffers that no frame uses, those used last at the end.
#[derive(Default)]
pub(crate) struct TransferBuffers {
    free: Mutex<Vec<wgpu::Buffer>>,
}

impl TransferBuffers {
    /// A buffer of so many bytes, with what it held before. On a device that is lost or out of memory it is not one,
    /// which using it reports.
    pub(crate) fn take(&self, gpu: &Gpu, n_bytes: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let fits = |free: &wgpu::Buffer| free.size() == n_bytes && free.usage() == usage;
        let free = self.free.lock().ok().and_then(|mut free| {
            let at = free.iter().rposition(fits)?;
            Some(free.remove(at))
        });
        free.unwrap_or_else(|| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("transfer"),
                size: n_bytes,
                usage,
                mapped_at_creation: false,
            })
        })
    }

    /// Keeps buffers for later frames: ones that nothing maps, and that no command reads which is not submitted yet.
    pub(crate) fn keep(&self, buffers: impl IntoIterator<Item = wgpu::Buffer>) {
        if let Ok(mut free) = self.free.lock() {
            free.extend(buffers);
            let excess = free.len().saturating_sub(MAX_FREE);
            free.drain(..excess);
        }
    }

    /// Lets go of all buffers.
    pub(crate) fn clear(&self) {
        if let Ok(mut free) = self.free.lock() {
            free.clear();
        }
    }

    /// Bytes of the buffers that wait.
    pub(crate) fn bytes(&self) -> u64 {
        self.free.lock().map_or(0, |free| free.iter().map(wgpu::Buffer::size).sum())
    }
}

/// Records the copy of parts of a picture without gaps, so many bytes a pixel, into the first level of a texture.
/// Returns the buffer that holds them until the commands are submitted; `None` where there is nothing to copy, and
/// where the device did not take it, as when it is lost.
pub(crate) fn upload(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    texture: &wgpu::Texture,
    bytes: &[u8],
    texel: u32,
    parts: &[Rectangle],
) -> Option<wgpu::Buffer> {
    let rows = rows_of(parts);
    if rows.is_empty() {
        return None;
    }
    let row = texture.width() * texel;
    let row_bytes = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let usage = wgpu::BufferUsages::MAP_WRITE | wgpu::BufferUsages::COPY_SRC;
    // As much for each part as for the whole, so that it is used again whatever the parts are.
    let n_bytes = u64::from(row_bytes) * u64::from(texture.height());
    let buffer = gpu.transfers.take(gpu, n_bytes, usage);
    // What was never written is cleared before it is mapped, so that nothing else is.
    let first = rows.start * row_bytes as usize;
    let slice = buffer.slice(first as u64..rows.end as u64 * u64::from(row_bytes));
    let (send, receive) = mpsc::channel();
    slice.map_async(wgpu::MapMode::Write, move |result| {
        // The receiver is gone only where waiting failed already.
        drop(send.send(result));
    });
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).ok()?;
    receive.recv().ok()?.ok()?;
    let mut mapped = slice.get_mapped_range_mut().ok()?;
    for &part in parts {
        let [x, y, width, height] = part.map(|at| at as usize);
        let (left, across) = (x * texel as usize, width * texel as usize);
        for at in y..y + height {
            let from = at * row as usize + left;
            let to = at * row_bytes as usize + left - first;
            mapped.slice(to..to + across).copy_from_slice(bytes.get(from..from + across)?);
        }
    }
    drop(mapped);
    buffer.unmap();
    for &part in parts {
        let from = wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: part_layout(part, texel, row_bytes),
        };
        let [x, y, width, height] = part;
        let to = wgpu::TexelCopyTextureInfo {
            origin: wgpu::Origin3d { x, y, z: 0 },
            ..texture.as_image_copy()
        };
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        encoder.copy_buffer_to_texture(from, to, size);
    }
    Some(buffer)
}

/// The rows from the first that parts have to the last.
pub(crate) fn rows_of(parts: &[Rectangle]) -> Range<usize> {
    let first = parts.iter().map(|[_, y, ..]| *y).min().unwrap_or(0);
    let end = parts.iter().map(|[_, y, _, height]| y + height).max().unwrap_or(0);
    first as usize..end as usize
}

/// Where a part of a picture lies in a buffer with room for all of it.
pub(crate) fn part_layout(
    [x, y, ..]: Rectangle,
    texel: u32,
    row_bytes: u32,
) -> wgpu::TexelCopyBufferLayout {
    wgpu::TexelCopyBufferLayout {
        offset: u64::from(y) * u64::from(row_bytes) + u64::from(x) * u64::from(texel),
        bytes_per_row: Some(row_bytes),
        rows_per_image: None,
    }
}
