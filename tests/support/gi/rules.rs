//! Shadow maps made on the CPU by other rules than the renderer's, to find better ones.

use super::hemisphere::{Axes, center_of, direction_of, place_of, texel_of};
use super::{Bench, Maps, Vpl};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use surfelshop_api::columns::{NORMAL, POSITION, RADIUS};

/// By what rules surfels get into maps, and holes are filled; the renderer's by default.
#[derive(Clone, Copy, Debug)]
pub struct Rules {
    /// Factor on the radius at which discs cover the surface as the scene's do.
    pub enlarged: f32,
    /// A disc nearer than this many radii...
    pub own_reach: f32,
    /// ...whose plane passes the light within this many radii is the light's own surface.
    pub own_off_plane: f32,
    /// Levels that are pulled together, or the power of two of texels that are looked at.
    pub levels: u32,
    /// Whether holes are filled that lie between two of one surface, by the farther of the two, and
    /// not by averages of a pyramid.
    pub between: bool,
    /// Texels of four that must have something in a pyramid.
    pub least_full: u32,
    /// Depths differ by less than this share where they are one surface.
    pub same_surface: f32,
    /// Whether a disc smaller than a texel is in the one of its centre.
    pub smallest: bool,
}

impl Rules {
    /// Discs that cover the surface, whose holes are filled by a pyramid.
    #[must_use]
    pub fn covering() -> Self {
        Self {
            enlarged: 1.0,
            levels: 2,
            between: false,
            same_surface: 0.2,
            smallest: true,
            ..Self::default()
        }
    }
}

impl Default for Rules {
    fn default() -> Self {
        Self {
            enlarged: 0.6,
            own_reach: 1.5,
            own_off_plane: 0.5,
            levels: 2,
            between: true,
            least_full: 2,
            same_surface: 0.4,
            smallest: false,
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Surfel {
    position: Vec3,
    normal: Vec3,
    radius: f32,
}

/// A cloud's surfels in the order in which they are drawn; units of the extent.
pub struct Surfels(Vec<Surfel>);

/// Puts two empty bits in front of each of the lowest 21.
fn spread(value: u64) -> u64 {
    (0..21).map(|bit| (value >> bit & 1) << (3 * bit)).sum()
}

impl Surfels {
    /// The surfels of a bench's cloud.
    #[must_use]
    pub fn of(bench: &Bench) -> Self {
        let (view, extent) = (bench.cloud.view(), bench.extent());
        let positions: Vec<Vec3> = view.vectors(POSITION).collect();
        let low = positions.iter().copied().reduce(Vec3::min).unwrap_or_default();
        let high = positions.iter().copied().reduce(Vec3::max).unwrap_or_default();
        let reach = f64::from((high - low).max_element());
        let per_cell = f64::from(1u32 << 21) / reach;
        let code = |position: Vec3| {
            let cell = ((position.as_dvec3() - low.as_dvec3()) * per_cell).to_array();
            let [x, y, z] =
                cell.map(|at| spread(at.clamp(0.0, f64::from((1u32 << 21) - 1)) as u64));
            x | y << 1 | z << 2
        };
        let radii = view.floats(RADIUS, 1).unwrap_or_default();
        let each = positions.iter().zip(view.vectors(NORMAL)).zip(radii);
        let mut keyed: Vec<(u64, Surfel)> = each
            .map(|((position, normal), radius)| {
                let position_in_extents = (*position + view.origin.as_vec3()) / extent;
                let (normal, radius) = (normal.normalize_or(Vec3::Y), radius / extent);
                (code(*position), Surfel { position: position_in_extents, normal, radius })
            })
            .collect();
        keyed.sort_by_key(|(code, _)| *code);
        Self(keyed.into_iter().map(|(_, surfel)| surfel).collect())
    }

    /// The maps of lights with one of every `step` surfels, by these rules, raw and filled.
    #[must_use]
    pub fn maps(&self, lights: &[Vpl], side: usize, step: usize, rules: &Rules) -> [Maps; 2] {
        let n_points = self.0.len().div_ceil(step);
        let stands_for = ((step * lights.len()) as f32).min(self.0.len() as f32);
        let scale = rules.enlarged * stands_for.sqrt();
        let one = |(i, light): (usize, &Vpl)| {
            let mut map = vec![0.0; side * side];
            if light.alive {
                let points = self.0.iter().step_by(step).skip(i).step_by(lights.len());
                points.for_each(|surfel| splat(surfel, light, scale, side, rules, &mut map));
            }
            map
        };
        let raw: Vec<Vec<f32>> = lights.par_iter().enumerate().map(one).collect();
        let filled: Vec<Vec<f32>> = raw.par_iter().map(|map| rules.fill(map, side)).collect();
        [raw, filled].map(|texels| Maps {
            lights: lights.to_vec(),
            side,
            texels: texels.concat(),
            n_points,
        })
    }
}

/// Texels that are looked past where a hole shows what lies behind, as in `fill.wgsl`.
const THROUGH: i32 = 4;

/// Share of its distance that a disc's radius has at most, as in `maps.wgsl`.
const NEAREST: f32 = 0.8;

/// Draws a surfel into a light's map, as `splat.wgsl` does.
fn splat(surfel: &Surfel, light: &Vpl, scale: f32, side: usize, rules: &Rules, map: &mut [f32]) {
    let axes = Axes::around(light.normal);
    let center = axes.local(surfel.position - light.position);
    let normal = axes.local(surfel.normal);
    let distance = center.length();
    let radius = surfel.radius * scale;
    let off_plane = center.dot(normal).abs();
    let is_own = distance < rules.own_reach * radius && off_plane < rules.own_off_plane * radius;
    if radius <= 0.0 || center.z <= -radius || distance <= 1e-9 || is_own {
        return;
    }
    let own = center / distance;
    let place = place_of(own.truncate().extend(own.z.max(-0.5)));
    // What is so near is known too coarsely to stand before all of the map.
    let radius = radius.min(NEAREST * distance);
    let sine = radius / distance;
    // Wider than any that is that near: what lies beyond the disc is found out texel by texel.
    let half = if sine > 0.3 { 2.0 } else { 0.75 * sine * (1.0 + place.length_squared()) };
    let low = texel_of(place - 1.1 * half, side);
    let high = texel_of(place + 1.1 * half, side);
    let middle = (rules.smallest && own.z > 0.0).then(|| texel_of(place_of(own), side));
    for y in low[1]..=high[1] {
        for x in low[0]..=high[0] {
            let at: Vec2 = center_of(x, y, side);
            if at.length_squared() > 1.0 {
                continue;
            }
            let direction = direction_of(at);
            let falls = direction.dot(normal);
            let along = center.dot(normal) / if falls.abs() < 1e-6 { 1e-6 } else { falls };
            let off = (direction * along - center).length_squared();
            let texel = &mut map[y * side + x];
            if along > 0.0 && off <= radius * radius {
                *texel = texel.max(1.0 / along);
            } else if middle == Some([x, y]) {
                *texel = texel.max(1.0 / distance);
            }
        }
    }
}

impl Rules {
    fn fill(&self, map: &[f32], side: usize) -> Vec<f32> {
        match self.between {
            true => self.fill_between(map, side),
            false => self.fill_by_pyramid(map, side),
        }
    }

    /// Fills holes as `fill.wgsl` does.
    fn fill_between(&self, map: &[f32], side: usize) -> Vec<f32> {
        let reach = if self.levels == 0 { 0 } else { 1 << self.levels };
        let first_from = |i: usize, [dx, dy]: [i32; 2], own: f32| {
            let inside = |at: i32| (0..side as i32).contains(&at);
            let reach = if own > 0.0 { reach.min(THROUGH) } else { reach };
            let texels =
                (1..=reach).map(|n| [(i % side) as i32 + n * dx, (i / side) as i32 + n * dy]);
            let inside = texels.take_while(|at| at.iter().all(|at| inside(*at)));
            let mut found = inside.map(|[x, y]| map[y as usize * side + x as usize]);
            let is_before = |near: &f32| *near > 0.0 && *near * (1.0 - self.same_surface) > own;
            found.find(is_before).unwrap_or(0.0)
        };
        let filled = |(i, near): (usize, &f32)| {
            if reach == 0 || center_of(i % side, i / side, side).length_squared() > 1.0 {
                return *near;
            }
            let across = |step: [i32; 2]| {
                let (one, other) =
                    (first_from(i, step, *near), first_from(i, step.map(|d| -d), *near));
                let farther = one.min(other);
                let is_one = farther > 0.0 && farther >= one.max(other) * (1.0 - self.same_surface);
                is_one.then_some(farther)
            };
            let mut around: Vec<f32> = [[1, 0], [0, 1]].into_iter().filter_map(across).collect();
            if *near == 0.0 || !around.is_empty() {
                around.extend([[1, 1], [1, -1]].into_iter().filter_map(across));
            }
            let least = if *near > 0.0 { 2 } else { 1 };
            match around.len() >= least {
                true => around.iter().sum::<f32>() / around.len() as f32,
                false => *near,
            }
        };
        map.iter().enumerate().map(filled).collect()
    }

    /// Fills holes by what is pulled together level by level and pushed back.
    fn fill_by_pyramid(&self, map: &[f32], side: usize) -> Vec<f32> {
        let mut levels = vec![map.to_vec()];
        let most = side.trailing_zeros().min(self.levels) as usize;
        for level in 0..most {
            let (width, half) = (side >> level, side >> (level + 1));
            let four = |i: usize| {
                let corner = i / half * 2 * width + i % half * 2;
                let below = &levels[level];
                let four = [0, 1, width, width + 1].map(|offset| below[corner + offset]);
                let nearest = four.iter().copied().fold(0.0, f32::max);
                let least = nearest * (1.0 - self.same_surface);
                let near: Vec<f32> = four.into_iter().filter(|x| *x > 0.0 && *x >= least).collect();
                let is_full = near.len() >= self.least_full as usize && !near.is_empty();
                if is_full { near.iter().sum::<f32>() / near.len() as f32 } else { 0.0 }
            };
            let pulled = (0..half * half).map(four).collect();
            levels.push(pulled);
        }
        let found = |(i, near): (usize, &f32)| {
            let (x, y) = (i % side, i / side);
            let mut found = *near;
            if center_of(x, y, side).length_squared() <= 1.0 {
                for (level, texels) in levels.iter().enumerate().skip(1) {
                    if found <= 0.0 {
                        found = texels[(y >> level) * (side >> level) + (x >> level)];
                    }
                }
            }
            found
        };
        map.iter().enumerate().map(found).collect()
    }
}
