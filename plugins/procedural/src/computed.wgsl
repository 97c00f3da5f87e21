// Noise computed where it is needed.
//
// The same functions as in volume.wgsl: the renderer brings one of the two along as
// `procedural::field`.
#import surfelshop::noise::{Lattice, Seed}
#import surfelshop::noise as gradients
#import surfelshop::filtered::Filtered

// Noise over a pixel of such widths, cells.
fn scalar(l: Lattice, widths_cells: vec2<f32>, seed: Seed) -> Filtered {
    return gradients::over_pixel(gradients::scalar(l, seed), widths_cells);
}

// Three such noises at the pixel's centre, faded.
fn vector(l: Lattice, widths_cells: vec2<f32>, seed: Seed) -> vec3<f32> {
    return gradients::vector(l, seed) * gradients::attenuation(widths_cells);
}
