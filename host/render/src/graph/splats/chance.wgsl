// Chance that is the same in every frame.

fn hash(number: u32) -> u32 {
    var h = number;
    h = (h ^ (h >> 16u)) * 0x7feb352du;
    h = (h ^ (h >> 15u)) * 0x846ca68bu;
    return h ^ (h >> 16u);
}

// A number from 0 to 1 of a pixel, a splat and a sample.
fn chance(pixel: vec2<u32>, number: u32, sample: u32) -> f32 {
    let seed = hash(number ^ (sample * 0x9e3779b9u));
    return f32(hash(((pixel.y << 16u) | pixel.x) ^ seed) >> 8u) / 16777216.0;
}
