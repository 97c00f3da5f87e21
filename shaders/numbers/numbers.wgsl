// Keys for sorting, and the numbers of invocations of passes that count.
#define_import_path surfelshop::numbers

// A number that is ordered as the float is: -0 before 0, what is no number before or behind all others by its sign.
fn ordered_from_f32(x: f32) -> u32 {
    let bits = bitcast<u32>(x);
    return select(bits | 0x80000000u, ~bits, (bits >> 31u) == 1u);
}

// The float that a number was made of.
fn f32_from_ordered(ordered: u32) -> f32 {
    return bitcast<f32>(select(~ordered, ordered & 0x7fffffffu, (ordered >> 31u) == 1u));
}

// The number of an invocation over all workgroups, row by row: its workgroup, the number of workgroups, its index in the
// workgroup, and the invocations of one.
fn invocation_of(group: vec3<u32>, groups: vec3<u32>, index: u32, of_group: u32) -> u32 {
    return ((group.z * groups.y + group.y) * groups.x + group.x) * of_group + index;
}
