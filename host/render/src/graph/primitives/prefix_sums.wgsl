// Sums of what stands before each number of a list: within blocks, over blocks, and together.

struct Amount {
    n: u32,
    n_blocks: u32,
    unused_a: u32,
    unused_b: u32,
}

const OF_THREAD = 4u;
const BLOCK = 1024u;

var<uniform> amount: Amount;
var<storage, read_write> list: array<u32>;
// Of each block; behind them the sum of all.
var<storage, read_write> blocks: array<u32>;
// Where the sum of all goes, in words.
var<uniform> place: vec4<u32>;
var<storage, read_write> totals: array<u32>;

var<workgroup> sums: array<u32, 256>;

// The sum before a thread's own number, and of all.
fn before(thread: u32, own: u32) -> vec2<u32> {
    sums[thread] = own;
    workgroupBarrier();
    for (var step = 1u; step < 256u; step *= 2u) {
        var left = 0u;
        if thread >= step {
            left = sums[thread - step];
        }
        workgroupBarrier();
        sums[thread] += left;
        workgroupBarrier();
    }
    let result = vec2(sums[thread] - own, sums[255]);
    workgroupBarrier();
    return result;
}

@compute @workgroup_size(256)
fn within_blocks(
    @builtin(local_invocation_index) thread: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let block = group.x + group.y * groups.x;
    let first = block * BLOCK + thread * OF_THREAD;
    var own = 0u;
    for (var k = 0u; k < OF_THREAD; k++) {
        if first + k < amount.n {
            own += list[first + k];
        }
    }
    let found = before(thread, own);
    var sum = found.x;
    for (var k = 0u; k < OF_THREAD; k++) {
        if first + k < amount.n {
            let here = list[first + k];
            list[first + k] = sum;
            sum += here;
        }
    }
    if thread == 0u && block < amount.n_blocks {
        blocks[block] = found.y;
    }
}

// By one workgroup.
@compute @workgroup_size(256)
fn over_blocks(@builtin(local_invocation_index) thread: u32) {
    var carry = 0u;
    for (var first = 0u; first < amount.n_blocks; first += 256u) {
        let i = first + thread;
        var own = 0u;
        if i < amount.n_blocks {
            own = blocks[i];
        }
        let found = before(thread, own);
        if i < amount.n_blocks {
            blocks[i] = carry + found.x;
        }
        carry += found.y;
    }
    if thread == 0u {
        blocks[amount.n_blocks] = carry;
    }
}

@compute @workgroup_size(256)
fn together(
    @builtin(local_invocation_index) thread: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let block = group.x + group.y * groups.x;
    if block >= amount.n_blocks {
        return;
    }
    for (var k = 0u; k < OF_THREAD; k++) {
        let i = block * BLOCK + thread * OF_THREAD + k;
        if i < amount.n {
            list[i] += blocks[block];
        }
    }
}

@compute @workgroup_size(1)
fn write_total() {
    totals[place.x] = blocks[amount.n_blocks];
}
