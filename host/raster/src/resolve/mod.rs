//! Pixels of a tile, as the surface buffer holds them.

pub(crate) mod rims;

use crate::cloud::CloudInView;
use crate::columns::Albedo;
use crate::lanes::{F, U, V, WIDTH};
use crate::pack::pack_surface;
use crate::picture::{Band, Mode};
use crate::splat::BACK;
use crate::tile::layout::{N_NORMAL_SUMS, N_SUMS, SIDE};
use crate::tile::{Tile, vector};
use fearless_simd::prelude::*;
use fearless_simd::u32x4;

/// What the pixels of a picture have in common.
pub(crate) struct Scene<'a> {
    pub(crate) clouds: &'a [CloudInView<'a>],
    pub(crate) world_from_view: [[f32; 3]; 3],
    pub(crate) linear_of_srgb: &'a [f32; 256],
    pub(crate) mode: Mode,
    /// Sums that are added up.
    pub(crate) n_sums: usize,
    /// Albedo and accessibility of all surfels, where these are not added up.
    pub(crate) same: [f32; 4],
}

impl<'a> Scene<'a> {
    pub(crate) fn new(
        clouds: &'a [CloudInView<'a>],
        world_from_view: [[f32; 3]; 3],
        linear_of_srgb: &'a [f32; 256],
        mode: Mode,
    ) -> Self {
        let one = |in_view: &CloudInView<'_>| match in_view.columns.albedo {
            Albedo::Same([r, g, b])
                if in_view.columns.ao.is_none() && in_view.eye.back_albedo.is_none() =>
            {
                Some([r, g, b, 1.0])
            }
            _ => None,
        };
        let first = clouds.first().and_then(one);
        let same = first.filter(|_| clouds.iter().all(|in_view| one(in_view) == first));
        Self {
            clouds,
            world_from_view,
            linear_of_srgb,
            mode,
            n_sums: if same.is_some() { N_NORMAL_SUMS } else { N_SUMS },
            same: same.unwrap_or_default(),
        }
    }

    /// The cloud that a number belongs to.
    pub(crate) fn cloud_of(&self, number: u32) -> usize {
        let number = number & !BACK;
        self.clouds.partition_point(|in_view| in_view.first <= number).saturating_sub(1)
    }
}

/// Writes a tile into the rows of a picture.
#[inline(always)]
pub(crate) fn write<S: Simd>(simd: S, tile: &Tile, scene: &Scene<'_>, band: &mut Band<'_>) {
    let [width, height] = tile.size;
    tile.mark(band);
    for row in 0..height.div_ceil(SIDE) {
        for column in 0..width.div_ceil(SIDE) {
            let square = Tile::square(column, row);
            if scene.mode != Mode::None {
                backs(simd, tile, [column, row], band);
                let words = packed(simd, tile, [column, row], scene).map(|words| words.to_array());
                let across = SIDE.min(width - SIDE * column);
                for y in 0..SIDE.min(height - SIDE * row) {
                    let at = band.at(tile.corner, SIDE * column, SIDE * row + y);
                    let pixels = &mut band.packed[at..at + across];
                    let own = row_of(simd, &words, y);
                    match pixels.as_mut_array::<SIDE>() {
                        Some(whole) => *whole = own,
                        // At the picture's edge.
                        None => pixels.copy_from_slice(&own[..across]),
                    }
                }
            }
            if band.looks_up() {
                looked_up(tile, [column, row], square, scene, band);
            }
        }
    }
}

/// Notes the pixels of a square that are seen from behind.
#[inline(always)]
fn backs<S: Simd>(simd: S, tile: &Tile, [column, row]: [usize; 2], band: &mut Band<'_>) {
    let numbers = &tile.number[Tile::square(column, row)];
    let is_back = U::load_array_ref(simd, numbers).simd_ge(U::splat(simd, BACK));
    if !is_back.any_true() {
        return;
    }
    for (lane, &number) in numbers.iter().enumerate().filter(|(_, number)| **number >= BACK) {
        let (x, y) = (SIDE * column + lane % SIDE, SIDE * row + lane / SIDE);
        if x < tile.size[0] && y < tile.size[1] {
            // Sides of pictures are below 2^16 each, or nearly so.
            let at = band.top * band.width + band.at(tile.corner, x, y);
            band.backs.push((at as u32, number));
        }
    }
}

/// A row of a square's pixels, from the words of all of them.
#[inline(always)]
fn row_of<S: Simd>(simd: S, words: &[[u32; WIDTH]; 4], y: usize) -> [[u32; 4]; SIDE] {
    let four = |i: usize| u32x4::from_slice(simd, &words[i][SIDE * y..][..SIDE]);
    let mut pixels = [0; 4 * SIDE];
    u32x4::store_four_interleaved([four(0), four(1), four(2), four(3)], &mut pixels);
    std::array::from_fn(|x| std::array::from_fn(|word| pixels[4 * x + word]))
}

/// What is looked up of the nearest surfels.
fn looked_up(
    tile: &Tile,
    [column, row]: [usize; 2],
    square: usize,
    scene: &Scene<'_>,
    band: &mut Band<'_>,
) {
    for (lane, &number) in tile.number[square].iter().enumerate() {
        let (x, y) = (SIDE * column + lane % SIDE, SIDE * row + lane / SIDE);
        if x >= tile.size[0] || y >= tile.size[1] {
            continue;
        }
        let at = band.at(tile.corner, x, y);
        let (mut winner, mut material, mut object) = ([0; 2], 0, 0);
        if number != 0 {
            let in_view = &scene.clouds[scene.cloud_of(number)];
            object = in_view.object;
            let surfel = in_view.columns.surfel_at(in_view.place(number));
            let number = (in_view.first_surfel + surfel) | (number & BACK);
            winner = [number, tile.depth[square][lane].to_bits()];
            material = in_view.columns.material_of(surfel);
        }
        if let Some(pixel) = band.winners.get_mut(at) {
            *pixel = winner;
        }
        if let Some(pixel) = band.material.get_mut(at) {
            *pixel = material;
        }
        if let Some(pixel) = band.object.get_mut(at) {
            *pixel = object;
        }
    }
}

/// The four words of a square's pixels.
#[inline(always)]
fn packed<S: Simd>(
    simd: S,
    tile: &Tile,
    [column, row]: [usize; 2],
    scene: &Scene<'_>,
) -> [U<S>; 4] {
    let square = Tile::square(column, row);
    let zero = U::splat(simd, 0);
    let number = U::load_array_ref(simd, &tile.number[square]);
    let filled = number.simd_gt(zero);
    if !filled.any_true() {
        return [zero; 4];
    }
    let depth = F::load_array_ref(simd, &tile.depth[square]);
    let (normal, albedo, ao) = match scene.mode {
        Mode::Blended | Mode::Fields => blended(simd, tile, [column, row], scene),
        Mode::Nearest | Mode::None => nearest(simd, tile, square, scene),
    };
    let [a, b, c, d] = pack_surface(depth, normal, albedo, ao);
    [filled.select(a, zero), filled.select(b, zero), filled.select(c, zero), filled.select(d, zero)]
}

/// The means of a square.
#[inline(always)]
fn blended<S: Simd>(
    simd: S,
    tile: &Tile,
    [column, row]: [usize; 2],
    scene: &Scene<'_>,
) -> (V<S>, [F<S>; 3], F<S>) {
    let square = Tile::square(column, row);
    let sums = tile.sums(square, scene.n_sums);
    let sum = vector(simd, sums);
    let weight = F::load_array_ref(simd, &sums[3]);
    let squared = sum.dot(sum);
    let has_normal = squared.simd_gt(weight * weight * 1e-8);
    let length = squared.sqrt();
    let mut normal = V { x: sum.x / length, y: sum.y / length, z: sum.z / length };
    let missing = !has_normal.to_bitmask() & 0xffff;
    if missing != 0 {
        normal = to_eye(simd, normal, missing, tile, [column, row], scene);
    }
    let [r, g, b, ao] = scene.same;
    if scene.n_sums == N_NORMAL_SUMS {
        let same = |value| F::splat(simd, value);
        return (normal, [same(r), same(g), same(b)], same(ao));
    }
    let r = F::load_array_ref(simd, &sums[4]) / weight;
    let g = F::load_array_ref(simd, &sums[5]) / weight;
    let b = F::load_array_ref(simd, &sums[6]) / weight;
    (normal, [r, g, b], F::load_array_ref(simd, &sums[7]) / weight)
}

/// Where normals cancel out, the direction to the eye, world-oriented.
fn to_eye<S: Simd>(
    simd: S,
    normal: V<S>,
    missing: u64,
    tile: &Tile,
    [column, row]: [usize; 2],
    scene: &Scene<'_>,
) -> V<S> {
    let [mut nx, mut ny, mut nz] = [normal.x, normal.y, normal.z].map(|lanes| lanes.to_array());
    for lane in (0..WIDTH).filter(|lane| missing >> lane & 1 == 1) {
        let number = tile.number[Tile::square(column, row)][lane];
        if number == 0 {
            continue;
        }
        let eye = &scene.clouds[scene.cloud_of(number)].eye;
        let x = tile.corner[0] as f32 + (SIDE * column + lane % SIDE) as f32;
        let y = tile.corner[1] as f32 + (SIDE * row + lane / SIDE) as f32;
        let [x, y] = eye.across_one(x, y);
        let towards = if eye.orthographic { [0.0, 0.0, 1.0] } else { [-x, -y, 1.0] };
        let length = towards.iter().map(|c| c * c).sum::<f32>().sqrt();
        let [a, b, c] = towards.map(|c| c / length);
        let [world_x, world_y, world_z] =
            scene.world_from_view.map(|[m, n, o]| m * a + n * b + o * c);
        (nx[lane], ny[lane], nz[lane]) = (world_x, world_y, world_z);
    }
    let load = |lanes| F::load_array(simd, lanes);
    V { x: load(nx), y: load(ny), z: load(nz) }
}

/// The nearest surfels of a square.
#[inline(always)]
fn nearest<S: Simd>(
    simd: S,
    tile: &Tile,
    square: usize,
    scene: &Scene<'_>,
) -> (V<S>, [F<S>; 3], F<S>) {
    let mut lanes = [[0.0; WIDTH]; 7];
    for (lane, &number) in tile.number[square].iter().enumerate() {
        let (normal, albedo, ao) = match number {
            0 => ([0.0, 0.0, 1.0], [0.0; 3], 1.0),
            _ => {
                let in_view = &scene.clouds[scene.cloud_of(number)];
                let place = in_view.place(number);
                let sign = if number & BACK == 0 { 1.0 } else { -1.0 };
                let columns = in_view.columns;
                let normal = columns.normal_of(place).map(|c| sign * c);
                let albedo = in_view.seen_albedo(number, scene.linear_of_srgb);
                (normal, albedo, columns.ao_of(place))
            }
        };
        for axis in 0..3 {
            lanes[axis][lane] = normal[axis];
            lanes[3 + axis][lane] = albedo[axis];
        }
        lanes[6][lane] = ao;
    }
    let load = |i: usize| F::load_array_ref(simd, &lanes[i]);
    (V { x: load(0), y: load(1), z: load(2) }, [load(3), load(4), load(5)], load(6))
}
