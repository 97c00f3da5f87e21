//! Random numbers that depend on nothing but a seed and a place in a sequence, so that they are the
//! same in whatever order and on however many threads they are drawn.

/// By how much places of a sequence are apart: 2^64 over the golden ratio.
const APART: u64 = 0x9e37_79b9_7f4a_7c15;

/// A number for a place of a seed's sequence.
pub(crate) fn bits(seed: u64, place: u64) -> u64 {
    mixed(mixed(seed).wrapping_add(place.wrapping_mul(APART)))
}

/// A number for a place of one sequence: all 64 bits of it are without a pattern.
pub fn scattered(place: u64) -> u64 {
    mixed(place.wrapping_mul(APART))
}

/// Source: the output function of `SplitMix64`, Steele et al. 2014, "Fast Splittable Pseudorandom
/// Number Generators".
fn mixed(value: u64) -> u64 {
    let mut z = value.wrapping_add(APART);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Bits without a pattern as a number, uniform in [0, 1).
pub fn fraction(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

/// Uniform in [0, 1).
pub(crate) fn unit(seed: u64, place: u64) -> f64 {
    fraction(bits(seed, place))
}
