// Puts the splats of each tile together: a workgroup goes through the tile's list in batches.

// N_PAYLOADS, vectors that each splat carries, is set where the text is put together. PER_PIXEL, where it is defined,
// stands for a pass with a function of its own for each pixel, NORMALIZED for means within a tolerance instead of the
// other compositions, DISTORTION for a third picture of depths. Devices bind few buffers, of which authors need some:
// NO_SURFACE and NO_DEPTHS leave out what a pass of the former kind does not look at, NO_BLENDING and NO_PICKING what
// composes otherwise, since drivers put the function wherever it is called.

var<uniform> params: Params;
var<storage, read> footprints: array<Footprint>;
var<storage, read> payloads: array<vec4<f32>>;
var<storage, read> entries: array<u32>;
var<storage, read> ranges: array<vec2<u32>>;
// Distances behind which nothing is seen, by pixel; 0 where there is no end.
var<storage, read> surface: array<f32>;
// Pictures of vectors, one behind the other.
var<storage, read_write> sums: array<vec4<f32>>;
// Expected depths, then median ones, then distortion where it is asked for.
var<storage, read_write> depths: array<f32>;

const LEAST_LEFT = 1e-4;
const BATCH = 64u;
const N_BATCHED = BATCH * N_PAYLOADS;

var<workgroup> batch: array<Footprint, 64>;
var<workgroup> batch_payloads: array<vec4<f32>, N_BATCHED>;
var<workgroup> batch_numbers: array<u32, 64>;
var<workgroup> n_open: atomic<u32>;
var<workgroup> is_open: u32;
var<workgroup> of_tile: vec2<u32>;

#ifdef PER_PIXEL
fn finite(v: vec4<f32>) -> vec4<f32> {
    return vec4(
        select(0.0, v.x, is_finite_number(v.x)),
        select(0.0, v.y, is_finite_number(v.y)),
        select(0.0, v.z, is_finite_number(v.z)),
        select(0.0, v.w, is_finite_number(v.w)),
    );
}

// What the pass's function makes of a splat of the batch at a pixel: an opacity from 0 to 1, and finite vectors.
fn shaded(hit: Hit, in_batch: u32, at_px: vec2<f32>) -> surfelshop_splat::Fragment {
    var p: surfelshop_splat::Pixel;
    p.index = batch_numbers[in_batch];
    p.pixel = at_px;
    p.place = hit.place;
    p.exponent = hit.exponent;
    p.depth = params.unit * hit.distance;
    p.opacity = hit.opacity;
    for (var k = 0u; k < N_PAYLOADS; k++) {
        p.payload[k] = batch_payloads[in_batch * N_PAYLOADS + k];
    }
    var f = FUNCTION_PER_PIXEL(p);
    let is_number = (bitcast<u32>(f.opacity) & 0x7fffffffu) <= 0x7f800000u;
    f.opacity = select(0.0, clamp(f.opacity, 0.0, 1.0), is_number);
    for (var k = 0u; k < N_PAYLOADS; k++) {
        f.payload[k] = finite(f.payload[k]);
    }
    return f;
}
#endif

// Of a pixel.
struct Sum {
    payload: array<vec4<f32>, N_PAYLOADS>,
    distances: f32,
    weights: f32,
#ifdef DISTORTION
    moments: vec4<f32>,
#endif
}

// Adds so much of a splat of the batch.
fn add(
    sum: ptr<function, Sum>,
    weight: f32,
    distance: f32,
    in_batch: u32,
#ifdef PER_PIXEL
    shown: surfelshop_splat::Fragment,
#endif
) {
    for (var k = 0u; k < N_PAYLOADS; k++) {
#ifdef PER_PIXEL
        (*sum).payload[k] += weight * shown.payload[k];
#else
        (*sum).payload[k] += weight * batch_payloads[in_batch * N_PAYLOADS + k];
#endif
    }
    add_distance(sum, weight, distance);
}

fn add_distance(sum: ptr<function, Sum>, weight: f32, distance: f32) {
    (*sum).distances += weight * distance;
    (*sum).weights += weight;
#ifdef DISTORTION
    (*sum).moments = with_moments((*sum).moments, weight, distance);
#endif
}

// Loads a batch of a tile's list; the number of splats in it.
fn load(thread: u32, first: u32, end: u32) -> u32 {
    workgroupBarrier();
    if thread < BATCH && first + thread < end {
        let number = entries[first + thread];
        batch[thread] = footprints[number];
        batch_numbers[thread] = number;
        for (var k = 0u; k < N_PAYLOADS; k++) {
            batch_payloads[thread * N_PAYLOADS + k] = payloads[number * N_PAYLOADS + k];
        }
    }
    workgroupBarrier();
    return min(end - first, BATCH);
}

@compute @workgroup_size(16, 16)
fn compose(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
    @builtin(workgroup_id) tile: vec3<u32>,
) {
    if thread == 0u {
        of_tile = ranges[tile.y * params.across + tile.x];
    }
    let range = workgroupUniformLoad(&of_tile);
    let pixel = id.xy;
    let is_pixel = all(pixel < params.size_px);
    let at_px = vec2<f32>(pixel) + 0.5;
    var end = 3.4e38;
#ifndef NO_SURFACE
    if params.tested == 1u && is_pixel {
        let found = surface[pixel.y * params.size_px.x + pixel.x];
        end = select(end, found, found > 0.0);
    }
#endif
    var sum = Sum();
    var left = select(0.0, 1.0, is_pixel);
    var median = 0.0;
#ifdef NORMALIZED
    // The nearest that is at least half opaque, then all about as far away.
    var nearest = 3.4e38;
    var is_shown = false;
    var reach = 0.0;
    for (var round = 0u; round < 2u; round++) {
        for (var first = range.x; first < range.y; first += BATCH) {
            let n = load(thread, first, range.y);
            for (var i = 0u; i < n; i++) {
                let hit = met(batch[i], at_px);
                let is_near = is_shown && abs(hit.distance - nearest) <= reach;
                let counts = select(hit.distance < nearest, is_near, round == 1u);
                if !is_pixel || !hit.inside || !counts || hit.distance >= end {
                    continue;
                }
#ifdef PER_PIXEL
                let shown = shaded(hit, i, at_px);
                let weight = shown.opacity;
#else
                let weight = hit.opacity;
#endif
                if round == 0u {
                    if weight >= 0.5 {
                        nearest = hit.distance;
                        reach = abs(nearest) * params.tolerance;
                        is_shown = true;
                    }
                    continue;
                }
#ifdef PER_PIXEL
                if weight <= 0.0 {
                    continue;
                }
#endif
#ifdef PER_PIXEL
                add(&sum, weight, hit.distance, i, shown);
#else
                add(&sum, weight, hit.distance, i);
#endif
            }
        }
    }
    median = select(0.0, nearest, is_shown);
    let divisor = max(sum.weights, 1.0);
    for (var k = 0u; k < N_PAYLOADS; k++) {
        sum.payload[k] /= divisor;
    }
#ifdef DISTORTION
    sum.moments = vec4(sum.moments.x, sum.moments.yzw / divisor);
#endif
#else
#ifndef NO_BLENDING
    if params.composition < 2u {
        for (var first = range.x; first < range.y; first += BATCH) {
            let n = load(thread, first, range.y);
            for (var i = 0u; i < n; i++) {
                let hit = met(batch[i], at_px);
                if !hit.inside || left <= 0.0 || hit.distance >= end {
                    continue;
                }
#ifdef PER_PIXEL
                let shown = shaded(hit, i, at_px);
                if shown.opacity <= 0.0 {
                    continue;
                }
                var weight = shown.opacity;
#else
                var weight = hit.opacity;
#endif
                if params.composition == 0u {
                    weight *= left;
                    if left > 0.5 && left - weight <= 0.5 {
                        median = hit.distance;
                    }
                    left -= weight;
                    left = select(left, 0.0, left < LEAST_LEFT);
                }
#ifdef PER_PIXEL
                add(&sum, weight, hit.distance, i, shown);
#else
                add(&sum, weight, hit.distance, i);
#endif
            }
            // All leave where nothing is let through any more.
            if thread == 0u {
                atomicStore(&n_open, 0u);
            }
            workgroupBarrier();
            if left > 0.0 {
                atomicAdd(&n_open, 1u);
            }
            workgroupBarrier();
            if thread == 0u {
                is_open = atomicLoad(&n_open);
            }
            if workgroupUniformLoad(&is_open) == 0u {
                break;
            }
        }
    }
#endif
#ifndef NO_PICKING
    if params.composition >= 2u {
        let samples = select(1u, params.samples, params.composition == 3u);
        let share = 1.0 / f32(samples);
        for (var sample = 0u; sample < samples; sample++) {
            var nearest = 3.4e38;
            var shown = 0xffffffffu;
#ifdef PER_PIXEL
            var shown_payload: array<vec4<f32>, 4>;
#endif
            for (var first = range.x; first < range.y; first += BATCH) {
                let n = load(thread, first, range.y);
                for (var i = 0u; i < n; i++) {
                    let hit = met(batch[i], at_px);
                    var least = 0.5;
                    if params.composition == 3u {
                        least = chance(pixel, batch_numbers[i], sample);
                    }
                    let is_nearer = hit.distance < nearest
                        || (hit.distance == nearest && batch_numbers[i] < shown);
#ifdef PER_PIXEL
                    if is_pixel && hit.inside && is_nearer && hit.distance < end {
                        let made = shaded(hit, i, at_px);
                        if made.opacity > 0.0 && made.opacity >= least {
                            nearest = hit.distance;
                            shown = batch_numbers[i];
                            shown_payload = made.payload;
                        }
                    }
#else
                    if hit.inside && hit.opacity >= least && is_nearer && hit.distance < end {
                        nearest = hit.distance;
                        shown = batch_numbers[i];
                    }
#endif
                }
            }
            if shown != 0xffffffffu && is_pixel {
                for (var k = 0u; k < N_PAYLOADS; k++) {
#ifdef PER_PIXEL
                    sum.payload[k] += share * shown_payload[k];
#else
                    sum.payload[k] += share * payloads[shown * N_PAYLOADS + k];
#endif
                }
                add_distance(&sum, share, nearest);
                if left > 0.5 && left - share <= 0.5 {
                    median = nearest;
                }
                left -= share;
            }
        }
    }
#endif
#endif
    if !is_pixel {
        return;
    }
    let n_texels = params.stride * params.size_px.y;
    for (var k = 0u; k < N_PAYLOADS; k++) {
        sums[k * n_texels + pixel.y * params.stride + pixel.x] = sum.payload[k];
    }
#ifndef NO_DEPTHS
    let at = pixel.y * params.depth_stride + pixel.x;
    depths[at] = params.unit * select(0.0, sum.distances / sum.weights, sum.weights > 0.0);
    depths[params.depth_stride * params.size_px.y + at] = params.unit * median;
#ifdef DISTORTION
    depths[2u * params.depth_stride * params.size_px.y + at] = distortion_of(sum.moments);
#endif
#endif
}
