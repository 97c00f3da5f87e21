// Gradient noise in three dimensions, in octaves, as it is inside a pixel.
//
// Positions are an anchor, known to 36 bits, and an offset from it, so that neither a surface far
// from its cloud's centre nor a close look at it shows the steps of f32. Frequencies count with 12
// bits, which makes their products with the anchor exact.
//
// Source: Perlin 2002, "Improving Noise", with hashed gradients instead of a table; Jarzynski &
// Olano 2020, "Hash Functions for GPU Rendering" (pcg3d).
//
// Twin: `tests/support/procedural/noise.rs`.
#define_import_path surfelshop::noise

#import surfelshop::filtered::Filtered

// A pixel's place in a pattern.
struct Place {
    // The anchor in three parts of 12 bits each; their sum is it.
    anchor_high: vec3<f32>,
    anchor_middle: vec3<f32>,
    anchor_low: vec3<f32>,
    // From the anchor.
    offset: vec3<f32>,
    // The pixel's outline on the surface: its two axes. Zero asks for the pattern at a point.
    across: vec3<f32>,
    along: vec3<f32>,
}

// The position itself, as well as f32 holds it.
fn position(at: Place) -> vec3<f32> {
    return at.anchor_high + at.anchor_middle + at.anchor_low + at.offset;
}

// Where a place lies in a lattice: its cell, and 0 to 1 in there.
struct Lattice {
    cell: vec3<i32>,
    rest: vec3<f32>,
}

// After so many cells noise repeats, a power of two: sums of a few such numbers stay in 32 bits.
const LONGEST_PERIOD = 268435456.0;

// A frequency as it counts: its 12 leading bits.
fn counted(frequency: vec3<f32>) -> vec3<f32> {
    return bitcast<vec3<f32>>(bitcast<vec3<u32>>(frequency) & vec3(0xfffff000u));
}

// The lattice of a frequency, cells per unit of the pattern.
fn lattice(at: Place, frequency: vec3<f32>) -> Lattice {
    let f = counted(frequency);
    // Products of 12 bits and 12 bits are exact, and so are their whole and broken parts.
    let a = at.anchor_high * f;
    let b = at.anchor_middle * f;
    let c = at.anchor_low * f;
    let whole = wrapped(floor(a)) + wrapped(floor(b)) + wrapped(floor(c));
    let broken = (a - floor(a)) + (b - floor(b)) + (c - floor(c));
    return moved(Lattice(whole, vec3(0.0)), broken + at.offset * f);
}

// Whole numbers in the longest period; exact, since they are multiples of their last bit.
fn wrapped(whole: vec3<f32>) -> vec3<i32> {
    let w = clamp(whole, vec3(-1e30), vec3(1e30));
    return vec3<i32>(w - round(w / LONGEST_PERIOD) * LONGEST_PERIOD);
}

// The lattice's place moved by so many cells.
fn moved(l: Lattice, by: vec3<f32>) -> Lattice {
    // Whole cells first, so that a long way costs the rest no digits.
    let steps = floor(by);
    let rest = l.rest + (by - steps);
    let whole = floor(rest);
    let cell = l.cell + wrapped(steps) + wrapped(whole);
    return Lattice(cell, clamp(rest - whole, vec3(0.0), vec3(1.0)));
}

// Three hashes of three numbers.
fn pcg3d(seed: vec3<u32>) -> vec3<u32> {
    var v = seed * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v = v ^ (v >> vec3(16u));
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return v;
}

// What is drawn from a lattice.
struct Seed {
    // Moves the hash.
    key: vec3<u32>,
    // Bits of the cells' numbers that count, below a power of two after which the noise repeats: at
    // most 28 of them.
    mask: u32,
}

// A gradient from 30 bits, each component evenly in -1 to 1.
fn gradient(bits: u32) -> vec3<f32> {
    let parts = vec3(bits, bits >> 10u, bits >> 20u) & vec3(1023u);
    return vec3<f32>(parts) * 0.00195503421 - 1.0;
}

// Perlin's fade, with neither slope nor curvature at 0 and 1.
fn fade(t: vec3<f32>) -> vec3<f32> {
    return t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
}

// Makes the standard deviation of noise, averaged over its cells, a quarter:
// `Twin::noise` has the theory.
const TO_A_QUARTER = 1.30801;
const DEVIATION: f32 = 0.25;

fn corner(l: Lattice, x: i32, y: i32, z: i32, seed: Seed) -> vec3<u32> {
    let cell = bitcast<vec3<u32>>(l.cell + vec3(x, y, z)) & vec3(seed.mask);
    return pcg3d(cell + seed.key);
}

fn slope(l: Lattice, x: i32, y: i32, z: i32, seed: Seed) -> f32 {
    let from_corner = l.rest - vec3(f32(x), f32(y), f32(z));
    return dot(gradient(corner(l, x, y, z, seed).x), from_corner);
}

// Noise of mean 0 and standard deviation 1/4, almost always between -1 and 1.
fn scalar(l: Lattice, seed: Seed) -> f32 {
    let t = fade(l.rest);
    let low = mix(
        mix(slope(l, 0, 0, 0, seed), slope(l, 1, 0, 0, seed), t.x),
        mix(slope(l, 0, 1, 0, seed), slope(l, 1, 1, 0, seed), t.x),
        t.y,
    );
    let high = mix(
        mix(slope(l, 0, 0, 1, seed), slope(l, 1, 0, 1, seed), t.x),
        mix(slope(l, 0, 1, 1, seed), slope(l, 1, 1, 1, seed), t.x),
        t.y,
    );
    return TO_A_QUARTER * mix(low, high, t.z);
}

fn slopes(l: Lattice, x: i32, y: i32, z: i32, seed: Seed) -> vec3<f32> {
    let from_corner = l.rest - vec3(f32(x), f32(y), f32(z));
    let h = corner(l, x, y, z, seed);
    return vec3(
        dot(gradient(h.x), from_corner),
        dot(gradient(h.y), from_corner),
        dot(gradient(h.z), from_corner),
    );
}

// Three such noises that know nothing of each other; the first is `scalar`.
fn vector(l: Lattice, seed: Seed) -> vec3<f32> {
    let t = fade(l.rest);
    let low = mix(
        mix(slopes(l, 0, 0, 0, seed), slopes(l, 1, 0, 0, seed), t.x),
        mix(slopes(l, 0, 1, 0, seed), slopes(l, 1, 1, 0, seed), t.x),
        t.y,
    );
    let high = mix(
        mix(slopes(l, 0, 0, 1, seed), slopes(l, 1, 0, 1, seed), t.x),
        mix(slopes(l, 0, 1, 1, seed), slopes(l, 1, 1, 1, seed), t.x),
        t.y,
    );
    return TO_A_QUARTER * mix(low, high, t.z);
}

// How wide the pixel's outline is in a lattice, cells: across and along.
fn widths(at: Place, frequency: vec3<f32>) -> vec2<f32> {
    return vec2(length(at.across * frequency), length(at.along * frequency));
}

// What a pixel of such widths leaves of the noise at its centre: the noise's correlation with its
// mean over the pixel, at most 0.006 off along each axis.
//
// The mean of the autocorrelation over a line of width w falls as 1 - 0.2838 w^2 at first and as
// 0.8175 / w in the end; what lies between is fitted. Over both axes it is the product, within 0.03.
fn attenuation(widths_cells: vec2<f32>) -> f32 {
    return inverseSqrt(1.0 + lost(widths_cells));
}

// The share of the variance that the mean over the pixel lacks: 1 less the square of the attenuation,
// with all its digits also where next to nothing is missing.
fn missing(widths_cells: vec2<f32>) -> f32 {
    let p = lost(widths_cells);
    return p / (1.0 + p);
}

// The attenuation's square is 1 / (1 + this).
fn lost(widths_cells: vec2<f32>) -> f32 {
    let w = min(widths_cells, vec2(1e4));
    let bent = 0.15 * w * w * w;
    let q = w * w * (0.5676 + 1.496 * bent) / (1.0 + bent);
    return q.x + q.y + q.x * q.y;
}

// Noise over a pixel, from its value at the centre.
fn over_pixel(value: f32, widths_cells: vec2<f32>) -> Filtered {
    return Filtered(attenuation(widths_cells) * value, DEVIATION * sqrt(missing(widths_cells)));
}
