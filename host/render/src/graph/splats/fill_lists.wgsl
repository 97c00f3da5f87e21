// The entries of all tiles' lists, and where each tile's begin and end.

var<uniform> params: Params;
var<storage, read> numbers: array<u32>;
var<storage, read> tiles: array<vec2<u32>>;
// Entries before those of each splat, in order.
var<storage, read> offsets: array<u32>;
var<storage, read_write> entry_tiles: array<u32>;
var<storage, read_write> entry_numbers: array<u32>;
// First and end of each tile.
var<storage, read_write> ranges: array<vec2<u32>>;

@compute @workgroup_size(256)
fn fill(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let i = id.x + id.y * groups.x * 256u;
    if i >= params.n {
        return;
    }
    let number = numbers[i];
    let packed = tiles[number];
    var at = offsets[i];
    for (var row = packed.x >> 16u; row < (packed.y >> 16u); row++) {
        for (var column = packed.x & 0xffffu; column < (packed.y & 0xffffu); column++) {
            entry_tiles[at] = row * params.across + column;
            entry_numbers[at] = number;
            at++;
        }
    }
}

// Of the sorted entries.
@compute @workgroup_size(256)
fn bound(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let i = id.x + id.y * groups.x * 256u;
    if i >= params.n {
        return;
    }
    let tile = entry_tiles[i];
    if i == 0u || entry_tiles[i - 1u] != tile {
        ranges[tile].x = i;
    }
    if i + 1u == params.n || entry_tiles[i + 1u] != tile {
        ranges[tile].y = i + 1u;
    }
}
