//! Brings textures back from the device as floats.

use crate::gpu::Gpu;
use crate::transfer::{part_layout, rows_of};
use half::f16;
use half::slice::{HalfBitsSliceExt as _, HalfFloatSliceExt as _};
use surfelshop_image::Image;
use surfelshop_raster::{Coverage, Rectangle};

/// Half-precision floats as floats.
fn halves(bytes: &[u8], values: &mut [f32]) {
    // A row of a texture begins where halves may.
    if let Ok(halves) = bytemuck::try_cast_slice::<u8, u16>(&bytes[..2 * values.len()]) {
        return halves.reinterpret_cast::<f16>().convert_to_f32_slice(values);
    }
    for (value, pair) in values.iter_mut().zip(bytes.chunks_exact(2)) {
        *value = f16::from_le_bytes([pair[0], pair[1]]).to_f32();
    }
}

/// Words of 32 bits as floats.
fn words(bytes: &[u8], values: &mut [f32], of: impl Fn(u32) -> f32) {
    for (value, word) in values.iter_mut().zip(bytes.chunks_exact(4)) {
        *value = of(u32::from_le_bytes([word[0], word[1], word[2], word[3]]));
    }
}

/// A copy of a texture on its way to memory.
pub(crate) struct Pending {
    buffer: wgpu::Buffer,
    width: u32,
    height: u32,
    row_bytes: u32,
    format: wgpu::TextureFormat,
    /// What of it is read; the rest is zeros.
    parts: Vec<Rectangle>,
}

/// Rectangles, one above the other, in which a picture is read back that is known to be zeros elsewhere.
const STRIPS: usize = 16;

/// Records the copy of a texture's first level, which holds nothing but zeros outside of what is `covered`.
pub(crate) fn copy(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    texture: &wgpu::Texture,
    covered: Option<&Coverage>,
) -> Pending {
    let (width, height, format) = (texture.width(), texture.height(), texture.format());
    let texel = format.block_copy_size(None).unwrap_or(16);
    let row_bytes = (width * texel).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let n_bytes = u64::from(row_bytes) * u64::from(height);
    let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
    let buffer = gpu.transfers.take(gpu, n_bytes, usage);
    let parts = match covered {
        Some(covered) => covered.strips(covered, STRIPS),
        None => vec![[0, 0, width, height]],
    };
    for &part in &parts {
        let [x, y, width, height] = part;
        encoder.copy_texture_to_buffer(
            wgpu::TexelCopyTextureInfo {
                origin: wgpu::Origin3d { x, y, z: 0 },
                ..texture.as_image_copy()
            },
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: part_layout(part, texel, row_bytes),
            },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
    }
    Pending { buffer, width, height, row_bytes, format, parts }
}

/// Records the copy of a buffer to one that can be read.
pub(crate) fn copy_buffer(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    buffer: &wgpu::Buffer,
) -> wgpu::Buffer {
    let read = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("readback"),
        size: buffer.size(),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    encoder.copy_buffer_to_buffer(buffer, 0, &read, 0, buffer.size());
    read
}

/// Waits for the device and returns a buffer's bytes.
///
/// # Errors
/// One line where the device is lost.
pub(crate) fn map(gpu: &Gpu, buffer: &wgpu::Buffer) -> Result<Vec<u8>, String> {
    let bytes = with_mapped(gpu, &[buffer.slice(..)], |bytes| bytes[0].to_vec())?;
    Ok(bytes)
}

/// Waits for the device and looks at the bytes of parts of buffers where they lie.
///
/// # Errors
/// One line where the device is lost.
pub(crate) fn with_mapped<T>(
    gpu: &Gpu,
    slices: &[wgpu::BufferSlice<'_>],
    look: impl FnOnce(&[&[u8]]) -> T,
) -> Result<T, String> {
    let (send, receive) = std::sync::mpsc::channel();
    for slice in slices {
        let send = send.clone();
        slice.map_async(wgpu::MapMode::Read, move |result| {
            // The receiver is gone only where waiting failed already.
            drop(send.send(result));
        });
    }
    gpu.device
        .poll(wgpu::PollType::wait_indefinitely())
        .map_err(|error| format!("the graphics device did not answer: {error}"))?;
    for _ in slices {
        match receive.recv() {
            Ok(Ok(())) => {}
            _ => return Err("the graphics device was lost while reading back".to_owned()),
        }
    }
    let views = slices.iter().map(|slice| {
        let view = slice.get_mapped_range();
        view.map_err(|error| format!("the graphics device gave no data: {error}"))
    });
    let views = views.collect::<Result<Vec<_>, _>>()?;
    let bytes: Vec<&[u8]> = views.iter().map(|view| &**view).collect();
    let seen = look(&bytes);
    drop(views);
    slices.iter().for_each(|slice| slice.buffer().unmap());
    Ok(seen)
}

impl Pending {
    /// Waits and converts to floats; unsigned integers become floats of equal value.
    ///
    /// # Errors
    /// One line where the device is lost.
    pub(crate) fn finish(self, gpu: &Gpu) -> Result<Image, String> {
        let rows = rows_of(&self.parts);
        let at = |row: usize| row as u64 * u64::from(self.row_bytes);
        // What was never written is cleared before it is mapped, so that nothing else is.
        let slice = (!rows.is_empty()).then(|| self.buffer.slice(at(rows.start)..at(rows.end)));
        let floats = |bytes: &[&[u8]]| self.floats(rows.start, bytes.first().unwrap_or(&&[][..]));
        let image = with_mapped(gpu, slice.as_slice(), floats)?;
        gpu.transfers.keep([self.buffer]);
        Ok(image)
    }

    /// From the bytes of rows, of which the first has this number; others are zeros.
    fn floats(&self, first: usize, bytes: &[u8]) -> Image {
        let components = u32::from(self.format.components());
        let values = self.width as usize * components as usize;
        let mut data = vec![0.0f32; values * self.height as usize];
        let texel = self.format.block_copy_size(None).unwrap_or(16) as usize;
        let rows = bytes.chunks_exact(self.row_bytes as usize);
        let made = data.chunks_exact_mut(values.max(1)).skip(first);
        let mut rows: Vec<_> = rows.zip(made).collect();
        for &part in &self.parts {
            let [x, y, width, height] = part.map(|at| at as usize);
            let y = y - first;
            let here = rows.get_mut(y..y + height).unwrap_or_default();
            let across = |each: usize| x * each..(x + width) * each;
            for (row, data) in here {
                self.row(&row[across(texel)], &mut data[across(components as usize)]);
            }
        }
        Image { width: self.width, height: self.height, components, data }
    }

    /// The pixels of a row.
    fn row(&self, row: &[u8], data: &mut [f32]) {
        use wgpu::TextureFormat as F;
        match self.format {
            F::Rgba8Unorm => {
                for (value, byte) in data.iter_mut().zip(row) {
                    *value = f32::from(*byte) / 255.0;
                }
            }
            // Many at once, with the CPU's own conversion.
            F::Rgba16Float => halves(row, data),
            F::R32Uint | F::Rgba32Uint => words(row, data, |word| word as f32),
            _ => words(row, data, f32::from_bits),
        }
    }
}
