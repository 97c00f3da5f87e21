//! Columns of clouds as buffers of graphs, in the order in which their surfels are drawn.

use crate::gpu::Gpu;
use crate::graph::{BufferPart, RenderError};
use crate::surfels::columns::order::drawing_order;
use glam::{DVec3, Vec3};
use half::f16;
use rayon::prelude::*;
use std::cell::OnceCell;
use surfelshop_api::columns::{self, CloudView, ColumnView, Values};
use surfelshop_api::graph::{BufferColumn, COLUMNS_HEADER_WORDS, ColumnsOf, Stored};
use surfelshop_api::params::srgb_to_linear;

/// Frames a buffer survives without being read.
const KEPT_FRAMES: u64 = 64;

/// What a buffer is made of.
#[derive(Clone, Debug, PartialEq)]
struct Contents {
    of: ColumnsOf,
    /// Of each cloud its origin, and generations of what its order follows from and of what is given.
    clouds: Vec<([u64; 3], Vec<u64>)>,
    scene_origin: [u64; 3],
    part_len: u32,
}

struct CachedBuffer {
    made: Contents,
    parts: Vec<BufferPart>,
    bytes: u64,
    last_used: u64,
}

/// Buffers of columns, by what they are made of.
#[derive(Default)]
pub(crate) struct ColumnBuffers {
    kept: Vec<CachedBuffer>,
    frame: u64,
    /// Buffers made since the engine was made.
    pub(crate) made: u32,
}

/// Clouds of a frame, whose orders are found at most once.
pub(crate) struct Ordered<'a> {
    clouds: &'a [CloudView<'a>],
    orders: Vec<OnceCell<Vec<u32>>>,
}

impl<'a> Ordered<'a> {
    pub(crate) fn new(clouds: &'a [CloudView<'a>]) -> Self {
        Self { clouds, orders: clouds.iter().map(|_| OnceCell::new()).collect() }
    }

    fn order(&self, cloud: usize) -> &[u32] {
        self.orders[cloud].get_or_init(|| drawing_order(&self.clouds[cloud]))
    }
}

impl ColumnBuffers {
    /// Drops what has not been read for a while; called once a frame.
    pub(crate) fn next_frame(&mut self) {
        self.frame += 1;
        let oldest = self.frame.saturating_sub(KEPT_FRAMES);
        self.kept.retain(|kept| kept.last_used >= oldest);
    }

    /// Bytes of the buffers on the device.
    pub(crate) fn bytes(&self) -> u64 {
        self.kept.iter().map(|kept| kept.bytes).sum()
    }

    /// The parts of a buffer, of `part_len` surfels each but for the last.
    ///
    /// # Errors
    /// Where a cloud's column is not of numbers that can be given.
    pub(crate) fn buffer(
        &mut self,
        gpu: &Gpu,
        ordered: &Ordered<'_>,
        of: &ColumnsOf,
        part_len: u32,
    ) -> Result<Vec<BufferPart>, RenderError> {
        let scene = ordered.clouds.first().map_or(DVec3::ZERO, |cloud| cloud.origin);
        let bits = |origin: DVec3| origin.to_array().map(f64::to_bits);
        let chosen: Vec<usize> = of.objects.iter().map(|object| *object as usize).collect();
        let clouds = chosen.iter().filter_map(|i| ordered.clouds.get(*i)).map(|cloud| {
            let generations = cloud.columns.iter().map(|column| column.generation).collect();
            (bits(cloud.origin), generations)
        });
        let made = Contents {
            of: of.clone(),
            clouds: clouds.collect(),
            scene_origin: bits(scene),
            part_len,
        };
        if let Some(known) = self.kept.iter_mut().find(|kept| kept.made == made) {
            known.last_used = self.frame;
            return Ok(known.parts.clone());
        }
        let words = words(ordered, &chosen, scene, of);
        let stride = of.stride_words() as usize;
        let n_surfels = words.len() / stride.max(1);
        let part_len = part_len.max(1) as usize;
        let mut parts = Vec::new();
        // One that is empty is there, too: it is bound.
        for first in (0..n_surfels.max(1)).step_by(part_len) {
            let end = (first + part_len).min(n_surfels);
            let mut part = vec![0u32; COLUMNS_HEADER_WORDS as usize];
            part[0] = first as u32;
            part.extend_from_slice(&words[first * stride..end * stride]);
            // A binding is at least as long as one word behind the header.
            part.resize(part.len().max(COLUMNS_HEADER_WORDS as usize + stride.max(1)), 0);
            let label = "columns of surfels";
            let bytes = bytemuck::cast_slice(&part);
            let buffer = gpu.filled_buffer(label, bytes, wgpu::BufferUsages::STORAGE);
            parts.push(BufferPart { first: first as u32, n: (end - first) as u32, buffer });
        }
        self.made += 1;
        let bytes = parts.iter().map(|part| part.buffer.size()).sum();
        let last_used = self.frame;
        self.kept.push(CachedBuffer { made, parts: parts.clone(), bytes, last_used });
        Ok(parts)
    }
}

/// The words of all surfels.
fn words(ordered: &Ordered<'_>, chosen: &[usize], scene: DVec3, of: &ColumnsOf) -> Vec<u32> {
    let stride = of.stride_words() as usize;
    let mut words = Vec::new();
    for &i in chosen {
        let Some(cloud) = ordered.clouds.get(i) else { continue };
        let offset = (cloud.origin - scene).as_vec3();
        let read: Vec<Read<'_>> =
            of.columns.iter().map(|column| Read::new(cloud, column, offset)).collect();
        let before = words.len();
        words.resize(before + cloud.len * stride, 0u32);
        words[before..].par_chunks_exact_mut(stride.max(1)).zip(ordered.order(i)).for_each(
            |(record, &surfel)| {
                let mut first = 0;
                for read in &read {
                    let n = read.given.words() as usize;
                    read.write(surfel as usize, &mut record[first..first + n]);
                    first += n;
                }
            },
        );
    }
    words
}

/// A column that is given.
struct Read<'a> {
    given: &'a BufferColumn,
    column: Option<ColumnView<'a>>,
    /// Added to positions.
    offset: Vec3,
}

impl<'a> Read<'a> {
    fn new(cloud: &CloudView<'a>, given: &'a BufferColumn, offset: Vec3) -> Self {
        let offset = if given.name == columns::POSITION { offset } else { Vec3::ZERO };
        Self { given, column: cloud.column(&given.name).copied(), offset }
    }

    /// A value of a surfel.
    #[inline]
    fn value(&self, surfel: usize, component: usize) -> f32 {
        let otherwise = self.given.otherwise;
        let Some(column) = &self.column else { return otherwise };
        if component >= column.components as usize {
            return otherwise;
        }
        let at = surfel * column.components as usize + component;
        // Colours are encoded, their opacity is not.
        let of_code = |code: f32| match (self.given.name.as_str(), component) {
            (columns::COLOR, 0..3) => srgb_to_linear(code),
            _ => code,
        };
        let is_color = self.given.name == columns::COLOR;
        let value = match column.values {
            Values::F32(values) => values.get(at).copied(),
            Values::F64(values) => values.get(at).map(|&value| value as f32),
            Values::U8(values) if is_color => {
                values.get(at).map(|&c| of_code(f32::from(c) / 255.0))
            }
            Values::U16(values) if is_color => {
                values.get(at).map(|&c| of_code(f32::from(c) / 65535.0))
            }
            Values::U8(values) => values.get(at).map(|&value| f32::from(value)),
            Values::I8(values) => values.get(at).map(|&value| f32::from(value)),
            Values::U16(values) => values.get(at).map(|&value| f32::from(value)),
            Values::I16(values) => values.get(at).map(|&value| f32::from(value)),
            Values::U32(values) => values.get(at).map(|&value| value as f32),
            Values::I32(values) => values.get(at).map(|&value| value as f32),
        };
        let shift = if component < 3 { self.offset[component] } else { 0.0 };
        value.map_or(otherwise, |value| value + shift)
    }

    fn write(&self, surfel: usize, words: &mut [u32]) {
        let n = self.given.components as usize;
        let value = |component: usize| match component < n {
            true => self.value(surfel, component),
            false => 0.0,
        };
        match self.given.stored {
            Stored::F32 => {
                words.iter_mut().enumerate().for_each(|(i, word)| *word = value(i).to_bits());
            }
            Stored::F16 => {
                for (i, word) in words.iter_mut().enumerate() {
                    // Beyond its range are no infinities, whose differences would be no numbers.
                    let most = f16::MAX.to_f32();
                    let within = |i: usize| value(i).clamp(-most, most);
                    let half = |i: usize| u32::from(f16::from_f32(within(i)).to_bits());
                    *word = half(2 * i) | half(2 * i + 1) << 16;
                }
            }
            Stored::Unorm8 => {
                for (i, word) in words.iter_mut().enumerate() {
                    let code = |k: usize| (value(4 * i + k).clamp(0.0, 1.0) * 255.0).round() as u32;
                    *word = code(0) | code(1) << 8 | code(2) << 16 | code(3) << 24;
                }
            }
        }
    }
}
