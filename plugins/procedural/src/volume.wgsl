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

// The volume as a pixel sees it. A level is a mean over cubes as wide as its texels: the pixel's
// shorter axis picks it, and what the longer one leaves is up to the attenuation.
fn looked_up(l: Lattice, widths_cells: vec2<f32>) -> vec3<f32> {
    let texels_per_cell = f32(textureDimensions(noise_volume).x) / PERIOD;
    let short = min(widths_cells.x, widths_cells.y);
    let level = log2(max(short * texels_per_cell, 1.0));
    let place = (vec3<f32>(l.cell & vec3(i32(PERIOD) - 1)) + l.rest) / PERIOD;
    let found = textureSampleLevel(noise_volume, noise_sampler, place, level).rgb;
    // The first level has noise at points, the second means.
    let done = gradients::attenuation(vec2(short * min(level, 1.0)));
    return found * min(gradients::attenuation(widths_cells) / done, 1.0);
}

fn scalar(l: Lattice, widths_cells: vec2<f32>, seed: Seed) -> Filtered {
    let varies = gradients::DEVIATION * sqrt(gradients::missing(widths_cells));
    return Filtered(looked_up(l, widths_cells).x, varies);
}

fn vector(l: Lattice, widths_cells: vec2<f32>, seed: Seed) -> vec3<f32> {
    return looked_up(l, widths_cells);
}
