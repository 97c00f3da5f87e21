// Numbers of things that only the device knows, held to what was said of them, and the workgroups that they take.

struct Bound {
    // Where the number stands, in words.
    place: u32,
    at_most: u32,
    // Invocations of a workgroup.
    of_group: u32,
    unused: u32,
}

// Numbers that a workgroup sorts or sums up.
const BLOCK = 1024u;
// Words of a part that is bound as a uniform.
const PART = 64u;
// Most workgroups in a row: of the host's own passes, and of any.
const OWN_ROW = 32768u;
const ROW = 65535u;

var<uniform> bound: Bound;
var<storage, read> numbers: array<u32>;
// Parts: a number and its blocks at 0 and 1, workgroups at 4 to 6.
var<storage, read_write> amounts: array<u32>;
var<storage, read_write> groups: array<u32>;

fn write_amount(part: u32, n: u32) -> u32 {
    let blocks = (n + BLOCK - 1u) / BLOCK;
    let across = min(blocks, OWN_ROW);
    amounts[part * PART] = n;
    amounts[part * PART + 1u] = blocks;
    amounts[part * PART + 4u] = across;
    amounts[part * PART + 5u] = (blocks + OWN_ROW - 1u) / OWN_ROW;
    amounts[part * PART + 6u] = 1u;
    return blocks;
}

// For numbers that are sorted or summed up, and for the sixteen counts of each of their blocks.
@compute @workgroup_size(1)
fn find_amounts() {
    let blocks = write_amount(0u, min(numbers[bound.place], bound.at_most));
    write_amount(1u, 16u * blocks);
}

// For a pass of one invocation a thing: rows of equal length, as few and as short as can be.
@compute @workgroup_size(1)
fn find_groups() {
    let n = min(numbers[bound.place], bound.at_most);
    let needed = n / bound.of_group + select(0u, 1u, n % bound.of_group > 0u);
    let rows = max(needed / ROW + select(0u, 1u, needed % ROW > 0u), 1u);
    groups[0] = (needed + rows - 1u) / rows;
    groups[1] = rows;
    groups[2] = 1u;
}
