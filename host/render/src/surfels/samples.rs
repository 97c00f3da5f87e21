//! The scene's surfels as data for passes that go through them, all or evenly spread ones.

use crate::gpu::Gpu;
use crate::graph::RenderError;
use crate::surfels::columns::elements::floats_of;
use crate::surfels::columns::order::drawing_order;
use glam::{DVec3, Vec3};
use half::f16;
use rayon::prelude::*;
use surfelshop_api::Graph;
use surfelshop_api::columns::{self, CloudView};

/// Frames a buffer survives without being read.
const KEPT_FRAMES: u64 = 64;

/// Bytes of a record: `Record` of `shaders/surface/surfels.wgsl`.
const RECORD_BYTES: usize = 32;
/// The same, as sizes of buffers are counted.
pub(crate) const SURFEL_BYTES: u64 = RECORD_BYTES as u64;

/// The largest albedo that is stored, as in `shaders/surface/packing.wgsl`.
const MAX_ALBEDO: f32 = 65504.0;

/// What a buffer is made of.
#[derive(Clone, Debug, PartialEq)]
struct SampleBuffer {
    /// Of each cloud its origin, and generations of the columns.
    of: Vec<([u64; 3], Vec<u64>)>,
    at_most: u32,
    radius_scale: u32,
}

struct CachedSamples {
    made: SampleBuffer,
    buffer: wgpu::Buffer,
    last_used: u64,
}

/// Buffers of surfels, by what they are made of.
#[derive(Default)]
pub(crate) struct Samples {
    kept: Vec<CachedSamples>,
    frame: u64,
    /// Buffers made since the engine was made.
    pub(crate) made: u32,
}

impl Samples {
    /// Drops what has not been read for a while; called once a frame.
    pub(crate) fn next_frame(&mut self) {
        self.frame += 1;
        let oldest = self.frame.saturating_sub(KEPT_FRAMES);
        self.kept.retain(|kept| kept.last_used >= oldest);
    }

    /// A buffer with surfels of these clouds, `at_most` so many.
    ///
    /// # Errors
    /// Where a column that drawing needs is missing or of another type.
    pub(crate) fn buffer(
        &mut self,
        gpu: &Gpu,
        clouds: &[CloudView<'_>],
        radius_scale: f32,
        at_most: u32,
    ) -> Result<wgpu::Buffer, RenderError> {
        let of = clouds.iter().map(|cloud| {
            let generations = cloud.columns.iter().map(|column| column.generation).collect();
            (cloud.origin.to_array().map(f64::to_bits), generations)
        });
        let made = SampleBuffer { of: of.collect(), at_most, radius_scale: radius_scale.to_bits() };
        if let Some(known) = self.kept.iter_mut().find(|kept| kept.made == made) {
            known.last_used = self.frame;
            return Ok(known.buffer.clone());
        }
        let bytes = records(clouds, radius_scale, at_most)?;
        let buffer = gpu.filled_buffer("surfels", &bytes, wgpu::BufferUsages::STORAGE);
        self.made += 1;
        self.kept.push(CachedSamples { made, buffer: buffer.clone(), last_used: self.frame });
        Ok(buffer)
    }
}

/// The bytes of all records; one of radius 0 where there is no surfel.
fn records(
    clouds: &[CloudView<'_>],
    radius_scale: f32,
    at_most: u32,
) -> Result<Vec<u8>, RenderError> {
    let n_surfels = clouds.iter().map(|cloud| cloud.len as u64).sum();
    let step = usize::try_from(Graph::surfels_per_given(n_surfels, at_most)).unwrap_or(usize::MAX);
    let scene = clouds.first().map_or(DVec3::ZERO, |cloud| cloud.origin);
    let mut bytes = Vec::new();
    // Surfels of the scene before this cloud.
    let mut before = 0usize;
    // One that is left out has no columns either.
    let filled = clouds.iter().enumerate().filter(|(_, cloud)| cloud.len > 0);
    for (object, cloud) in filled {
        let order = drawing_order(cloud);
        let first = before.next_multiple_of(step) - before;
        let chosen: Vec<u32> = order.into_iter().skip(first).step_by(step).collect();
        let record = Recorded::new(cloud, object, (cloud.origin - scene).as_vec3(), radius_scale)?;
        let of_cloud: Vec<_> = chosen.par_iter().map(|&i| record.bytes(i as usize)).collect();
        bytes.extend_from_slice(of_cloud.as_flattened());
        before += cloud.len;
    }
    if bytes.is_empty() {
        bytes.resize(RECORD_BYTES, 0);
    }
    Ok(bytes)
}

/// How large surfels of a cloud are.
enum Shape<'a> {
    Radii(&'a [f32]),
    Ellipses([&'a [f32]; 2]),
}

/// A cloud whose surfels are being recorded.
struct Recorded<'a> {
    positions: &'a [f32],
    normals: &'a [f32],
    shape: Shape<'a>,
    albedos: Vec<Vec3>,
    object: u32,
    offset: Vec3,
    radius_scale: f32,
}

fn vector(values: &[f32], i: usize) -> Vec3 {
    values.get(3 * i..3 * i + 3).map_or(Vec3::ZERO, Vec3::from_slice)
}

impl<'a> Recorded<'a> {
    fn new(
        cloud: &CloudView<'a>,
        object: usize,
        offset: Vec3,
        radius_scale: f32,
    ) -> Result<Self, RenderError> {
        let [u, v] = [columns::TANGENT_U, columns::TANGENT_V].map(|name| cloud.floats(name, 3));
        let shape = match (u, v) {
            (Some(u), Some(v)) => Shape::Ellipses([u, v]),
            _ => Shape::Radii(floats_of(cloud, columns::RADIUS)?),
        };
        Ok(Self {
            positions: floats_of(cloud, columns::POSITION)?,
            normals: floats_of(cloud, columns::NORMAL)?,
            shape,
            albedos: cloud.albedos(),
            object: u32::try_from(object).unwrap_or(u32::MAX),
            offset,
            radius_scale,
        })
    }

    fn bytes(&self, i: usize) -> [u8; RECORD_BYTES] {
        let position = self.offset + vector(self.positions, i);
        let radius = self.radius_scale
            * match &self.shape {
                Shape::Radii(radii) => radii.get(i).copied().unwrap_or(0.0),
                Shape::Ellipses([u, v]) => vector(u, i).cross(vector(v, i)).length().sqrt(),
            };
        let normal = vector(self.normals, i).normalize_or(Vec3::Y);
        let albedo = self.albedos.get(i).copied().unwrap_or_default();
        let half = |c: f32| u32::from(f16::from_f32(c.min(MAX_ALBEDO)).to_bits());
        let [red, green, blue] = albedo.to_array().map(half);
        let words = [
            position.x.to_bits(),
            position.y.to_bits(),
            position.z.to_bits(),
            radius.to_bits(),
            pack_direction(normal),
            red | green << 16,
            blue,
            self.object,
        ];
        let mut bytes = [0; RECORD_BYTES];
        for (place, word) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(words) {
            *place = word.to_le_bytes();
        }
        bytes
    }
}

/// Twin of `pack_direction` of `shaders/surface/packing.wgsl`.
fn pack_direction(n: Vec3) -> u32 {
    let p = n.truncate() / n.abs().element_sum();
    let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
    let [x, y] = match n.z >= 0.0 {
        true => [p.x, p.y],
        false => [(1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y)],
    };
    let snorm = |value: f32| {
        // Rounded half up, as WGSL says.
        u32::from(((value.clamp(-1.0, 1.0) * 32767.0 + 0.5).floor() as i16).cast_unsigned())
    };
    snorm(x) | snorm(y) << 16
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::columns::{ColumnView, Values};

    fn cloud<'a>(
        positions: &'a [f32],
        normals: &'a [f32],
        radii: &'a [f32],
        origin: DVec3,
    ) -> CloudView<'a> {
        let column = |name, components, values| ColumnView {
            name,
            components,
            generation: 7,
            values: Values::F32(values),
        };
        let columns = vec![
            column(columns::POSITION, 3, positions),
            column(columns::NORMAL, 3, normals),
            column(columns::RADIUS, 1, radii),
        ];
        CloudView { len: radii.len(), columns, origin, ..CloudView::default() }
    }

    fn positions_of(bytes: &[u8]) -> Vec<[f32; 4]> {
        let float = |bytes: &[u8; 4]| f32::from_le_bytes(*bytes);
        let records = bytes.as_chunks::<RECORD_BYTES>().0.iter();
        records
            .map(|record| {
                let words = record.as_chunks::<4>().0;
                [0, 1, 2, 3].map(|i| float(&words[i]))
            })
            .collect()
    }

    #[test]
    fn every_step_th_surfel_of_the_scene_is_given() {
        let (positions, normals): (Vec<f32>, Vec<f32>) = (0..5)
            .map(|i| ([i as f32, 0.0, 0.0], [0.0, 0.0, 1.0]))
            .fold((Vec::new(), Vec::new()), |(mut p, mut n), (position, normal)| {
                p.extend(position);
                n.extend(normal);
                (p, n)
            });
        let radii = [0.5; 5];
        let first = cloud(&positions, &normals, &radii, DVec3::ZERO);
        let second = cloud(&positions, &normals, &radii, DVec3::new(100.0, 0.0, 0.0));
        let clouds = [first, second];
        let all = positions_of(&records(&clouds, 2.0, 10).unwrap());
        let xs = |found: &[[f32; 4]]| found.iter().map(|r| r[0]).collect::<Vec<_>>();
        assert_eq!(xs(&all), [0.0, 1.0, 2.0, 3.0, 4.0, 100.0, 101.0, 102.0, 103.0, 104.0]);
        assert!(all.iter().all(|record| record[3] == 1.0));
        // Three at most are one of every four.
        let few = positions_of(&records(&clouds, 2.0, 3).unwrap());
        assert_eq!(xs(&few), [0.0, 4.0, 103.0]);
        assert_eq!(Graph::surfels_given(10, 3), 3);
        assert_eq!(positions_of(&records(&[], 1.0, 3).unwrap()), [[0.0; 4]]);
    }

    #[test]
    fn directions_survive_packing() {
        for n in [Vec3::X, -Vec3::Z, Vec3::new(0.6, -0.64, -0.48), Vec3::new(-0.36, 0.48, 0.8)] {
            let bits = pack_direction(n);
            let half = |bits: u32| f32::from((bits as u16).cast_signed()) / 32767.0;
            let (x, y) = (half(bits & 0xffff), half(bits >> 16));
            let mut found = Vec3::new(x, y, 1.0 - x.abs() - y.abs());
            let t = (-found.z).max(0.0);
            found.x += if found.x >= 0.0 { -t } else { t };
            found.y += if found.y >= 0.0 { -t } else { t };
            // 2^-14 rad, as the shader says.
            assert!((found.normalize_or(Vec3::ZERO) - n).length() < 1.2e-4, "{n} {found}");
        }
    }
}
