//! The octahedral map that shaders read.

use super::mapping::on_octahedron;
use super::picture::Picture;
use super::texels::TexelMap;
use rayon::prelude::*;

/// Fewest and most texels along a side.
const SIDES: [f64; 2] = [64.0, 1024.0];

/// Texels along the side of a map about as fine as the picture.
pub(super) fn side(source: &TexelMap) -> u32 {
    let exponent = source.n_shown().sqrt().clamp(SIDES[0], SIDES[1]).log2().round();
    1 << exponent as u32
}

/// The map: each texel the mean of what the picture shows over its footprint.
pub(super) fn map(source: &TexelMap, picture: &Picture, side: u32) -> Vec<[f32; 3]> {
    // Samples no farther apart than the picture's texels are, by and large, and interpolated.
    let finer = source.n_shown().sqrt() / f64::from(side);
    let n = if finer > 1.0 { finer.ceil().max(3.0) as u32 } else { 2 };
    let row = |j: u32| (0..side).map(move |i| footprint(source, picture, side, n, i, j));
    let mut texels: Vec<[f32; 3]> = (0..side).into_par_iter().flat_map_iter(row).collect();
    join_border(&mut texels, side as usize);
    texels
}

/// Mean over a texel's footprint, of n times n samples weighted by solid angle.
fn footprint(source: &TexelMap, picture: &Picture, side: u32, n: u32, i: u32, j: u32) -> [f32; 3] {
    let place = |i: u32, k: u32| {
        let within = (f64::from(k) + 0.5) / f64::from(n) - 0.5;
        2.0 * (f64::from(i) + within) / f64::from(side - 1) - 1.0
    };
    let (mut sum, mut weights) = ([0.0; 3], 0.0);
    for b in 0..n {
        for a in 0..n {
            let (x, y) = wrapped(place(i, a), place(j, b));
            let point = on_octahedron(x, y);
            // Solid angle over area of the map goes with the cube of the distance.
            let square = point.length_squared();
            let weight = 1.0 / (square * square.sqrt());
            weights += weight;
            let radiance = source.radiance(picture, point);
            sum.iter_mut().zip(radiance).for_each(|(sum, c)| *sum += weight * c);
        }
    }
    // A mean of finite numbers; rounding may take it beyond the largest of them.
    sum.map(|c| (c / weights).min(f64::from(f32::MAX)) as f32)
}

/// A place that may lie beyond the map's border, where it goes on mirrored about the middle of
/// that side.
fn wrapped(x: f64, y: f64) -> (f64, f64) {
    let (x, y) = if x.abs() > 1.0 { (x.signum() * 2.0 - x, -y) } else { (x, y) };
    if y.abs() > 1.0 { (-x, y.signum() * 2.0 - y) } else { (x, y) }
}

/// Makes texels of the border that show one direction equal.
fn join_border(texels: &mut [[f32; 3]], side: usize) {
    let last = side - 1;
    for i in 0..side / 2 {
        for edge in [0, last] {
            texels[edge * side + last - i] = texels[edge * side + i];
            texels[(last - i) * side + edge] = texels[i * side + edge];
        }
    }
    // All four corners show -z.
    for corner in [last, last * side, last * side + last] {
        texels[corner] = texels[0];
    }
}
