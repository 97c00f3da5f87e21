// Lists the large surfels of a chunk in drawing order, for an indirect draw; one workgroup, behind
// footprint.wgsl.
//
// What is drawn first wins where depths are equal, and sums of floats depend on the order: a list
// filled as invocations come would give another picture every time.

// See compute_visibility.wgsl.
var<storage, read> boxes: array<vec2<u32>>;
// Number of large surfels among each 64 that are drawn.
var<storage, read> blocks: array<u32>;
var<storage, read_write> list: array<u32>;

// Arguments of the indirect draw.
struct LargeDraw {
    vertices: u32,
    surfels: u32,
    first_vertex: u32,
    first_surfel: u32,
}
var<storage, read_write> large: LargeDraw;

// Large surfels of all chunks.
struct Total {
    surfels: atomic<u32>,
}
var<storage, read_write> total: Total;

const BLOCK = 64u;
const LANES = 64u;
var<workgroup> counts: array<u32, LANES>;

@compute @workgroup_size(LANES)
fn list_large(@builtin(local_invocation_index) lane: u32) {
    let drawn = n_drawn();
    let n_blocks = (drawn + BLOCK - 1u) / BLOCK;
    let share = (n_blocks + LANES - 1u) / LANES;
    let first = min(lane * share, n_blocks);
    let behind = min(first + share, n_blocks);
    var count = 0u;
    for (var block = first; block < behind; block++) {
        count += blocks[block];
    }
    counts[lane] = count;
    workgroupBarrier();
    var at = 0u;
    for (var before = 0u; before < lane; before++) {
        at += counts[before];
    }
    for (var block = first; block < behind; block++) {
        if blocks[block] == 0u {
            continue;
        }
        let end = min((block + 1u) * BLOCK, drawn);
        for (var surfel = block * BLOCK; surfel < end; surfel++) {
            if boxes[surfel].y >> 16u == LARGE {
                list[at] = surfel;
                at++;
            }
        }
    }
    if lane == LANES - 1u && at > 0u {
        large.surfels = at;
        atomicAdd(&total.surfels, at);
    }
}
