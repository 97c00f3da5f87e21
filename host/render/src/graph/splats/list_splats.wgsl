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

// The tiles that a splat touches; nothing where the second is not larger than the first.
fn touched(f: Footprint) -> vec4<u32> {
    let pixels = covered(f);
    return vec4(pixels.xy / TILE, (pixels.zw + TILE - 1u) / TILE);
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
