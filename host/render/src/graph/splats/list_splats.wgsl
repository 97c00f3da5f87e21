// Which splats touch the picture, how far they are, and which tiles they touch.

const NOTHING = 0xffffffffu;

var<uniform> params: Params;
var<storage, read> footprints: array<Footprint>;
var<storage, read_write> keys: array<u32>;
var<storage, read_write> numbers: array<u32>;
// Left and top, right and bottom of what splats may touch, tiles, the latter beyond.
var<storage, read_write> tiles: array<vec2<u32>>;
var<storage, read_write> counts: array<u32>;

// Whole numbers in the order of finite numbers.
fn ordered(x: f32) -> u32 {
    let bits = bitcast<u32>(x);
    return bits ^ select(0x80000000u, 0xffffffffu, (bits & 0x80000000u) != 0u);
}

// Low and high of what a planar splat may cover along one axis, pixels from its centre.
fn along(row: vec2<f32>, w: vec3<f32>, cutoff: f32) -> vec2<f32> {
    let d = w.z * w.z - cutoff * dot(w.xy, w.xy);
    if !(d > 0.0 && w.z > 0.0) {
        return vec2(-1e9, 1e9);
    }
    let least = sqrt(cutoff / LOW_PASS);
    let middle = -cutoff * dot(row, w.xy);
    let half = sqrt(middle * middle + d * cutoff * dot(row, row));
    return vec2(min((middle - half) / d * 1.0001, -least), max((middle + half) / d * 1.0001, least));
}

// The tiles that a splat touches; nothing where the second is not larger than the first.
fn touched(f: Footprint) -> vec4<u32> {
    let none = vec4(0u);
    if !(f.opacity >= LEAST_OPACITY) || !are_finite(f.shape) || !are_finite(vec4(f.distance, 0.0))
        || !are_finite(vec4(f.center.xy, 0.0, 0.0)) {
        return none;
    }
    let cutoff = cutoff_of(f.opacity);
    var x: vec2<f32>;
    var y: vec2<f32>;
    if params.planar == 1u {
        let w = select(f.distance, vec3(0.0, 0.0, 1.0), params.orthographic == 1u);
        x = f.center.x + along(f.shape.xy, w, cutoff);
        y = f.center.y + along(f.shape.zw, w, cutoff);
    } else {
        let determinant = f.shape.x * f.shape.z - f.shape.y * f.shape.y;
        if !(f.shape.x > 0.0 && f.shape.z > 0.0 && determinant > 0.0) || f.distance.z < params.near {
            return none;
        }
        let reach = 1.0001 * sqrt(cutoff * f.shape.zx / determinant);
        x = f.center.x + vec2(-reach.x, reach.x);
        y = f.center.y + vec2(-reach.y, reach.y);
    }
    let size = vec2<f32>(params.size_px);
    let first = max(ceil(vec2(x.x, y.x) - 0.5), vec2(0.0));
    let end = min(floor(vec2(x.y, y.y) - 0.5) + 1.0, size);
    if any(first >= end) {
        return none;
    }
    let corner = vec2<u32>(first) / TILE;
    return vec4(corner, (vec2<u32>(end) + TILE - 1u) / TILE);
}

@compute @workgroup_size(256)
fn measure(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let i = id.x + id.y * groups.x * 256u;
    if i >= params.n {
        return;
    }
    let t = touched(footprints[i]);
    let is_seen = all(t.xy < t.zw);
    // The largest number is no key of a finite distance.
    keys[i] = select(NOTHING, ordered(footprints[i].distance.z), is_seen);
    numbers[i] = i;
    tiles[i] = vec2(t.x | (t.y << 16u), t.z | (t.w << 16u));
}

fn extent(number: u32) -> vec4<u32> {
    let packed = tiles[number];
    return vec4(packed.x & 0xffffu, packed.x >> 16u, packed.y & 0xffffu, packed.y >> 16u);
}

// How many tiles each touches, in order.
@compute @workgroup_size(256)
fn count(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let i = id.x + id.y * groups.x * 256u;
    if i >= params.n {
        return;
    }
    let t = extent(numbers[i]);
    counts[i] = (t.z - t.x) * (t.w - t.y);
}
