// Turns what the surfels left behind into the surface buffer and its single-value pictures.

#import surfelshop::view
#import surfelshop::packing
#import surfelshop::surface

// Number and distance of the nearest surfels, see disc.wgsl.
var nearest: texture_2d<u32>;
var sum_normal_weight: texture_2d<f32>;
var sum_albedo_ao: texture_2d<f32>;
// The same sums in fixed point, for a band of rows; see accumulate_fixed.wgsl.
var<storage, read> fixed_sums: array<u32>;

struct Band {
    first: u32,
    rows: u32,
    channels: u32,
    scale: f32,
    albedo: vec3<f32>,
}

var<uniform> band: Band;

// Number of surfels whose sums are floats, where others' are in fixed point.
struct Total {
    surfels: u32,
}
var<storage, read> total: Total;

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

// Sums of a pixel in both kinds of numbers.
struct Sums {
    normal_weight: vec4<f32>,
    albedo_ao: vec4<f32>,
}

// A sum in fixed point, low and high word.
fn sum_in_words(at: u32) -> vec2<u32> {
    return vec2(fixed_sums[2u * at], fixed_sums[2u * at + 1u]);
}

// A number in two's complement; of negative ones the magnitude is rounded, not the difference of
// large words.
fn as_float(words: vec2<u32>) -> f32 {
    if i32(words.y) < 0 {
        return -(f32(~words.y) * 4294967296.0 + f32(~words.x) + 1.0) / band.scale;
    }
    return (f32(words.y) * 4294967296.0 + f32(words.x)) / band.scale;
}

fn difference(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    return vec2(a.x - b.x, a.y - b.y - select(0u, 1u, a.x < b.x));
}

// The sums in fixed point of a pixel inside the band.
fn sums_in_fixed_point(pixel: vec2<u32>) -> Sums {
    let at = band.channels * (pixel.x + (pixel.y - band.first) * u32(view::view.size_px.x));
    let weight = sum_in_words(at);
    // One was added to the components of normals: taken off before rounding to floats.
    let normal_weight = vec4(
        as_float(difference(sum_in_words(at + 1u), weight)),
        as_float(difference(sum_in_words(at + 2u), weight)),
        as_float(difference(sum_in_words(at + 3u), weight)),
        as_float(weight),
    );
    if band.channels == 4u {
        return Sums(normal_weight, vec4(band.albedo, 1.0) * normal_weight.w);
    }
    let albedo_ao = vec4(
        as_float(sum_in_words(at + 4u)),
        as_float(sum_in_words(at + 5u)),
        as_float(sum_in_words(at + 6u)),
        as_float(sum_in_words(at + 7u)),
    );
    return Sums(normal_weight, albedo_ao);
}

// From fixed-point sums, over a buffer that holds the nearest surfel already: where rounding at a
// disc's edge kept every surfel out of the sums, the nearest one stays.
@fragment
fn resolve_fixed(@builtin(position) p: vec4<f32>) -> @location(0) vec4<u32> {
    let pixel = vec2<u32>(p.xy);
    let depth = bitcast<f32>(textureLoad(nearest, pixel, 0).y);
    if depth <= 0.0 || pixel.y < band.first || pixel.y >= band.first + band.rows {
        discard;
    }
    let sums = sums_in_fixed_point(pixel);
    if sums.normal_weight.w <= 0.0 {
        discard;
    }
    return resolved(p, depth, sums.normal_weight, sums.albedo_ao);
}

// From both: those of small discs in fixed point, those of large ones in floats.
@fragment
fn resolve_both(@builtin(position) p: vec4<f32>) -> @location(0) vec4<u32> {
    let pixel = vec2<u32>(p.xy);
    let depth = bitcast<f32>(textureLoad(nearest, pixel, 0).y);
    if depth <= 0.0 || pixel.y < band.first || pixel.y >= band.first + band.rows {
        discard;
    }
    var sums = sums_in_fixed_point(pixel);
    if total.surfels > 0u {
        sums.normal_weight += textureLoad(sum_normal_weight, pixel, 0);
        sums.albedo_ao += textureLoad(sum_albedo_ao, pixel, 0);
    }
    if sums.normal_weight.w <= 0.0 {
        discard;
    }
    return resolved(p, depth, sums.normal_weight, sums.albedo_ao);
}

// One value of the surface as a picture. These are compute entry points because not every device
// can draw into 32-bit float textures.
var picture: texture_storage_2d<rgba32float, write>;
var distances: texture_storage_2d<r32float, write>;

fn show(pixel: vec2<u32>, covered: bool, value: vec3<f32>) {
    textureStore(picture, pixel, select(vec4(0.0), vec4(value, 1.0), covered));
}

fn outside(pixel: vec2<u32>) -> bool {
    return any(pixel >= textureDimensions(picture));
}

@compute @workgroup_size(8, 8)
fn depth_only(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= textureDimensions(distances)) {
        return;
    }
    let depth = bitcast<f32>(textureLoad(nearest, id.xy, 0).y);
    textureStore(distances, id.xy, vec4(select(0.0, depth * view::view.unit, depth > 0.0)));
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

// The distance of the nearest surfel and the number of its cloud.
@compute @workgroup_size(8, 8)
fn owner_only(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id.xy) {
        return;
    }
    let depth = bitcast<f32>(textureLoad(nearest, id.xy, 0).y);
    show(id.xy, depth > 0.0, vec3(depth * view::view.unit, f32(surface::object_at(id.xy)), 0.0));
}
