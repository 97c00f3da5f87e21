// Noise looked up in a volume that was computed once, in mip levels.
//
// The same functions as in computed.wgsl: the renderer brings one of the two along as
// `procedural::field`.
#import surfelshop::noise::{Lattice, Seed}
#import surfelshop::noise as gradients
#import surfelshop::filtered::Filtered

var noise_volume: texture_3d<f32>;
var noise_sampler: sampler;

// Cells along the volume, after which it repeats. Twin: `PERIOD` of volume.rs.
const PERIOD = 16.0;

// How much finer than the pixel the texels are that are looked up: linear interpolation blurs a level
// of means over cubes to sqrt(3) times the cubes' width.
const FINER = 1.3;

// The volume as a pixel sees it. Cubes blur along the surface's normal, too, and less than the pixel
// along its axes: what is looked up is brought to the contrast that the pixel leaves.
fn looked_up(l: Lattice, widths_cells: vec2<f32>) -> vec3<f32> {
    let texels_per_cell = f32(textureDimensions(noise_volume).x) / PERIOD;
    let short = min(widths_cells.x, widths_cells.y);
    let level = max(log2(max(short * texels_per_cell, 1e-6)) - FINER, 0.0);
    let place = (vec3<f32>(l.cell & vec3(i32(PERIOD) - 1)) + l.rest) / PERIOD;
    let found = textureSampleLevel(noise_volume, noise_sampler, place, level).rgb;
    // The first level has noise at points, those after it means.
    let blurred = 1.7320508 * exp2(level) / texels_per_cell * min(level, 1.0);
    let done = gradients::attenuation(vec2(blurred)) * gradients::attenuation(vec2(blurred, 0.0));
    return found * (gradients::attenuation(widths_cells) / done);
}

fn scalar(l: Lattice, widths_cells: vec2<f32>, seed: Seed) -> Filtered {
    let varies = gradients::DEVIATION * sqrt(gradients::missing(widths_cells));
    return Filtered(looked_up(l, widths_cells).x, varies);
}

fn vector(l: Lattice, widths_cells: vec2<f32>, seed: Seed) -> vec3<f32> {
    return looked_up(l, widths_cells);
}
