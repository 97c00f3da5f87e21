// Turns what the surfels left behind into the surface buffer and its single-value pictures.

#import surfelshop::view
#import surfelshop::packing
#import surfelshop::surface

// Number and distance of the nearest surfels, see disc.wgsl.
var nearest: texture_2d<u32>;
var sum_normal_weight: texture_2d<f32>;
var sum_albedo_ao: texture_2d<f32>;
// The same sums in fixed point, eight a pixel, for a band of rows.
var<storage, read> fixed_sums: array<i32>;

struct Band {
    first: u32,
    rows: u32,
}

var<uniform> band: Band;

// The surface of a pixel from its sums: divides by the weight.
fn resolved(p: vec4<f32>, distance: f32, sums: vec4<f32>, albedo_ao: vec4<f32>) -> vec4<u32> {
    let rest = albedo_ao / sums.w;
    // Normals of a fold can cancel; the direction to the eye then stands in. A mean shorter than
    // 1e-4 carries no direction that rounding has not made.
    var normal = sums.xyz;
    let length_squared = dot(normal, normal);
    if length_squared > 1e-8 * sums.w * sums.w {
        normal *= inverseSqrt(length_squared);
    } else {
        let position = view::position_in_view(p.xy, distance);
        normal = view::world_from_view_direction(view::to_eye_in_view(position));
    }
    return packing::pack_surface(distance, normal, rest.rgb, rest.a);
}

// From float sums. The nearest surfel is always among them, so the weight of a covered pixel is
// at least that of a disc's edge, times the smallest share the low-pass leaves.
@fragment
fn resolve(@builtin(position) p: vec4<f32>) -> @location(0) vec4<u32> {
    let pixel = vec2<u32>(p.xy);
    let depth = bitcast<f32>(textureLoad(nearest, pixel, 0).y);
    let sums = textureLoad(sum_normal_weight, pixel, 0);
    if depth <= 0.0 || sums.w <= 0.0 {
        return vec4(0u);
    }
    return resolved(p, depth, sums, textureLoad(sum_albedo_ao, pixel, 0));
}

// From fixed-point sums, over a buffer that holds the nearest surfel already: where rounding at a
// disc's edge kept every surfel out of the sums, the nearest one stays.
@fragment
fn resolve_fixed(@builtin(position) p: vec4<f32>) -> @location(0) vec4<u32> {
    let pixel = vec2<u32>(p.xy);
    let depth = bitcast<f32>(textureLoad(nearest, pixel, 0).y);
    if pixel.y < band.first || pixel.y >= band.first + band.rows {
        discard;
    }
    let at = 8u * (pixel.x + (pixel.y - band.first) * u32(view::view.size_px.x));
    let weight = fixed_sums[at + 3u];
    if depth <= 0.0 || weight <= 0 {
        discard;
    }
    let n = vec3(fixed_sums[at], fixed_sums[at + 1u], fixed_sums[at + 2u]);
    let a = vec3(fixed_sums[at + 4u], fixed_sums[at + 5u], fixed_sums[at + 6u]);
    let sums = vec4<f32>(vec4(n, weight));
    return resolved(p, depth, sums, vec4<f32>(vec4(a, fixed_sums[at + 7u])));
}

// One value of the surface as a picture. These are compute entry points because not every device
// can draw into 32-bit float textures.
var picture: texture_storage_2d<rgba32float, write>;

fn show(pixel: vec2<u32>, covered: bool, value: vec3<f32>) {
    textureStore(picture, pixel, select(vec4(0.0), vec4(value, 1.0), covered));
}

fn outside(pixel: vec2<u32>) -> bool {
    return any(pixel >= textureDimensions(picture));
}

@compute @workgroup_size(8, 8)
fn depth_only(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id.xy) {
        return;
    }
    let depth = bitcast<f32>(textureLoad(nearest, id.xy, 0).y);
    show(id.xy, depth > 0.0, vec3(depth * view::view.unit, 0.0, 0.0));
}

@compute @workgroup_size(8, 8)
fn normal_only(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id.xy) {
        return;
    }
    let s = surface::surface_at(id.xy);
    show(id.xy, s.covered, s.normal);
}

@compute @workgroup_size(8, 8)
fn albedo_only(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id.xy) {
        return;
    }
    let s = surface::surface_at(id.xy);
    show(id.xy, s.covered, s.albedo);
}

@compute @workgroup_size(8, 8)
fn ao_only(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id.xy) {
        return;
    }
    let s = surface::surface_at(id.xy);
    show(id.xy, s.covered, vec3(s.ao));
}

@vertex
fn cover_screen(@builtin(vertex_index) v: u32) -> @builtin(position) vec4<f32> {
    return vec4(f32(v & 1u) * 4.0 - 1.0, f32(v >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}
