// Puts the splats of each tile together where the processor computes: an invocation goes through the tile's list for a
// run of pixels, and fetches each splat once for all of them. Processors that pretend to be devices fetch what
// invocations ask for one by one, and pay for what invocations share and wait for.

// Lines with EACH stand for one of each pixel of a run. The rest is as in `compose_splats.wgsl`, whose sums
// have the same order; PLANAR or CONIC say what the footprints are.

var<uniform> params: Params;
var<storage, read> footprints: array<Footprint>;
var<storage, read> payloads: array<vec4<f32>>;
var<storage, read> entries: array<u32>;
var<storage, read> ranges: array<vec2<u32>>;
var<storage, read> surface: array<f32>;
var<storage, read_write> sums: array<vec4<f32>>;
var<storage, read_write> depths: array<f32>;

const LEAST_LEFT = 1e-4;
const FARTHEST = 3.4e38;
const NOTHING = 0xffffffffu;

// What a splat carries; the first N_PAYLOADS count.
struct Vectors {
    a: vec4<f32>,
    b: vec4<f32>,
    c: vec4<f32>,
    d: vec4<f32>,
}

// A pixel while the list is gone through.
struct Open {
    pixel: vec2<u32>,
    at_px: vec2<f32>,
    // The distance at which nothing more is seen.
    end: f32,
    left: f32,
    median: f32,
    sum: Vectors,
    distances: f32,
    weights: f32,
#ifdef DISTORTION
    moments: vec4<f32>,
#endif
    // The nearest so far, and what it carries where a function of pixels made that.
    nearest: f32,
    shown: u32,
    made: Vectors,
}

fn vectors_of(number: u32) -> Vectors {
    let first = number * N_PAYLOADS;
    var v = Vectors();
    v.a = payloads[first];
    if N_PAYLOADS > 1u {
        v.b = payloads[first + 1u];
    }
    if N_PAYLOADS > 2u {
        v.c = payloads[first + 2u];
    }
    if N_PAYLOADS > 3u {
        v.d = payloads[first + 3u];
    }
    return v;
}

#ifdef PER_PIXEL
fn finite(v: vec4<f32>) -> vec4<f32> {
    return vec4(
        select(0.0, v.x, is_finite_number(v.x)),
        select(0.0, v.y, is_finite_number(v.y)),
        select(0.0, v.z, is_finite_number(v.z)),
        select(0.0, v.w, is_finite_number(v.w)),
    );
}
#endif

// An opacity from 0 to 1, and finite vectors.
struct Shown {
    opacity: f32,
    carries: Vectors,
}

// A splat at a pixel: what it is, or what the pass's function makes of it.
fn shown_at(at_px: vec2<f32>, hit: Hit, v: Vectors, number: u32) -> Shown {
#ifdef PER_PIXEL
    var p: surfelshop_splat::Pixel;
    p.index = number;
    p.pixel = at_px;
    p.place = hit.place;
    p.exponent = hit.exponent;
    p.depth = params.unit * hit.distance;
    p.opacity = hit.opacity;
    p.payload[0] = v.a;
    p.payload[1] = v.b;
    p.payload[2] = v.c;
    p.payload[3] = v.d;
    let f = FUNCTION_PER_PIXEL(p);
    let is_number = (bitcast<u32>(f.opacity) & 0x7fffffffu) <= 0x7f800000u;
    let opacity = select(0.0, clamp(f.opacity, 0.0, 1.0), is_number);
    let made = Vectors(
        finite(f.payload[0]), finite(f.payload[1]), finite(f.payload[2]), finite(f.payload[3])
    );
    return Shown(opacity, made);
#else
    return Shown(hit.opacity, v);
#endif
}

fn add(p: ptr<function, Open>, weight: f32, distance: f32, v: Vectors) {
    (*p).sum.a += weight * v.a;
    if N_PAYLOADS > 1u {
        (*p).sum.b += weight * v.b;
    }
    if N_PAYLOADS > 2u {
        (*p).sum.c += weight * v.c;
    }
    if N_PAYLOADS > 3u {
        (*p).sum.d += weight * v.d;
    }
    (*p).distances += weight * distance;
    (*p).weights += weight;
#ifdef DISTORTION
    (*p).moments = with_moments((*p).moments, weight, distance);
#endif
}

fn opened(pixel: vec2<u32>) -> Open {
    var p = Open();
    let is_pixel = all(pixel < params.size_px);
    p.pixel = pixel;
    p.at_px = vec2<f32>(pixel) + 0.5;
    p.left = select(0.0, 1.0, is_pixel);
    // Nothing is before the end of what is no pixel.
    p.end = select(-FARTHEST, FARTHEST, is_pixel);
    p.nearest = FARTHEST;
    p.shown = NOTHING;
#ifndef NO_SURFACE
    if params.tested == 1u && is_pixel {
        let found = surface[pixel.y * params.size_px.x + pixel.x];
        p.end = select(p.end, found, found > 0.0);
    }
#endif
    return p;
}

#ifdef NORMALIZED
// The nearest that is at least half opaque, then all about as far away.
fn see(p: ptr<function, Open>, hit: Hit, v: Vectors, number: u32, round: u32) {
    let reach = abs((*p).nearest) * params.tolerance;
    let is_near = (*p).shown != NOTHING && abs(hit.distance - (*p).nearest) <= reach;
    let counts = select(hit.distance < (*p).nearest, is_near, round == 1u);
    if hit.inside && counts && hit.distance < (*p).end {
        let shown = shown_at((*p).at_px, hit, v, number);
        if round == 1u && shown.opacity > 0.0 {
            add(p, shown.opacity, hit.distance, shown.carries);
        }
        if round == 0u && shown.opacity >= 0.5 {
            (*p).nearest = hit.distance;
            (*p).shown = number;
        }
    }
}

fn end_round(p: ptr<function, Open>, round: u32) {
    if round == 1u {
        (*p).median = select(0.0, (*p).nearest, (*p).shown != NOTHING);
        let divisor = max((*p).weights, 1.0);
        (*p).sum.a /= divisor;
        (*p).sum.b /= divisor;
        (*p).sum.c /= divisor;
        (*p).sum.d /= divisor;
#ifdef DISTORTION
        (*p).moments = vec4((*p).moments.x, (*p).moments.yzw / divisor);
#endif
    }
}
#else
#ifdef NO_PICKING
// Adds it over what is behind, or as it is.
fn see(p: ptr<function, Open>, hit: Hit, v: Vectors, number: u32, round: u32) {
    if hit.inside && (*p).left > 0.0 && hit.distance < (*p).end {
        let shown = shown_at((*p).at_px, hit, v, number);
        var weight = shown.opacity;
        if params.composition == 0u {
            let left = (*p).left;
            weight *= left;
            let rest = left - weight;
            (*p).median = select((*p).median, hit.distance, left > 0.5 && rest <= 0.5);
            (*p).left = select(rest, 0.0, rest < LEAST_LEFT);
        }
        if shown.opacity > 0.0 {
            add(p, weight, hit.distance, shown.carries);
        }
    }
}

fn end_round(p: ptr<function, Open>, round: u32) {}
#else
// Keeps the nearest of those that are drawn.
fn see(p: ptr<function, Open>, hit: Hit, v: Vectors, number: u32, round: u32) {
    let is_nearer = hit.distance < (*p).nearest
        || (hit.distance == (*p).nearest && number < (*p).shown);
    if hit.inside && is_nearer && hit.distance < (*p).end {
        let shown = shown_at((*p).at_px, hit, v, number);
        var least = 0.5;
        if params.composition == 3u {
            least = chance((*p).pixel, number, round);
        }
        if shown.opacity >= least && (shown.opacity > 0.0 || !IS_PER_PIXEL) {
            (*p).nearest = hit.distance;
            (*p).shown = number;
            (*p).made = shown.carries;
        }
    }
}

fn end_round(p: ptr<function, Open>, round: u32) {
    if (*p).shown != NOTHING {
        let share = 1.0 / f32(rounds());
        let left = (*p).left;
        add(p, share, (*p).nearest, (*p).made);
        (*p).median = select((*p).median, (*p).nearest, left > 0.5 && left - share <= 0.5);
        (*p).left = left - share;
    }
    (*p).nearest = FARTHEST;
    (*p).shown = NOTHING;
}
#endif
#endif

// How often lists are gone through.
fn rounds() -> u32 {
#ifdef NORMALIZED
    return 2u;
#else
#ifdef NO_PICKING
    return 1u;
#else
    return select(1u, params.samples, params.composition == 3u);
#endif
#endif
}

fn store(p: Open) {
    if any(p.pixel >= params.size_px) {
        return;
    }
    let n_texels = params.stride * params.size_px.y;
    let at_sum = p.pixel.y * params.stride + p.pixel.x;
    sums[at_sum] = p.sum.a;
    if N_PAYLOADS > 1u {
        sums[n_texels + at_sum] = p.sum.b;
    }
    if N_PAYLOADS > 2u {
        sums[2u * n_texels + at_sum] = p.sum.c;
    }
    if N_PAYLOADS > 3u {
        sums[3u * n_texels + at_sum] = p.sum.d;
    }
#ifndef NO_DEPTHS
    let at = p.pixel.y * params.depth_stride + p.pixel.x;
    depths[at] = params.unit * select(0.0, p.distances / p.weights, p.weights > 0.0);
    depths[params.depth_stride * params.size_px.y + at] = params.unit * p.median;
#ifdef DISTORTION
    depths[2u * params.depth_stride * params.size_px.y + at] = distortion_of(p.moments);
#endif
#endif
}

@compute @workgroup_size(GROUP_ACROSS, GROUP_DOWN)
fn compose(
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(workgroup_id) tile: vec3<u32>,
) {
    let range = ranges[tile.y * params.across + tile.x];
    let corner = TILE * tile.xy + RUN * local.xy;
    var pEACH = opened(corner + vec2(EACHu % RUN.x, EACHu / RUN.x));
    for (var round = 0u; round < rounds(); round++) {
        for (var i = range.x; i < range.y; i++) {
            let number = entries[i];
            let f = footprints[number];
            let hEACH = met(f, pEACH.at_px);
            var touches = false;
            touches = touches || hEACH.inside;
            var v = Vectors();
            if touches {
                v = vectors_of(number);
            }
            see(&pEACH, hEACH, v, number, round);
#ifdef NO_PICKING
            // Nothing is let through any more.
            var most = 0.0;
            most = max(most, pEACH.left);
            if most <= 0.0 {
                break;
            }
#endif
        }
        end_round(&pEACH, round);
    }
    store(pEACH);
}
