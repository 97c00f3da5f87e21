//! The light around the scene, on the device: an octahedral map with mip levels, uploaded once.

use crate::gpu::Gpu;
use crate::graph::RenderError;
use crate::resource_use::ResourceUse;
use glam::Vec4;
use half::f16;
use rayon::prelude::*;
use surfelshop_api::{EnvironmentView, Uniform};

/// Maps kept for scenes that are not drawn now.
const KEPT: usize = 3;

/// Side of the smallest mip level: below it an octahedral map is no picture any more.
const SMALLEST_SIDE: usize = 4;

/// The value that the brightest light is stored as, half of what half precision holds: sums of a few
/// stay finite, and the dimmest light keeps most of its digits.
const BRIGHTEST: f32 = 32_768.0;

/// A map on the device.
struct Map {
    view: wgpu::TextureView,
    /// Radiance of a stored 1.
    unit: f32,
    n_levels: usize,
}

/// The environment of a frame, ready to be bound.
pub(crate) struct Bound {
    pub(crate) uniform: wgpu::Buffer,
    pub(crate) map: wgpu::TextureView,
    pub(crate) sampler: wgpu::Sampler,
}

/// Maps by the keys of their environments.
#[derive(Default)]
pub(crate) struct Environments {
    kept: Vec<(String, Map)>,
    /// How many were uploaded.
    pub(crate) uploads: u32,
}

impl Environments {
    /// Bytes of the maps on the device.
    pub(crate) fn bytes(&self) -> u64 {
        self.textures().iter().map(|texture| texture.bytes).sum()
    }

    /// The maps on the device.
    pub(crate) fn textures(&self) -> Vec<ResourceUse> {
        let why = "light around a scene, kept for passes that read it";
        let maps = self.kept.iter();
        maps.map(|(_, map)| ResourceUse::of("environment", map.view.texture(), why)).collect()
    }

    /// What shaders read of an environment; black where there is none.
    ///
    /// # Errors
    /// Where its map has not the size it claims, or none that the device can hold.
    pub(crate) fn bind(
        &mut self,
        gpu: &Gpu,
        given: Option<&EnvironmentView<'_>>,
    ) -> Result<Bound, RenderError> {
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("environment"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let Some(given) = given else {
            let black = upload(gpu, &[vec![[f16::ZERO; 4]; 1]], &[1]);
            let uniform = Uniform::new().vec4_array(&[Vec4::X, Vec4::Y, Vec4::Z]).f32(0.0).f32(0.0);
            return Ok(Bound { uniform: filled(gpu, uniform), map: black, sampler });
        };
        let environment = given.environment;
        let map = self.map(gpu, given)?;
        let turn = environment.probe_from_world.as_mat3();
        let columns = [turn.x_axis, turn.y_axis, turn.z_axis].map(|axis| axis.extend(0.0));
        let gain = environment.gain.max(0.0) as f32;
        let uniform = Uniform::new()
            .vec4_array(&columns)
            .f32(map.unit * if gain.is_finite() { gain } else { 0.0 })
            .f32((map.n_levels - 1) as f32);
        Ok(Bound { uniform: filled(gpu, uniform), map: map.view.clone(), sampler })
    }

    fn map(&mut self, gpu: &Gpu, given: &EnvironmentView<'_>) -> Result<&Map, RenderError> {
        let facts = &given.environment.facts;
        if let Some(at) = self.kept.iter().position(|(key, _)| *key == facts.key) {
            let known = self.kept.remove(at);
            self.kept.insert(0, known);
        } else {
            let map = made(gpu, given)?;
            self.uploads += 1;
            self.kept.insert(0, (facts.key.clone(), map));
            self.kept.truncate(KEPT);
        }
        Ok(&self.kept[0].1)
    }
}

fn filled(gpu: &Gpu, uniform: Uniform) -> wgpu::Buffer {
    gpu.filled_buffer("environment", &uniform.into_bytes(), wgpu::BufferUsages::UNIFORM)
}

/// Brings a map onto the device.
fn made(gpu: &Gpu, given: &EnvironmentView<'_>) -> Result<Map, RenderError> {
    let side = given.environment.facts.side as usize;
    let largest = gpu.device.limits().max_texture_dimension_2d as usize;
    if side < SMALLEST_SIDE || side > largest || given.texels.len() != side * side {
        return Err(RenderError::Environment(format!(
            "an environment map of {side} x {side} texels was announced, {} were given; a side is \
             {SMALLEST_SIDE} to {largest}",
            given.texels.len()
        )));
    }
    let bright = given.texels.iter().flatten().fold(0.0f32, |most, value| most.max(*value));
    // Of subnormal light nothing could be divided by so small a unit.
    let unit = if bright.is_normal() { (bright / BRIGHTEST).max(f32::MIN_POSITIVE) } else { 1.0 };
    let levels = levels(given.texels, side);
    let sides: Vec<usize> = levels.iter().map(|level| level.len().isqrt()).collect();
    let stored: Vec<Vec<[f16; 4]>> = levels
        .iter()
        .map(|level| {
            let store = |texel: &[f32; 3]| {
                // What is no light at all is black, as `Probe` promises it not to be.
                let value =
                    |v: f32| if v.is_finite() { (v / unit).clamp(0.0, 65_504.0) } else { 0.0 };
                let [r, g, b] = texel.map(|v| f16::from_f32(value(v)));
                [r, g, b, f16::ONE]
            };
            level.iter().map(store).collect()
        })
        .collect();
    Ok(Map { view: upload(gpu, &stored, &sides), unit, n_levels: levels.len() })
}

fn upload(gpu: &Gpu, levels: &[Vec<[f16; 4]>], sides: &[usize]) -> wgpu::TextureView {
    let size = |side: usize| wgpu::Extent3d {
        width: side as u32,
        height: side as u32,
        depth_or_array_layers: 1,
    };
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("environment"),
        size: size(sides[0]),
        mip_level_count: levels.len() as u32,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (number, (level, &side)) in levels.iter().zip(sides).enumerate() {
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture: &texture,
                mip_level: number as u32,
                origin: wgpu::Origin3d::ZERO,
                aspect: wgpu::TextureAspect::All,
            },
            bytemuck::cast_slice(level),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(8 * side as u32),
                rows_per_image: Some(side as u32),
            },
            size(side),
        );
    }
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// The map and coarser ones, each of half the side.
fn levels(texels: &[[f32; 3]], side: usize) -> Vec<Vec<[f32; 3]>> {
    let mut levels = vec![texels.to_vec()];
    let mut side = side;
    while side / 2 >= SMALLEST_SIDE {
        let finer = &levels[levels.len() - 1];
        levels.push(halved(finer, side));
        side /= 2;
    }
    levels
}

/// A map of half the side: each texel is the mean of those around it, weighted by a tent as wide
/// as the distance between coarse texels and by their solid angles.
fn halved(finer: &[[f32; 3]], side: usize) -> Vec<[f32; 3]> {
    let half = side / 2;
    let spacing = (side - 1) as f64 / (half - 1) as f64;
    let at = |place: usize| place as f64 * spacing;
    let texel = |index: usize| {
        let center = [at(index % half), at(index / half)];
        let (mut sum, mut weights) = ([0.0f64; 3], 0.0f64);
        let range = |c: f64| (c - spacing).ceil() as i64..=(c + spacing).floor() as i64;
        for j in range(center[1]) {
            for i in range(center[0]) {
                let tent = |c: f64, k: i64| 1.0 - (c - k as f64).abs() / spacing;
                let (x, y) = inside(i, j, side);
                let weight = tent(center[0], i).max(0.0)
                    * tent(center[1], j).max(0.0)
                    * solid_angle_density(x, y, side);
                for (total, value) in sum.iter_mut().zip(finer[y * side + x]) {
                    *total += weight * f64::from(value);
                }
                weights += weight;
            }
        }
        sum.map(|total| (total / weights) as f32)
    };
    (0..half * half).into_par_iter().map(texel).collect()
}

/// The texel that a place beyond the border stands for: across the fold, mirrored.
fn inside(mut i: i64, mut j: i64, side: usize) -> (usize, usize) {
    let last = side as i64 - 1;
    if i < 0 || i > last {
        (i, j) = (if i < 0 { -i } else { 2 * last - i }, last - j);
    }
    if j < 0 || j > last {
        (i, j) = (last - i, if j < 0 { -j } else { 2 * last - j });
    }
    (i.clamp(0, last) as usize, j.clamp(0, last) as usize)
}

/// Solid angle per area of the map, up to a constant factor: a flat face of the octahedron, seen
/// from its centre, falls off with the cube of the distance.
fn solid_angle_density(x: usize, y: usize, side: usize) -> f64 {
    let p = |k: usize| 2.0 * k as f64 / (side - 1) as f64 - 1.0;
    let (mut u, mut v) = (p(x).abs(), p(y).abs());
    let z = 1.0 - u - v;
    if z < 0.0 {
        (u, v) = (1.0 - v, 1.0 - u);
    }
    (u * u + v * v + z * z).powf(-1.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The direction of a texel, as `octahedral_decode` of the shaders has it.
    fn direction(x: usize, y: usize, side: usize) -> glam::DVec3 {
        let p = |k: usize| 2.0 * k as f64 / (side - 1) as f64 - 1.0;
        let mut n = glam::DVec3::new(p(x), p(y), 1.0 - p(x).abs() - p(y).abs());
        let t = (-n.z).max(0.0);
        n.x -= t.copysign(n.x);
        n.y -= t.copysign(n.y);
        n.normalize_or(glam::DVec3::Z)
    }

    #[test]
    fn places_beyond_the_border_are_their_mirrored_neighbours() {
        let side = 8;
        for j in 0..8 {
            let (x, y) = inside(-1, j, side);
            // Both neighbours of the border are as far from it.
            let border = direction(0, j as usize, side);
            let (a, b) = (direction(1, j as usize, side), direction(x, y, side));
            assert!((border.dot(a) - border.dot(b)).abs() < 1e-12);
            assert_eq!(inside(j, 8, side), (7 - j as usize, 6));
        }
        assert_eq!(inside(3, 4, side), (3, 4));
    }

    #[test]
    fn coarser_levels_keep_the_mean_and_meet_at_the_border() {
        let side = 64;
        let value = |x: usize, y: usize| {
            let n = direction(x, y, side);
            [1.0 + n.x as f32, 2.0 + (n.y * n.z) as f32, 3.0 + n.z as f32]
        };
        let texels: Vec<[f32; 3]> = (0..side * side).map(|i| value(i % side, i / side)).collect();
        let levels = levels(&texels, side);
        assert_eq!(levels.len(), 5);
        for level in &levels {
            let side = level.len().isqrt();
            let (mut sum, mut weights) = (0.0, 0.0);
            for (i, texel) in level.iter().enumerate() {
                let (x, y) = (i % side, i / side);
                // Border texels are shared by two, corners by four.
                let edges =
                    usize::from(x == 0 || x == side - 1) + usize::from(y == 0 || y == side - 1);
                let weight = solid_angle_density(x, y, side) / f64::from(1 << edges);
                sum += weight * f64::from(texel[0]);
                weights += weight;
                let mirrored = level[(side - 1 - y) * side + x];
                if x == 0 || x == side - 1 {
                    assert!((texel[1] - mirrored[1]).abs() < 1e-5);
                }
            }
            assert!((sum / weights - 1.0).abs() < 0.01, "{side}: {}", sum / weights);
        }
    }
}
