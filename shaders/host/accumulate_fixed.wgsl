// Adds up surfels in fixed point, one invocation per surfel: what integers add up to does not depend
// on the order. For surfels whose visibility was computed, and for devices that cannot blend
// into 32-bit float textures; behind footprint.wgsl.
//
// Follows the same rule as the drawn quads: a surfel counts where its disc, brought nearer by the
// depth tolerance, is not behind the nearest surfel, and is seen from the same side.

var nearest: texture_2d<u32>;

// Sums of each pixel: weight, normal x y z and, unless PLAIN, albedo r g b, accessibility. To the
// components of normals one is added, so that no sum is negative.
#ifdef ATOMIC64_ALL
var<storage, read_write> sums: array<atomic<u64>>;
#else
var<storage, read_write> sums: array<atomic<u32>>;
#endif

struct Band {
    // First row of the picture that `sums` holds, and how many it holds.
    first: u32,
    rows: u32,
    // Sums of each pixel.
    channels: u32,
    // What a weight of 1 is in the sums.
    scale: f32,
    // Words of each sum: 1 or 2.
    words: u32,
    // The albedo of all surfels, where it is not added up.
    albedo: vec3<f32>,
}

var<uniform> band: Band;

#ifdef COMPUTED
// See compute_visibility.wgsl.
var<storage, read> boxes: array<vec2<u32>>;
#endif

#ifdef ATOMIC64_ALL
// Sums of 64 bits hold 2^27 weights of 1, and the smallest share's weight at a disc's edge to one
// part in a thousand.
const MIN_NEAREST_SHARE = 0.0;
// As the surface buffer.
const MAX_ALBEDO = 65504.0;
#else
// The nearest surfel's share counts at least as much, so that its weight at the disc's edge, 0.018,
// stays a few dozen units of the sums and no covered pixel's sums are empty. Others keep theirs: at
// silhouettes far below a pixel there are many of tiny shares, which must not outweigh the rest.
const MIN_NEAREST_SHARE = 0.005;
// No more is added to a pixel beyond this weight: the sums of normals, which are up to twice as
// large, then stay inside 32 bits.
const SATURATED = 1073741824u;
// Albedos above this are clamped in this path, for the same reason.
const MAX_ALBEDO = 3.5;
#endif
#ifdef LARGE_ARE_DRAWN
// Distances of all small discs come from the same equation.
const SLACK = 1.0;
#else
// Distances of the nearest stage come from interpolation, these from the plane equation: both
// are good to a few units in the last place.
const SLACK = 1.00001;
#endif

// What a surfel adds.
struct Splat {
    number: u32,
    share: f32,
    normal: vec3<f32>,
    albedo: vec3<f32>,
    access: f32,
}

@compute @workgroup_size(64)
fn accumulate(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let drawn = id.x + id.y * groups.x * 64u;
    let i = drawn * chunk.stride;
    if i >= chunk.count {
        return;
    }
#ifdef COMPUTED
    let box = boxes[drawn];
    let kind = box.y >> 16u;
    if kind == NOTHING {
        return;
    }
#ifdef LARGE_ARE_DRAWN
    if kind == LARGE {
        return;
    }
#endif
#endif
    let disc = load_disc(i);
    if !disc.visible {
        return;
    }
    let albedo = min(load_albedo(i), vec3(MAX_ALBEDO));
    let splat = Splat(chunk.first + i, disc.share, disc.normal, albedo, load_ao(i));
    var footprint = footprint_of(disc);
    if !footprint.whole {
        through_sphere(disc, splat);
        return;
    }
#ifdef COMPUTED
    if kind == SMALL {
        footprint.first = vec2<i32>(vec2(box.x & 0xffffu, box.x >> 16u));
        footprint.extent = vec2<i32>(vec2(box.y & 255u, (box.y >> 8u) & 255u));
    }
#endif
    through_box(footprint, disc, splat);
}

// Goes through the pixels of a disc that lies wholly before the near plane.
fn through_box(footprint: Footprint, disc: Disc, splat: Splat) {
    let n = footprint.extent.x * footprint.extent.y;
    var at = vec2(0);
    for (var k = 0; k < n; k++) {
        let pixel = footprint.first + at;
        at.x++;
        if at.x == footprint.extent.x {
            at = vec2(0, at.y + 1);
        }
        let crossing = crossing_at(footprint, pixel);
        add_where_seen(pixel, crossing, disc, splat);
    }
}

fn add_where_seen(pixel: vec2<i32>, crossing: Crossing, disc: Disc, splat: Splat) {
    let row = u32(pixel.y) - band.first;
    if !(crossing.r2 <= 1.0) || row >= band.rows {
        return;
    }
    let winner = textureLoad(nearest, pixel, 0).xy;
    let is_nearest = (winner.x & INDEX_MASK) == splat.number;
    let behind = distance_brought_nearer(crossing.distance, disc) > bitcast<f32>(winner.y) * SLACK;
    if (behind && !is_nearest) || winner.x >> BACK_BIT != disc.back {
        return;
    }
    let at = u32(pixel.x) + row * u32(view::view.size_px.x);
    let share = max(splat.share, select(0.0, MIN_NEAREST_SHARE, is_nearest));
    let weight = splat_weight(crossing.r2) * share * band.scale;
    if weight >= 0.5 {
        add(at, weight, splat);
    }
}

// Pixels that a sphere around a disc may cover, as first and behind-last.
fn pixel_box(disc: Disc) -> vec4<i32> {
    let size = view::view.size_px;
    let reach = disc.reach;
    let d = -disc.center.z;
    var low = vec2(-1.0);
    var high = vec2(1.0);
    if view::view.orthographic == 1u {
        low = (disc.center.xy - reach) / view::view.half_extent;
        high = (disc.center.xy + reach) / view::view.half_extent;
    } else if d + reach < view::view.near {
        return vec4(0);
    } else if d - reach > view::view.near {
        let a = (disc.center.xy - reach) / view::view.half_extent;
        let b = (disc.center.xy + reach) / view::view.half_extent;
        low = min(a / (d - reach), a / (d + reach));
        high = max(b / (d - reach), b / (d + reach));
    }
    let first = floor(clamp((vec2(low.x, -high.y) * 0.5 + 0.5) * size, vec2(0.0), size));
    let last = ceil(clamp((vec2(high.x, -low.y) * 0.5 + 0.5) * size, vec2(0.0), size));
    return vec4(vec2<i32>(first), vec2<i32>(last));
}

// Goes through the pixels of a disc that reaches behind the near plane.
fn through_sphere(disc: Disc, splat: Splat) {
    let plane = cross(disc.axis_u, disc.axis_v);
    let box = pixel_box(disc);
    let top = max(box.y, i32(band.first));
    let bottom = min(box.w, i32(band.first + band.rows));
    for (var y = top; y < bottom; y++) {
        for (var x = box.x; x < box.z; x++) {
            let pixel = vec2(x, y);
            var origin = vec3(0.0);
            var ray = view::position_in_view(vec2<f32>(pixel) + 0.5, 1.0);
            if view::view.orthographic == 1u {
                origin = vec3(ray.xy, 0.0);
                ray = vec3(0.0, 0.0, -1.0);
            }
            // Where the ray meets the plane, by Cramer's rule: unlike the difference of that
            // point and the centre, the triple products stay precise for a disc that is long in
            // depth and a pixel wide on the screen.
            let slope = dot(plane, ray);
            let to_center = disc.center - origin;
            let across_ray = cross(to_center, ray);
            let corner = vec2(dot(across_ray, disc.axis_v), -dot(across_ray, disc.axis_u)) / slope;
            let distance = -(disc.center.z + corner.x * disc.axis_u.z + corner.y * disc.axis_v.z);
            if abs(slope) > 0.0 && distance >= view::view.near {
                add_where_seen(pixel, Crossing(dot(corner, corner), distance), disc, splat);
            }
        }
    }
}

// Adds a splat to a pixel's sums with a weight in their units.
#ifdef ATOMIC64_ALL
fn add(pixel: u32, w: f32, splat: Splat) {
    let n = (splat.normal + 1.0) * w;
    let at = band.channels * pixel;
    atomicAdd(&sums[at], u64(w));
    atomicAdd(&sums[at + 1u], u64(n.x));
    atomicAdd(&sums[at + 2u], u64(n.y));
    atomicAdd(&sums[at + 3u], u64(n.z));
#ifndef PLAIN
    let a = splat.albedo * w;
    atomicAdd(&sums[at + 4u], u64(a.r));
    atomicAdd(&sums[at + 5u], u64(a.g));
    atomicAdd(&sums[at + 6u], u64(a.b));
    atomicAdd(&sums[at + 7u], u64(splat.access * w));
#endif
}
#else
fn add(pixel: u32, w: f32, splat: Splat) {
    let n = vec3<u32>((splat.normal + 1.0) * w + 0.5);
    let at = band.channels * pixel;
    let own = u32(w + 0.5);
    if atomicAdd(&sums[at], own) > SATURATED {
        atomicSub(&sums[at], own);
        return;
    }
    atomicAdd(&sums[at + 1u], n.x);
    atomicAdd(&sums[at + 2u], n.y);
    atomicAdd(&sums[at + 3u], n.z);
#ifndef PLAIN
    let a = vec3<u32>(splat.albedo * w + 0.5);
    atomicAdd(&sums[at + 4u], a.x);
    atomicAdd(&sums[at + 5u], a.y);
    atomicAdd(&sums[at + 6u], a.z);
    atomicAdd(&sums[at + 7u], u32(splat.access * w + 0.5));
#endif
}
#endif
