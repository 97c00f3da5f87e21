//! Random numbers that depend on nothing but a seed and a place in a sequence, so that they are the
//! same in whatever order and on however many threads they are drawn.

/// A number for a place of a seed's sequence.
///
/// Source: the output function of `SplitMix64`, Steele et al. 2014, "Fast Splittable Pseudorandom
/// Number Generators".
pub(crate) fn bits(seed: u64, place: u64) -> u64 {
    mixed(mixed(seed).wrapping_add(place.wrapping_mul(0x9e37_79b9_7f4a_7c15)))
}

fn mixed(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Uniform in [0, 1).
pub(crate) fn unit(seed: u64, place: u64) -> f64 {
    (bits(seed, place) >> 11) as f64 / (1u64 << 53) as f64
}
