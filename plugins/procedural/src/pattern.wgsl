// The language of patterns: what a pattern may ask for, and what it says of a place.
//
// A pattern is a file with a function
//
//     fn look(at: Place, albedo: vec3<f32>) -> Look
//
// that imports what it needs of `procedural::pattern`, `surfelshop::noise` and
// `surfelshop::filtered`. `at` is the pixel's place, 0 to 1 along the cloud's largest extent before
// scale and rotation; `albedo` is the cloud's own, linear Rec. 709.
//
// Twin: `tests/support/procedural/patterns.rs`.
#import surfelshop::noise::{Place, Lattice, Seed}
#import surfelshop::noise as gradients
#import surfelshop::filtered::Filtered
#import procedural::field

struct Pattern {
    key: vec3<u32>,
    mask: u32,
    // Cells of the first octave along the cloud.
    frequency: f32,
    n_octaves: u32,
    lacunarity: f32,
    gain: f32,
    // How far places are moved by noise, in cells of the first octave.
    warp: f32,
    // Makes the standard deviation of all octaves together that of one.
    to_one_octave: f32,
}

var<uniform> settings: Pattern;

// What a surface looks like.
struct Look {
    // Reflectance of the matte part, linear Rec. 709; that of the reflection where metallic is 1.
    albedo: vec3<f32>,
    // Weight of the highlight, 0 to 1.
    specular: f32,
    // 0 is a mirror, 1 dull.
    roughness: f32,
    // 0 is plastic or stone, 1 a metal.
    metallic: f32,
}

// Where octaves of one lattice lie against each other, cells: multiples of 1 / 64, which add up
// exactly, so that no two octaves vanish at the same places.
const BETWEEN_OCTAVES = vec3<f32>(5.375, 9.703125, 13.140625);

fn seed() -> Seed {
    return Seed(settings.key, settings.mask);
}

// The frequency that the parameters ask for, the same in all directions.
fn frequency() -> vec3<f32> {
    return vec3(settings.frequency);
}

// One octave of noise of mean 0 and deviation 1/4, of a frequency in cells per unit. `number` tells
// noises of the same frequency apart.
fn octave(at: Place, cells: vec3<f32>, number: u32) -> Filtered {
    let l = gradients::moved(gradients::lattice(at, cells), f32(number) * BETWEEN_OCTAVES);
    return field::scalar(l, gradients::widths(at, cells), seed());
}

// Octaves that the pixel leaves less than this of are not computed: a fiftieth of a quarter is half a
// level of 8 bits in what shows the noise itself.
const FAINTEST: f32 = 0.02;

// As many octaves as the parameters ask for, together of mean 0 and deviation 1/4, from a frequency
// on.
fn fbm_from(at: Place, cells: vec3<f32>) -> Filtered {
    var variance = 0.0;
    var n_seen = 0u;
    var f = cells;
    var contrast = settings.to_one_octave;
    for (var k = 0u; k < settings.n_octaves; k++) {
        let wide = gradients::widths(at, f);
        n_seen = select(n_seen, k + 1u, gradients::attenuation(wide) > FAINTEST);
        variance += contrast * contrast * gradients::missing(wide);
        f *= settings.lacunarity;
        contrast *= settings.gain;
    }
    var mean = 0.0;
    f = cells;
    contrast = settings.to_one_octave;
    for (var k = 0u; k < n_seen; k++) {
        mean += contrast * octave(at, f, k).mean;
        f *= settings.lacunarity;
        contrast *= settings.gain;
    }
    return Filtered(mean, gradients::DEVIATION * sqrt(variance));
}

// The same from the frequency that the parameters ask for.
fn fbm(at: Place) -> Filtered {
    return fbm_from(at, frequency());
}

// A place moved by noise of the first octave's frequency: what is drawn there is bent.
fn warped(at: Place) -> Place {
    if settings.warp == 0.0 || settings.frequency == 0.0 {
        return at;
    }
    let cells = frequency();
    let l = gradients::moved(gradients::lattice(at, cells), 31.0 * BETWEEN_OCTAVES);
    let w = gradients::widths(at, cells);
    let by = settings.warp * field::vector(l, w, seed());
    var moved = at;
    moved.offset += by / cells;
    // Bending squeezes and stretches what is bent: lengths grow by this on the average, as the
    // slope of noise has a standard deviation of 2.610 / 4 per cell in every direction.
    let grown = sqrt(1.0 + 3.0 * pow(settings.warp * 0.6525, 2.0));
    moved.across *= grown;
    moved.along *= grown;
    return moved;
}

// Counts waves along a direction from the middle: 1 more with each. Only its broken part is exact far
// from the middle, and the rest of `filtered` wants no more.
fn phase(at: Place, waves: vec3<f32>) -> Filtered {
    let l = gradients::lattice(at, waves);
    let f = gradients::counted(waves);
    let x = dot(at.across, f);
    let y = dot(at.along, f);
    return Filtered(fract(l.rest.x + l.rest.y + l.rest.z), sqrt((x * x + y * y) / 12.0));
}

// +1 and -1 in turns of half a wave along one axis, over the pixel: the mean of a square wave over a
// line of that width.
fn square(rest: f32, width: f32) -> f32 {
    let w = max(width, 1e-6);
    // A line shorter than half a wave meets one edge at most: how far away that is has more digits than
    // the difference of two integrals.
    let to_edge = 0.25 - abs(fract(rest + 0.25) - 0.5);
    let integral = (ascent(rest + 0.5 * w) - ascent(rest - 0.5 * w)) / w;
    return clamp(select(integral, 2.0 * to_edge / w, w < 0.5), -1.0, 1.0);
}

// The integral of a square wave of period 1, which begins with +1.
fn ascent(x: f32) -> f32 {
    return 0.5 - abs(fract(x) - 0.5);
}
