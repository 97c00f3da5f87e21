// Splats as quads, put together by the device's blending and depth test.

// N_PAYLOADS, vectors that each splat carries, is set where the text is put together; NORMALIZED stands for means within
// a tolerance of the nearest, FROM_NEAREST for distances that are counted from the nearest, PER_PIXEL for a pass with a
// function of its own for each pixel.

var<uniform> params: Params;
var<storage, read> footprints: array<Footprint>;
var<storage, read> payloads: array<vec4<f32>>;
// Splats in their order: their numbers, by rank.
var<storage, read> numbers: array<u32>;
// Distances behind which nothing is seen, by pixel; 0 where there is no end.
var<storage, read> surface: array<f32>;
// Splats behind which half of the light is not yet kept off, by pixel.
var<storage, read> passed: array<u32>;
// Number of the nearest, from 1, and the bits of its distance.
var nearest: texture_2d<u32>;

#ifdef PER_PIXEL
// What the splat carries at this pixel, once it has been seen.
var<private> carried: array<vec4<f32>, 4>;
#endif

struct Corner {
    @builtin(position) at: vec4<f32>,
    @location(0) @interpolate(flat) rank: u32,
}

fn corner(vertex: u32, rank: u32) -> Corner {
    let box = vec4<f32>(covered(footprints[numbers[rank]]));
    let is_end = vec2((vertex & 1u) == 1u, vertex >= 2u);
    let at = select(box.xy, box.zw, is_end) / vec2<f32>(params.size_px);
    return Corner(vec4(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, 0.0, 1.0), rank);
}

@vertex
fn from_near(@builtin(vertex_index) vertex: u32, @builtin(instance_index) rank: u32) -> Corner {
    return corner(vertex, rank);
}

@vertex
fn from_far(@builtin(vertex_index) vertex: u32, @builtin(instance_index) rank: u32) -> Corner {
    return corner(vertex, params.n - 1u - rank);
}

fn pixel_of(c: Corner) -> u32 {
    return u32(c.at.y) * params.size_px.x + u32(c.at.x);
}

// What a pixel sees of a splat, without what hides it.
fn seen(c: Corner) -> Hit {
    var hit = met(footprints[numbers[c.rank]], c.at.xy);
    if params.tested == 1u {
        let end = surface[pixel_of(c)];
        hit.inside = hit.inside && (end == 0.0 || hit.distance < end);
    }
#ifdef PER_PIXEL
    if hit.inside {
        let shown = shown_at(c.at.xy, hit, numbers[c.rank]);
        hit.opacity = shown.opacity;
        carried = shown.payload;
    }
#endif
    return hit;
}

// Channels of a splat: what it carries, then its distance, then what that is from the nearest, and the square.
fn channel(number: u32, distance: f32, origin: f32, at: u32) -> f32 {
    if at < 4u * N_PAYLOADS {
#ifdef PER_PIXEL
        return carried[at / 4u][at % 4u];
#else
        return payloads[number * N_PAYLOADS + at / 4u][at % 4u];
#endif
    }
    let apart = distance - origin;
    switch at - 4u * N_PAYLOADS {
        case 0u: { return distance; }
        case 1u: { return apart; }
        case 2u: { return apart * apart; }
        default: { return 0.0; }
    }
}

// Three channels of a splat and 1, times how much hides what is behind.
fn plane(number: u32, hit: Hit, origin: f32, k: u32) -> vec4<f32> {
    let d = hit.distance;
    let first = 3u * k;
    let channels = vec3(
        channel(number, d, origin, first),
        channel(number, d, origin, first + 1u),
        channel(number, d, origin, first + 2u),
    );
    return hit.opacity * vec4(channels, 1.0);
}

// The distance of the nearest; 0 where nothing is.
fn distance_of_nearest(c: Corner) -> f32 {
    let found = textureLoad(nearest, vec2<u32>(c.at.xy), 0);
    return select(0.0, bitcast<f32>(found.y), found.x > 0u);
}

// Where distances are counted from, and whether the splat is near enough to be added.
struct Reach {
    origin: f32,
    is_near: bool,
}

fn reach_of(c: Corner, distance: f32) -> Reach {
#ifdef NORMALIZED
    let origin = distance_of_nearest(c);
    return Reach(origin, origin > 0.0 && abs(distance - origin) <= origin * params.tolerance);
#else
#ifdef FROM_NEAREST
    return Reach(distance_of_nearest(c), true);
#else
    return Reach(0.0, true);
#endif
#endif
}

struct Picked {
    @location(0) found: vec2<u32>,
    @builtin(frag_depth) nearness: f32,
}

// Depths in the order of distances, the nearest first: whole numbers in the order of floats are turned around. Distances
// beyond 2^62 are as far as that one.
fn nearness_of(distance: f32) -> f32 {
    let bits = bitcast<u32>(clamp(distance, 0x1p-62f, 0x1p+62f)) - 0x20800000u;
    return bitcast<f32>(0x3f800000u - bits);
}

// The least opacity of a splat that hides all.
fn least_opacity(c: Corner, number: u32) -> f32 {
    switch params.composition {
        case 2u, 4u: { return 0.5; }
        case 3u: { return chance(vec2<u32>(c.at.xy), number, params.step); }
        default: { return 0.0; }
    }
}

// The nearest by the depth test, of equal distances the first.
@fragment
fn pick(c: Corner) -> Picked {
    let hit = seen(c);
    let number = numbers[c.rank];
    if !hit.inside || hit.opacity < least_opacity(c, number) {
        discard;
    }
    return Picked(vec2(number + 1u, bitcast<u32>(hit.distance)), nearness_of(hit.distance));
}

// What splats of ranks up to those that are tried hide.
@fragment
fn hide(c: Corner) -> @location(0) vec4<f32> {
    let hit = seen(c);
    if !hit.inside || c.rank >= passed[pixel_of(c)] + params.step {
        discard;
    }
    return vec4(hit.opacity);
}

// The distance of the splat that keeps off the second half of the light.
@fragment
fn middle(c: Corner) -> @location(0) f32 {
    let hit = seen(c);
    if !hit.inside || c.rank != passed[pixel_of(c)] {
        discard;
    }
    return hit.distance;
}
