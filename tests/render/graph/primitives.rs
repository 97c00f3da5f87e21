//! Sorting, prefix sums and counted workgroups, against the CPU.

use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::graph::{
    Buffer, BufferId, Count, Format, Graph, Groups, Pass, Texture, f32_from_ordered,
    ordered_from_f32,
};
use surfelshop_render::{Backend, Engine, EngineOptions, GpuOptions};
use surfelshop_tests::stage;

/// Sizes about those of a workgroup's numbers and of its square.
const SIZES: [usize; 10] = [0, 1, 2, 3, 255, 1023, 1024, 1025, 4099, 70_001];

fn bytes_of(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

/// Runs a graph and reads buffers back.
fn compute(
    engine: &mut Engine,
    graph: &Graph,
    buffers: &[BufferId],
) -> Result<Vec<Vec<u32>>, String> {
    let structure = rmp_serde::to_vec_named(graph.structure()).unwrap();
    let encoded = EncodedGraph { structure, data: graph.data().to_vec() };
    let buffers: Vec<u32> = buffers.iter().map(|buffer| buffer.index() as u32).collect();
    let read = engine.compute(&encoded, &buffers).map_err(|error| error.to_string())?;
    let words = |bytes: &Vec<u8>| -> Vec<u32> {
        bytes.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().unwrap())).collect()
    };
    Ok(read.iter().map(words).collect())
}

/// Numbers that look random, each the same in every run.
fn random(n: usize) -> Vec<u32> {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 32) as u32
    };
    (0..n).map(|_| next()).collect()
}

/// Keys and values as a pass of a sort leaves them: of `n` of them, and what lies behind.
fn sorted(
    engine: &mut Engine,
    keys: &[u32],
    count: impl FnOnce(&mut Graph) -> Count,
    bits: u32,
) -> [Vec<u32>; 2] {
    let mut graph = Graph::new();
    let values: Vec<u32> = (0..keys.len() as u32).collect();
    let [key_buffer, value_buffer] =
        [("keys", keys), ("values", &values)].map(|(name, all)| graph.upload(name, &bytes_of(all)));
    let count = count(&mut graph);
    graph.pass(Pass::sort("sort", key_buffer, value_buffer, count).bits(bits));
    let read = compute(engine, &graph, &[key_buffer, value_buffer]).unwrap();
    read.try_into().unwrap()
}

/// The same by the CPU.
fn expected(keys: &[u32], n: usize, bits: u32) -> [Vec<u32>; 2] {
    let mask = u32::MAX >> (32 - bits);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by_key(|&i| keys[i] & mask);
    order.extend(n..keys.len());
    [order.iter().map(|&i| keys[i]).collect(), order.iter().map(|&i| i as u32).collect()]
}

#[track_caller]
fn assert_sorted(found: &[Vec<u32>; 2], expected: &[Vec<u32>; 2], what: &str) {
    for (found, expected) in found.iter().zip(expected) {
        let n = expected.len();
        let wrong = (0..n).find(|&i| found[i] != expected[i]);
        assert_eq!(wrong, None, "the first wrong one of {n}: {what}");
    }
}

/// Invariant: the device sorts as the processor does, and keeps equal keys in their order
#[test]
fn pairs_are_sorted_in_their_order_and_what_lies_behind_stays() {
    let mut engine = stage::engine();
    for n in SIZES {
        // Many equal keys, so that their order is seen; and three that are not to be sorted.
        let keys: Vec<u32> =
            random(n + 3).iter().map(|key| if n % 2 == 0 { *key } else { key % 7 }).collect();
        let fixed = sorted(&mut engine, &keys, |_| Count::Fixed(n as u32), 32);
        assert_sorted(&fixed, &expected(&keys, n, 32), &format!("{n}"));
    }
    let keys = random(2000);
    for bits in [1, 4, 5, 9, 17] {
        let found = sorted(&mut engine, &keys, |_| Count::Fixed(2000), bits);
        assert_sorted(&found, &expected(&keys, 2000, bits), &format!("{bits} bits"));
    }
}

#[test]
fn a_number_on_the_device_says_how_many_are_sorted_and_never_more_than_was_said() {
    let mut engine = stage::engine();
    let keys = random(5000);
    for (said, at_most) in [(0, 5000), (1, 5000), (1025, 5000), (4999, 5000), (u32::MAX, 3000)] {
        let count = |graph: &mut Graph| {
            let buffer = graph.upload("count", &bytes_of(&[77, 78, said]));
            Count::Read { buffer, offset: 8, at_most }
        };
        let found = sorted(&mut engine, &keys, count, 32);
        let n = said.min(at_most) as usize;
        assert_sorted(&found, &expected(&keys, n, 32), &format!("{said} of {at_most}"));
    }
}

#[test]
fn millions_are_sorted() {
    // The whole takes seconds on a processor.
    let is_long = std::env::var("SURFELSHOP_LONG").is_ok_and(|value| value == "1");
    let n = if is_long { 1 << 24 } else { (1 << 18) + 1 };
    let keys = random(n);
    let found = sorted(&mut stage::engine(), &keys, |_| Count::Fixed(n as u32), 32);
    assert_sorted(&found, &expected(&keys, n, 32), "millions");
}

#[test]
fn floats_are_sorted_by_the_numbers_that_order_them_in_shaders_and_here_alike() {
    const MAKE_KEYS: &str = "
        #import surfelshop::numbers
        var<storage, read> floats: array<f32>;
        var<storage, read_write> keys: array<u32>;
        var<storage, read_write> back: array<f32>;
        @compute @workgroup_size(64) fn make(@builtin(global_invocation_id) id: vec3<u32>) {
            if id.x < arrayLength(&floats) {
                keys[id.x] = numbers::ordered_from_f32(floats[id.x]);
                back[id.x] = numbers::f32_from_ordered(keys[id.x]);
            }
        }";
    let mut floats: Vec<f32> =
        random(1000).iter().map(|bits| (*bits as f32 - 2e9) * 1e-3).collect();
    floats.extend([0.0, -0.0, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN]);
    let bits: Vec<u32> = floats.iter().map(|x| x.to_bits()).collect();
    let n = floats.len() as u32;
    let mut graph = Graph::new();
    let given = graph.upload("floats", &bytes_of(&bits));
    let [keys, back, values] =
        ["keys", "back", "values"].map(|name| graph.buffer(name, Buffer::new(4 * u64::from(n))));
    let groups = Groups::Fixed([n.div_ceil(64), 1, 1]);
    graph.pass(
        Pass::compute("make keys", MAKE_KEYS, "make", groups)
            .bind("floats", given)
            .bind("keys", keys)
            .bind("back", back),
    );
    graph.pass(Pass::sort("sort", keys, values, n));
    let read = compute(&mut stage::engine(), &graph, &[keys, back]).unwrap();
    assert_eq!(read[1], bits);
    let mut expected: Vec<u32> = floats.iter().map(|x| ordered_from_f32(*x)).collect();
    expected.sort_unstable();
    assert_eq!(read[0], expected);
    floats.sort_by(f32::total_cmp);
    let back: Vec<f32> = expected.iter().map(|key| f32_from_ordered(*key)).collect();
    assert_eq!(back, floats);
}

#[test]
fn sums_stand_in_the_place_of_numbers_and_the_total_where_it_is_wanted() {
    let mut engine = stage::engine();
    for n in SIZES {
        let numbers: Vec<u32> = random(n + 2).iter().map(|number| number % 1000).collect();
        let mut expected = numbers.clone();
        let mut sum = 0;
        for number in &mut expected[..n] {
            sum += std::mem::replace(number, sum);
        }
        for counted in [false, true] {
            let mut graph = Graph::new();
            let list = graph.upload("list", &bytes_of(&numbers));
            let count = match counted {
                false => Count::Fixed(n as u32),
                true => {
                    let buffer = graph.upload("count", &bytes_of(&[n as u32]));
                    Count::Read { buffer, offset: 0, at_most: n as u32 + 1 }
                }
            };
            let elsewhere = graph.upload("totals", &bytes_of(&[5, 6, 7]));
            // Behind the numbers where their number is known, and else in another buffer.
            let (into, word) = if counted { (elsewhere, 1) } else { (list, n as u64 + 1) };
            graph.pass(Pass::scan("scan", list, count).total(into, 4 * word));
            let read = compute(&mut engine, &graph, &[list, elsewhere]).unwrap();
            let mut expected = expected.clone();
            if !counted {
                expected[n + 1] = sum;
            }
            assert_eq!(read[0], expected, "{n}, counted: {counted}");
            assert_eq!(read[1], [5, if counted { sum } else { 6 }, 7], "{n}");
        }
    }
}

/// Marks each thing once, and counts invocations.
const MARK: &str = "
    #import surfelshop::numbers
    var<storage, read> count: array<u32>;
    var<storage, read_write> marks: array<u32>;
    var<storage, read_write> invocations: atomic<u32>;
    @compute @workgroup_size(8, 8) fn mark(
        @builtin(workgroup_id) group: vec3<u32>,
        @builtin(num_workgroups) groups: vec3<u32>,
        @builtin(local_invocation_index) index: u32,
    ) {
        atomicAdd(&invocations, 1u);
        let i = numbers::invocation_of(group, groups, index, 64u);
        if i < min(count[1], arrayLength(&marks)) {
            marks[i] += 1u;
        }
    }";

/// Runs a counted pass: marks of things, and how many invocations ran.
fn counted(engine: &mut Engine, said: u32, at_most: u32) -> (Vec<u32>, u32) {
    let mut graph = Graph::new();
    let count = graph.upload("count", &bytes_of(&[0, said]));
    let marks = graph.buffer("marks", Buffer::new(4 * u64::from(at_most)));
    let invocations = graph.buffer("invocations", Buffer::new(4));
    let groups = Groups::Counted { buffer: count, offset: 4, at_most };
    graph.pass(
        Pass::compute("mark", MARK, "mark", groups)
            .bind("count", count)
            .bind("marks", marks)
            .bind("invocations", invocations),
    );
    let [marks, invocations] =
        compute(engine, &graph, &[marks, invocations]).unwrap().try_into().unwrap();
    (marks, invocations[0])
}

/// Invariant: what a buffer says counts for no more invocations than the graph says
#[test]
fn as_many_invocations_run_as_a_buffer_says_and_never_more_than_was_said() {
    let mut engine = stage::engine();
    // More than a row of workgroups has, in the last one.
    let rows = 64 * 65_535 + 100;
    for (said, at_most) in
        [(0, 1000), (1, 1000), (64, 1000), (65, 1000), (u32::MAX, 1000), (u32::MAX, rows)]
    {
        let (marks, invocations) = counted(&mut engine, said, at_most);
        let n = said.min(at_most) as usize;
        assert!(marks[..n].iter().all(|mark| *mark == 1), "{said} of {at_most}");
        assert!(marks[n..].iter().all(|mark| *mark == 0), "{said} of {at_most}");
        let workgroups = (n as u32).div_ceil(64);
        let spare = 64 * (workgroups.div_ceil(65_535).max(1) - 1);
        assert!((64 * workgroups..=64 * workgroups + spare).contains(&invocations), "{said}");
    }
}

#[test]
fn opengl_counts_as_vulkan_does_and_refuses_to_sort_in_software() {
    let gpu = GpuOptions { backend: Some(Backend::Gl), ..GpuOptions::default() };
    let mut engine = stage::engine_with(&gpu, &EngineOptions::default());
    let (marks, invocations) = counted(&mut engine, 700, 1000);
    assert_eq!((marks.iter().sum::<u32>(), invocations), (700, 704));
    let keys = random(100);
    if engine.gpu().is_software() {
        let mut graph = Graph::new();
        let [a, b] = ["a", "b"].map(|name| graph.upload(name, &bytes_of(&keys)));
        graph.pass(Pass::sort("s", a, b, 100));
        let line = compute(&mut engine, &graph, &[]).unwrap_err();
        assert!(line.contains("pass `s`: it sorts, which OpenGL in software takes"), "{line}");
        return;
    }
    let found = sorted(&mut engine, &keys, |_| Count::Fixed(99), 32);
    assert_sorted(&found, &expected(&keys, 99, 32), "through OpenGL");
}

/// What a graph of these passes is refused with.
fn refusal(describe: impl FnOnce(&mut Graph)) -> String {
    let mut graph = Graph::new();
    describe(&mut graph);
    let line = compute(&mut stage::engine(), &graph, &[]).unwrap_err();
    assert!(!line.contains('\n'), "{line}");
    line
}

#[test]
fn what_cannot_be_sorted_summed_or_counted_is_refused_by_name() {
    let buffers = |graph: &mut Graph| ["a", "b"].map(|name| graph.buffer(name, Buffer::new(40)));
    type Describe = fn(&mut Graph, [BufferId; 2]);
    let cases: [(Describe, &str); 9] = [
        (
            |graph, [a, _]| graph.pass(Pass::sort("s", a, a, 10)),
            "pass `s`: its keys and its values are one buffer, `a`",
        ),
        (
            |graph, [a, b]| graph.pass(Pass::sort("s", a, b, 11)),
            "pass `s`: buffer `a` has 40 bytes; 44 are needed for its keys",
        ),
        (
            |graph, [a, b]| graph.pass(Pass::sort("s", a, b, 10).bits(33)),
            "pass `s`: it sorts by 33 bits",
        ),
        (
            |graph, [a, b]| graph.pass(Pass::sort("s", a, b, 10).bind("keys", a)),
            "pass `s`: it sorts by a shader of the host",
        ),
        (
            |graph, [a, b]| {
                let count = Count::Read { buffer: b, offset: 40, at_most: 3 };
                graph.pass(Pass::scan("s", a, count));
            },
            "pass `s`: buffer `b` has 40 bytes; 44 are needed for its count",
        ),
        (
            |graph, [a, b]| {
                let count = Count::Read { buffer: b, offset: 2, at_most: 3 };
                graph.pass(Pass::scan("s", a, count));
            },
            "pass `s`: byte 2 of buffer `b` was given for its count",
        ),
        (
            |graph, [a, _]| graph.pass(Pass::scan("s", a, 10).total(a, 36)),
            "pass `s`: its total at byte 36 of buffer `a` lies among the 40 bytes of its numbers",
        ),
        (
            |graph, [a, _]| {
                let kept = graph.resident("r", "key", 40, || [0; 40]);
                graph.pass(Pass::sort("s", a, kept, 10));
            },
            "pass `s`: buffer `r` was given for its values; it is resident and only read",
        ),
        (
            |graph, [a, _]| {
                let groups = Groups::Counted { buffer: a, offset: 0, at_most: 0 };
                let wgsl = "@compute @workgroup_size(1) fn f() {}";
                graph.pass(Pass::compute("c", wgsl, "f", groups));
            },
            "pass `c`: at most 0 invocations",
        ),
    ];
    for (describe, words) in cases {
        let line = refusal(|graph| {
            let buffers = buffers(graph);
            describe(graph, buffers);
        });
        assert!(line.contains(words), "`{words}` is missing in: {line}");
    }
}

#[test]
fn a_texture_that_cannot_be_read_and_stored_into_is_refused_in_one_line() {
    let line = refusal(|graph| {
        let texture = graph.texture("t", Texture::fixed(Format::Rgba32Float, 8, 8));
        let wgsl = "var both: texture_storage_2d<rgba32float, read_write>;
            @compute @workgroup_size(1) fn f() { textureStore(both, vec2(0u), textureLoad(both, vec2(1u))); }";
        let pass = Pass::compute("c", wgsl, "f", Groups::Fixed([1; 3]));
        graph.pass(pass.bind("both", texture));
    });
    let expected = "pass `c`: `both` is a storage texture of Rgba32Float, which this device does not let be read and";
    assert!(line.contains(expected), "{line}");
}

#[test]
fn what_a_pass_enables_it_says_that_it_needs() {
    let line = refusal(|graph| {
        let wgsl =
            "enable f16; var<private> x: f16; @compute @workgroup_size(1) fn go() { x = 1.0h; }";
        graph.pass(Pass::compute("c", wgsl, "go", Groups::Fixed([1; 3])));
    });
    assert!(line.contains("pass `c`: line 1: `enable f16;`"), "{line}");
    assert!(line.contains("add `.needs(\"f16\")`"), "{line}");
    let line = refusal(|graph| {
        let wgsl =
            "var<workgroup> x: u32; @compute @workgroup_size(1) fn go() { x = subgroupAdd(1u); }";
        graph.pass(Pass::compute("c", wgsl, "go", Groups::Fixed([1; 3])));
    });
    assert!(line.contains(".needs(\"subgroups\")"), "{line}");
}

/// A pass that writes a number, and what it needs.
fn writes(name: &str, number: u32, into: BufferId) -> Pass {
    let wgsl = format!(
        "var<storage, read_write> x: array<u32>; @compute @workgroup_size(1) fn go() {{ x[0] = {number}u; }}"
    );
    Pass::compute(name, &wgsl, "go", Groups::Fixed([1; 3])).bind("x", into)
}

#[test]
fn the_first_pass_that_the_device_can_run_runs() {
    let mut engine = stage::engine();
    let here = engine.gpu().host_info().features;
    for word in ["subgroups", "f16", "64-bit-atomics", "float32-atomics", "volume-storage"] {
        let mut graph = Graph::new();
        let x = graph.buffer("x", Buffer::new(4));
        graph.pass(writes("fast", 1, x).needs(word).instead(writes("slow", 2, x)));
        let read = compute(&mut engine, &graph, &[x]).unwrap();
        let has = here.iter().any(|feature| feature == word);
        assert_eq!(read[0], [if has { 1 } else { 2 }], "{word}: {here:?}");
    }
    // An alternative keeps the same rules, also where it does not run.
    let line = refusal(|graph| {
        let x = graph.buffer("x", Buffer::new(4));
        graph.pass(writes("fast", 1, x).instead(writes("slow", 2, x).bind("y", x)));
    });
    assert!(line.contains("pass `slow`: nothing in the shader is called `y`"), "{line}");
}

/// The texts of what devices may have, which are compiled where they have it.
#[test]
fn what_the_device_has_can_be_used() {
    let mut engine = stage::engine();
    let here = engine.gpu().host_info().features;
    println!("{} has {}", engine.gpu().describe(), here.join(", "));
    let body = [
        ("subgroups", "enable subgroups;", "x[0] = subgroupAdd(1u);"),
        ("f16", "enable f16;", "let h = f16(x[0]) + 3.0h; x[0] = u32(h);"),
        ("64-bit-integers", "", "x[0] = u32((u64(x[0]) + (1lu << 33u)) >> 33u) + 2u;"),
    ];
    for (word, head, body) in body {
        if !here.iter().any(|feature| feature == word) {
            continue;
        }
        let mut graph = Graph::new();
        let x = graph.buffer("x", Buffer::new(4));
        let wgsl = format!(
            "{head} var<storage, read_write> x: array<u32>; @compute @workgroup_size(1) fn go() {{ {body} }}"
        );
        graph.pass(Pass::compute("c", &wgsl, "go", Groups::Fixed([1; 3])).bind("x", x).needs(word));
        let read = compute(&mut engine, &graph, &[x]).unwrap_or_else(|e| panic!("{word}: {e}"));
        assert!([1, 3].contains(&read[0][0]), "{word}: {}", read[0][0]);
    }
}
