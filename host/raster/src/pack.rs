//! How pixels of the surface are packed: twin of `shaders/surface/packing.wgsl`, for several at once.

use crate::lanes::{F, I, U, V, larger, smaller};
use fearless_simd::prelude::*;

/// Largest albedo the buffer holds.
const MAX_ALBEDO: f32 = 65504.0;

/// Numbers between others; the lower where they are none.
#[inline(always)]
fn between<S: Simd>(value: F<S>, low: f32, high: f32) -> F<S> {
    let simd = value.token();
    smaller(larger(value, F::splat(simd, low)), F::splat(simd, high))
}

#[inline(always)]
fn octahedral_encode<S: Simd>(V { x, y, z }: V<S>) -> [F<S>; 2] {
    let simd = x.token();
    let (zero, one) = (F::splat(simd, 0.0), F::splat(simd, 1.0));
    let sum = x.abs() + y.abs() + z.abs();
    let p = [x / sum, y / sum];
    let signs = [p[0].simd_ge(zero).select(one, -one), p[1].simd_ge(zero).select(one, -one)];
    let folded = [(one - p[1].abs()) * signs[0], (one - p[0].abs()) * signs[1]];
    let upper = z.simd_ge(zero);
    [upper.select(p[0], folded[0]), upper.select(p[1], folded[1])]
}

#[inline(always)]
fn snorm<S: Simd>(value: F<S>) -> U<S> {
    // Rounded half up, as WGSL says.
    let scaled = (between(value, -1.0, 1.0) * 32767.0 + 0.5).floor();
    scaled.to_int::<I<S>>().bitcast::<U<S>>() & 0xffff
}

#[inline(always)]
pub(crate) fn pack_direction<S: Simd>(normal: V<S>) -> U<S> {
    let [x, y] = octahedral_encode(normal);
    snorm(x) | snorm(y) << 16
}

/// The bits of half-precision floats next to numbers from 0 to 65,504, ties to even.
#[inline(always)]
pub(crate) fn half_bits<S: Simd>(value: F<S>) -> U<S> {
    let bits = value.to_bits();
    // From 2^-14 on: the exponent's bias is 112 less, and 13 bits are rounded away.
    let normal = (bits + ((bits >> 13) & 1) + 0xfffu32.wrapping_sub(112 << 23)) >> 13;
    // Below: adding a half shifts the mantissa to where those of small halves lie, and rounds.
    let small = (value + 0.5).to_bits() - 0.5f32.to_bits();
    value.simd_lt(F::splat(value.token(), 6.103_515_6e-5)).select(small, normal)
}

#[inline(always)]
fn albedo_bits<S: Simd>(value: F<S>) -> U<S> {
    half_bits(between(value, 0.0, MAX_ALBEDO))
}

/// Depth (f32), normal (octahedral, 2 x 16 bits), albedo (3 x f16), accessibility (16 bits).
#[inline(always)]
pub(crate) fn pack_surface<S: Simd>(
    depth: F<S>,
    normal: V<S>,
    albedo: [F<S>; 3],
    ao: F<S>,
) -> [U<S>; 4] {
    let [r, g, b] = albedo;
    let (r, g, b) = (albedo_bits(r), albedo_bits(g), albedo_bits(b));
    let access = (between(ao, 0.0, 1.0) * 65535.0 + 0.5).floor().to_int::<U<S>>();
    [depth.to_bits(), pack_direction(normal), r | g << 16, b | access << 16]
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::{Level, dispatch};
    use half::f16;

    #[inline(always)]
    fn halves<S: Simd>(simd: S, values: [f32; 16]) -> [u32; 16] {
        half_bits(F::load_array(simd, values)).to_array()
    }

    #[test]
    fn halves_are_those_of_the_crate() {
        let level = Level::new();
        let check = |values: [f32; 16]| {
            let found = dispatch!(level, simd => halves(simd, values));
            for (value, found) in values.iter().zip(found) {
                let expected = u32::from(f16::from_f32(*value).to_bits());
                assert_eq!(found, expected, "{value:e}");
            }
        };
        for bits in (0..65504f32.to_bits()).step_by(16 * 977) {
            check(std::array::from_fn(|i| f32::from_bits(bits + 977 * i as u32)));
        }
        let mut edges = [0.0; 16];
        for (i, code) in [1u16, 2, 3, 0x3ff, 0x400, 0x401, 0x3c00, 0x7bfe].into_iter().enumerate() {
            // Halfway to the next, where ties are.
            let (low, high) = (f16::from_bits(code).to_f32(), f16::from_bits(code + 1).to_f32());
            (edges[2 * i], edges[2 * i + 1]) = (low, 0.5 * (low + high));
        }
        check(edges);
    }
}
