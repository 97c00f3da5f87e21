// From what was drawn as quads to pictures.

// N_PAYLOADS and N_PLANES are set where the text is put together, and `plane_at`, which reads planes. MEDIAN and
// FROM_NEAREST stand for pictures that were drawn for this, NORMALIZED for means, DISTORTION for a third picture of
// depths, PER_PIXEL for a pass with a function of its own for each pixel.

#ifdef PER_PIXEL
var<storage, read> footprints: array<Footprint>;
#endif
var<uniform> params: Params;
var<storage, read> payloads: array<vec4<f32>>;
var nearest: texture_2d<u32>;
// How much is hidden by splats of ranks up to those that were tried, then the distance that was asked for.
var middle: texture_2d<f32>;
var<storage, read_write> passed: array<u32>;
// Pictures of vectors, one behind the other.
var<storage, read_write> sums: array<vec4<f32>>;
// Expected depths, then median ones, then distortion where it is asked for.
var<storage, read_write> depths: array<f32>;
// Of each pixel what tries have found: sums of distances and weights, median distance, what is let through; moments.
var<storage, read_write> tries: array<vec4<f32>>;

fn write_depths(pixel: vec2<u32>, distances: f32, weights: f32, median: f32, moments: vec4<f32>) {
    let n = params.depth_stride * params.size_px.y;
    let at = pixel.y * params.depth_stride + pixel.x;
    depths[at] = params.unit * select(0.0, distances / weights, weights > 0.0);
    depths[n + at] = params.unit * median;
#ifdef DISTORTION
    depths[2u * n + at] = distortion_of(moments);
#endif
}

fn place_of(pixel: vec2<u32>, k: u32) -> u32 {
    return (k * params.size_px.y + pixel.y) * params.stride + pixel.x;
}

// Half of the way is behind splats that hide less than half.
@compute @workgroup_size(8, 8)
fn halve(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= params.size_px) {
        return;
    }
    let at = id.y * params.size_px.x + id.x;
    if textureLoad(middle, id.xy, 0).x < 0.5 {
        passed[at] += params.step;
    }
}

// Adds the nearest of a try.
@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if any(pixel >= params.size_px) {
        return;
    }
    let at = 2u * (pixel.y * params.size_px.x + pixel.x);
    let is_first = params.step == 0u;
    var sum = vec4(0.0, 0.0, 0.0, 1.0);
    var moments = vec4(0.0);
    if !is_first {
        sum = tries[at];
        moments = tries[at + 1u];
    }
    let share = 1.0 / f32(params.samples);
    let found = textureLoad(nearest, pixel, 0);
    let distance = bitcast<f32>(found.y);
#ifdef PER_PIXEL
    var shown: surfelshop_splat::Fragment;
    if found.x > 0u {
        let at_px = vec2<f32>(pixel) + 0.5;
        shown = shown_at(at_px, met(footprints[found.x - 1u], at_px), found.x - 1u);
    }
#endif
    for (var k = 0u; k < N_PAYLOADS; k++) {
        let to = place_of(pixel, k);
        var payload = vec4(0.0);
        if !is_first {
            payload = sums[to];
        }
        if found.x > 0u {
#ifdef PER_PIXEL
            payload += share * shown.payload[k];
#else
            payload += share * payloads[(found.x - 1u) * N_PAYLOADS + k];
#endif
        }
        sums[to] = payload;
    }
    if found.x > 0u {
        sum.x += share * distance;
        sum.y += share;
        moments = with_moments(moments, share, distance);
        if sum.w > 0.5 && sum.w - share <= 0.5 {
            sum.z = distance;
        }
        sum.w -= share;
    }
    tries[at] = sum;
    tries[at + 1u] = moments;
    write_depths(pixel, sum.x, sum.y, sum.z, moments);
}

fn channel_of(pixel: vec2<u32>, at: u32) -> f32 {
    return plane_at(pixel, at / 3u)[at % 3u];
}

// Takes apart what was blended.
@compute @workgroup_size(8, 8)
fn finish(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if any(pixel >= params.size_px) {
        return;
    }
    let weights = plane_at(pixel, 0u).w;
#ifdef NORMALIZED
    let divisor = max(weights, 1.0);
#else
    let divisor = 1.0;
#endif
    for (var k = 0u; k < N_PAYLOADS; k++) {
        let a = 4u * k;
        let sum = vec4(
            channel_of(pixel, a),
            channel_of(pixel, a + 1u),
            channel_of(pixel, a + 2u),
            channel_of(pixel, a + 3u),
        );
        sums[place_of(pixel, k)] = sum / divisor;
    }
    var median = 0.0;
#ifdef NORMALIZED
    let found = textureLoad(nearest, pixel, 0);
    median = select(0.0, bitcast<f32>(found.y), found.x > 0u);
#endif
#ifdef MEDIAN
    median = textureLoad(middle, pixel, 0).x;
#endif
    var moments = vec4(0.0);
    let last = 4u * N_PAYLOADS;
#ifdef DISTORTION
    moments = vec4(0.0, vec3(weights, channel_of(pixel, last + 1u), channel_of(pixel, last + 2u)) / divisor);
#endif
#ifdef EXPECTED
    write_depths(pixel, channel_of(pixel, last), weights, median, moments);
#else
    write_depths(pixel, 0.0, 0.0, median, moments);
#endif
}
