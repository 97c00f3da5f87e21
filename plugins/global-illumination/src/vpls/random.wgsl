// Low-discrepancy points and random numbers by hashing.
#define_import_path gi::random

// Mixes the bits of a number.
//
// Source: Jarzynski & Olano 2020, "Hash Functions for GPU Rendering" (pcg).
fn mixed(seed: u32) -> u32 {
    let state = seed * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

// From 0 to below 1.
fn fraction(bits: u32) -> f32 {
    return f32(bits >> 8u) * 5.9604645e-8;
}

// Number `i` of van der Corput's sequence in a base: from 0 to below 1.
//
// Source: Halton 1960.
fn radical_inverse(index: u32, base: u32) -> f32 {
    var i = index;
    var result = 0.0;
    var share = 1.0 / f32(base);
    let step = share;
    while i > 0u {
        result += f32(i % base) * share;
        i /= base;
        share *= step;
    }
    return min(result, 0.99999994);
}

// Point `i` of Halton's sequence.
fn halton(i: u32) -> vec2<f32> {
    return vec2(radical_inverse(i, 2u), radical_inverse(i, 3u));
}
