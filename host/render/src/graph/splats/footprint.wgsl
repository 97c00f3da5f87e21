// Footprints as the device has them: the same rules as in the rasteriser's `composition`.

struct Footprint {
    shape: vec4<f32>,
    distance: vec3<f32>,
    opacity: f32,
    center: vec4<f32>,
}

struct Params {
    // Splats, or entries of lists.
    n: u32,
    // Tiles across and down.
    across: u32,
    down: u32,
    // 1 where footprints lie in planes.
    planar: u32,
    size_px: vec2<u32>,
    near: f32,
    orthographic: u32,
    // 0 over, 1 additive, 2 nearest, 3 stochastic, 4 normalized.
    composition: u32,
    samples: u32,
    // Texels from row to row of the pictures of vectors, and of depths.
    stride: u32,
    depth_stride: u32,
    // 1 where the surface hides what is behind it.
    tested: u32,
    // Scene units of a unit of distance.
    unit: f32,
    // Of normalized: a share of the distance.
    tolerance: f32,
    // Of quads: the try of a stochastic composition, or how many ranks are tried.
    step: u32,
}

const TILE = 16u;
const LEAST_OPACITY = 0.003921569;
const LOW_PASS = 2.0;
const MOST_DISTANCE = 1e18;

fn is_finite_number(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

fn are_finite(v: vec4<f32>) -> bool {
    return is_finite_number(v.x) && is_finite_number(v.y) && is_finite_number(v.z) && is_finite_number(v.w);
}

// Whether footprints lie in planes: known before, where a text is made for one kind.
fn is_planar() -> bool {
#ifdef PLANAR
    return true;
#else
#ifdef CONIC
    return false;
#else
    return params.planar == 1u;
#endif
#endif
}

// Twice the exponent at which a splat is not seen any more.
fn cutoff_of(opacity: f32) -> f32 {
    return 2.0 * log(min(opacity, 1.0) / LEAST_OPACITY);
}
