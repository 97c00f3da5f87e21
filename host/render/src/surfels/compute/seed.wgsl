// Hands what compute found to stages that draw: number and distance of each pixel's nearest surfel,
// and its depth.

#import surfelshop::view

// See compute_visibility.wgsl: complements of number and distance.
var<storage, read> keys: array<vec2<u32>>;

struct Seed {
    // As disc.wgsl says.
    @location(0) number_distance: vec2<u32>,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn seed(@builtin(position) p: vec4<f32>) -> Seed {
    let pixel = vec2<u32>(p.xy);
    let key = keys[pixel.x + pixel.y * u32(view::view.size_px.x)];
    if key.y == 0u {
        return Seed(vec2(0u), 0.0);
    }
    let number = ~key.x;
    let distance = ~key.y;
    let clip = view::view.clip_from_view * vec4(0.0, 0.0, -bitcast<f32>(distance), 1.0);
    return Seed(vec2((number >> 1u) | (number << 31u), distance), clip.z / clip.w);
}
