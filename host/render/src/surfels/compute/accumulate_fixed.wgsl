// Adds up surfels in fixed point, one invocation per surfel: what integers add up to does not depend
// on the order. For surfels whose visibility was computed, and for devices that cannot blend
// into 32-bit float textures; behind footprint.wgsl.
//
// Follows the same rule as the drawn quads: a surfel counts where its disc, brought nearer by the
// depth tolerance, is not behind the nearest surfel, and is seen from the same side.

var nearest: texture_2d<u32>;

// Sums of each pixel: weight, normal x y z and, unless PLAIN, albedo r g b, accessibility. To the
// components of normals one is added, so that no sum is negative. All sums have 64 bits, in two words
// where the device adds no longer ones: they hold 2^27 weights of 1, and the smallest share's weight at
// a disc's edge to one part in a thousand.
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
    // The albedo of all surfels, where it is not added up.
    albedo: vec3<f32>,
}

var<uniform> band: Band;

#ifdef COMPUTED
// See compute_visibility.wgsl.
var<storage, read> boxes: array<vec2<u32>>;
#endif

// As the surface buffer.
const MAX_ALBEDO = 65504.0;
// What a unit of a sum's high word is.
const WORD = 4294967296.0;
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
#ifdef CLIP
    cut: Cut,
#endif
#ifdef FIELD
    field: NormalField,
#endif
}

@compute @workgroup_size(64)
fn accumulate(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let drawn = id.x + id.y * groups.x * 64u;
    let i = surfel_drawn_by(drawn);
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
    var splat: Splat;
    splat.number = chunk.first + i;
    splat.share = disc.share;
    splat.normal = disc.normal;
    splat.albedo = seen_albedo(i, disc.back);
    splat.access = load_ao(i);
#ifdef CLIP
    splat.cut = load_cut(i, disc);
#endif
#ifdef FIELD
    splat.field = load_field(i, disc);
#endif
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
#ifdef CLIP
    if is_cut_off(sides_of(splat.cut, crossing.at)) {
        return;
    }
#endif
    let winner = textureLoad(nearest, pixel, 0).xy;
    let is_nearest = (winner.x & INDEX_MASK) == splat.number;
    let behind = distance_brought_nearer(crossing.distance, disc) > bitcast<f32>(winner.y) * SLACK;
    if (behind && !is_nearest) || winner.x >> BACK_BIT != disc.back {
        return;
    }
    let at = u32(pixel.x) + row * u32(view::view.size_px.x);
    let weight = splat_weight(crossing.r2) * splat.share * band.scale;
    if weight >= 0.5 {
#ifdef FIELD
        let normal = normalize(normal_on(splat.field, crossing.at));
#else
        let normal = splat.normal;
#endif
        add(at, weight, normal, splat);
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
    let shift = view::shift_px();
    let first = floor(clamp((vec2(low.x, -high.y) * 0.5 + 0.5) * size - shift, vec2(0.0), size));
    let last = ceil(clamp((vec2(high.x, -low.y) * 0.5 + 0.5) * size - shift, vec2(0.0), size));
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
                add_where_seen(pixel, Crossing(dot(corner, corner), distance, corner), disc, splat);
            }
        }
    }
}

// Adds a splat to a pixel's sums with a weight in their units.
fn add(pixel: u32, w: f32, normal: vec3<f32>, splat: Splat) {
    let n = (normal + 1.0) * w;
    let at = band.channels * pixel;
    add_to(at, w);
    add_to(at + 1u, n.x);
    add_to(at + 2u, n.y);
    add_to(at + 3u, n.z);
#ifndef PLAIN
    let a = min(splat.albedo, vec3(MAX_ALBEDO)) * w;
    add_to(at + 4u, a.r);
    add_to(at + 5u, a.g);
    add_to(at + 6u, a.b);
    add_to(at + 7u, splat.access * w);
#endif
}

// Adds the whole part of a value, not negative, to a sum.
#ifdef ATOMIC64_ALL
fn add_to(at: u32, value: f32) {
    atomicAdd(&sums[at], u64(value));
}
#else
fn add_to(at: u32, value: f32) {
    // Both words are exact: a float has 24 bits.
    let high = floor(value / WORD);
    let low = u32(value - high * WORD);
    let before = atomicAdd(&sums[2u * at], low);
    // Whoever makes the low word overflow carries.
    let carried = u32(high) + select(0u, 1u, before > ~low);
    if carried > 0u {
        atomicAdd(&sums[2u * at + 1u], carried);
    }
}
#endif
