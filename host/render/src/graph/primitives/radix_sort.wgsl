// A radix sort of pairs by their keys, four bits a time, that keeps the order of equal keys: counts of digits by blocks,
// their prefix sums, and a scatter.
//
// Source: Merrill & Grimshaw 2010, "Revisiting Sorting for GPGPU Stream Architectures": counts, scan, scatter.

struct Amount {
    n: u32,
    n_blocks: u32,
    unused_a: u32,
    unused_b: u32,
}

struct Digit {
    // Bits below it.
    shift: u32,
    // 15, or less where fewer bits are looked at.
    mask: u32,
    unused_a: u32,
    unused_b: u32,
}

// Pairs of a thread and of a block of 256 threads.
const OF_THREAD = 4u;
const BLOCK = 1024u;

var<uniform> amount: Amount;
var<uniform> digit: Digit;
var<storage, read> keys: array<u32>;
var<storage, read> values: array<u32>;
var<storage, read_write> sorted_keys: array<u32>;
var<storage, read_write> sorted_values: array<u32>;
// Of each digit, of each block.
var<storage, read_write> counts: array<u32>;

var<workgroup> of_block: array<atomic<u32>, 16>;
// Of each thread, two digits in a number: rows of 256.
var<workgroup> of_threads: array<u32, 2048>;
var<workgroup> sums: array<u32, 256>;

fn digit_of(key: u32) -> u32 {
    return (key >> digit.shift) & digit.mask;
}

@compute @workgroup_size(256)
fn count_digits(
    @builtin(local_invocation_index) thread: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let block = group.x + group.y * groups.x;
    if thread < 16u {
        atomicStore(&of_block[thread], 0u);
    }
    workgroupBarrier();
    for (var k = 0u; k < OF_THREAD; k++) {
        let i = block * BLOCK + thread * OF_THREAD + k;
        if i < amount.n {
            atomicAdd(&of_block[digit_of(keys[i])], 1u);
        }
    }
    workgroupBarrier();
    if thread < 16u && block < amount.n_blocks {
        counts[thread * amount.n_blocks + block] = atomicLoad(&of_block[thread]);
    }
}

@compute @workgroup_size(256)
fn scatter(
    @builtin(local_invocation_index) thread: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let block = group.x + group.y * groups.x;
    let first = block * BLOCK + thread * OF_THREAD;
    for (var row = 0u; row < 8u; row++) {
        of_threads[row * 256u + thread] = 0u;
    }
    for (var k = 0u; k < OF_THREAD; k++) {
        if first + k < amount.n {
            let of_key = digit_of(keys[first + k]);
            of_threads[(of_key >> 1u) * 256u + thread] += 1u << (16u * (of_key & 1u));
        }
    }
    workgroupBarrier();
    // Sums within rows: each thread adds up eight neighbours, 32 threads a row.
    let start = (thread >> 5u) * 256u + (thread & 31u) * 8u;
    var own = 0u;
    for (var k = 0u; k < 8u; k++) {
        own += of_threads[start + k];
    }
    sums[thread] = own;
    workgroupBarrier();
    for (var step = 1u; step < 32u; step *= 2u) {
        var before = 0u;
        if (thread & 31u) >= step {
            before = sums[thread - step];
        }
        workgroupBarrier();
        sums[thread] += before;
        workgroupBarrier();
    }
    var before = sums[thread] - own;
    for (var k = 0u; k < 8u; k++) {
        let here = of_threads[start + k];
        of_threads[start + k] = before;
        before += here;
    }
    workgroupBarrier();
    for (var k = 0u; k < OF_THREAD; k++) {
        let i = first + k;
        if i >= amount.n {
            break;
        }
        let key = keys[i];
        let of_key = digit_of(key);
        var at = counts[of_key * amount.n_blocks + block];
        at += (of_threads[(of_key >> 1u) * 256u + thread] >> (16u * (of_key & 1u))) & 0xffffu;
        for (var j = 0u; j < k; j++) {
            at += select(0u, 1u, digit_of(keys[first + j]) == of_key);
        }
        sorted_keys[at] = key;
        sorted_values[at] = values[i];
    }
}
