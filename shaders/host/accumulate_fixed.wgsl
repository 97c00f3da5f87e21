// Adds up surfels in 32-bit fixed point, one invocation per surfel, for devices that cannot blend
// into 32-bit float textures.
//
// Follows the same rule as the drawn quads: a surfel counts where its disc, brought nearer by the
// depth tolerance, is not behind the nearest surfel, and is seen from the same side.

var nearest: texture_2d<u32>;
// Eight sums a pixel: normal x y z, weight, albedo r g b, accessibility.
var<storage, read_write> sums: array<atomic<i32>>;

// One unit of the sums is 2^-18: a weight of 1 may be added 4,096 times before SATURATED, and the
// smallest weight of a disc's edge, 0.018, is kept to one part in 4,800; that of a surfel far below
// a pixel to one in 47, since its share is not taken below a hundredth here.
const SCALE = 262144.0;
const MIN_FIXED_SHARE = 0.01;
// No more is added to a pixel beyond this weight, half of what 32 bits hold.
const SATURATED = 1073741824;
// Albedos above this are clamped in this path, so that their sums stay inside 32 bits.
const MAX_ALBEDO = 1.9;
// Distances of the nearest stage come from interpolation, these from the plane equation: both
// are good to a few units in the last place.
const SLACK = 1.00001;

// First row of the picture that `sums` holds, and how many it holds.
struct Band {
    first: u32,
    rows: u32,
}

var<uniform> band: Band;

// Pixels that a sphere around the disc may cover, as first and behind-last.
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

@compute @workgroup_size(64)
fn accumulate(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let i = (id.x + id.y * groups.x * 64u) * chunk.stride;
    if i >= chunk.count {
        return;
    }
    let disc = load_disc(i);
    if !disc.visible {
        return;
    }
    let plane = cross(disc.axis_u, disc.axis_v);
    let share = max(disc.share, MIN_FIXED_SHARE);
    let box = pixel_box(disc);
    let albedo = min(load_albedo(i), vec3(MAX_ALBEDO));
    let access = load_ao(i);
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
            if !(abs(slope) > 0.0) || !(distance >= view::view.near) {
                continue;
            }
            let r2 = dot(corner, corner);
            if !(r2 <= 1.0) {
                continue;
            }
            let winner = textureLoad(nearest, pixel, 0).xy;
            let behind = distance_brought_nearer(distance, disc) > bitcast<f32>(winner.y) * SLACK;
            let is_nearest = (winner.x & INDEX_MASK) == chunk.first + i;
            if (behind && !is_nearest) || winner.x >> BACK_BIT != disc.back {
                continue;
            }
            add(u32(x) + (u32(y) - band.first) * u32(view::view.size_px.x), splat_weight(r2) * share, disc, albedo, access);
        }
    }
}

fn add(pixel: u32, weight: f32, disc: Disc, albedo: vec3<f32>, access: f32) {
    let w = weight * SCALE;
    let at = 8u * pixel;
    let own = i32(w + 0.5);
    if atomicAdd(&sums[at + 3u], own) > SATURATED {
        atomicSub(&sums[at + 3u], own);
        return;
    }
    let n = vec3<i32>(round(disc.normal * w));
    let a = vec3<i32>(round(albedo * w));
    atomicAdd(&sums[at], n.x);
    atomicAdd(&sums[at + 1u], n.y);
    atomicAdd(&sums[at + 2u], n.z);
    atomicAdd(&sums[at + 4u], a.x);
    atomicAdd(&sums[at + 5u], a.y);
    atomicAdd(&sums[at + 6u], a.z);
    atomicAdd(&sums[at + 7u], i32(access * w + 0.5));
}
