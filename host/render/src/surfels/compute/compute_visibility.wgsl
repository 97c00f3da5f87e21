// Finds the nearest surfel of each pixel, one invocation per surfel; behind footprint.wgsl.
//
// Source: Schuetz et al. 2021, "Rendering Point Clouds with Compute Shaders and Vertex Order
// Optimization", for the atomic operation on distance and number at once; the loop over a disc's
// pixels is this project's.

// For each surfel that is drawn: its box's first pixel, 16 bits each, and its extent, 8 bits each,
// with its kind above. Later stages read it, so that all of them agree on what is small.
var<storage, read_write> boxes: array<vec2<u32>>;

// Number of large surfels among each 64 that are drawn; see list_large.wgsl.
var<storage, read_write> blocks: array<atomic<u32>>;

// For each pixel the complement of the nearest surfel's distance (high word) and number (low word):
// the greatest is the nearest, of equally near ones the one drawn first; 0 is none.
#ifdef ATOMIC64
var<storage, read_write> keys: array<atomic<u64>>;
#else
var<storage, read_write> keys: array<atomic<u32>>;

// Without 64-bit atomics there are two steps: distances first, then the numbers of those that have
// them. Both run the same program, so that what is computed twice is equal.
struct Step {
    number: u32,
}
var<uniform> step: Step;
#endif

fn offer(pixel: u32, distance: f32, number: u32) {
    let nearness = ~bitcast<u32>(distance);
#ifdef ATOMIC64
    let key = (u64(nearness) << 32u) | u64(~number);
#ifdef ATOMIC64_ALL
    // Reading costs a fraction of changing, and most surfels are behind another by then.
    if key <= atomicLoad(&keys[pixel]) {
        return;
    }
#endif
    atomicMax(&keys[pixel], key);
#else
    let known = atomicLoad(&keys[2u * pixel + 1u]);
    if step.number == 0u {
        if nearness > known {
            atomicMax(&keys[2u * pixel + 1u], nearness);
        }
    } else if nearness == known {
        atomicMax(&keys[2u * pixel], ~number);
    }
#endif
}

@compute @workgroup_size(64)
fn find_nearest(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let drawn = id.x + id.y * groups.x * 64u;
    let i = surfel_drawn_by(drawn);
    if i >= chunk.count {
        return;
    }
    let disc = load_disc(i);
    let footprint = footprint_of(disc);
    let kind = kind_of(disc, footprint);
    let first = vec2<u32>(footprint.first);
    let extent = vec2<u32>(footprint.extent) & vec2(255u);
    boxes[drawn] = vec2(first.x | (first.y << 16u), extent.x | (extent.y << 8u) | (kind << 16u));
#ifdef ATOMIC64
    let counts = kind == LARGE;
#else
    let counts = kind == LARGE && step.number == 0u;
#endif
    if counts {
        atomicAdd(&blocks[drawn / 64u], 1u);
    }
    if kind != SMALL {
        return;
    }
    // The side it is seen from stands in the lowest bit, where it decides nothing.
    let number = ((chunk.first + i) << 1u) | disc.back;
    let width = i32(view::view.size_px.x);
    let n = footprint.extent.x * footprint.extent.y;
#ifdef CLIP
    let cut = load_cut(i, disc);
#endif
    // One loop instead of two: invocations that run together wait for the largest box alone.
    var at = vec2(0);
    for (var k = 0; k < n; k++) {
        let pixel = footprint.first + at;
        let crossing = crossing_at(footprint, pixel);
#ifdef CLIP
        let is_met = crossing.r2 <= 1.0 && !is_cut_off(sides_of(cut, crossing.at));
#else
        let is_met = crossing.r2 <= 1.0;
#endif
        if is_met {
            offer(u32(pixel.x + pixel.y * width), crossing.distance, number);
        }
        at.x++;
        if at.x == footprint.extent.x {
            at = vec2(0, at.y + 1);
        }
    }
}
