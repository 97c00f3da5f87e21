//! Graphs of sandboxed plugins: what they may take of a device, and what ends those that take more.

use glam::DVec3;
use std::time::{Duration, Instant};
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::graph::{Buffer, BufferId, Groups, Output};
use surfelshop_api::prelude::*;
use surfelshop_api::{Scene, static_plugin};
use surfelshop_faulty::fine;
use surfelshop_render::{Backend, Engine, EngineOptions, GpuOptions, RenderError};
use surfelshop_tests::{clouds, stage};

static_plugin! {
    id: "org.surfelshop.test.sandboxed",
    renderers: [fine::Fine, NestedLoops],
}

/// Never ends, for each pixel.
struct NestedLoops;

const NESTED: &str = "
    #import surfelshop::surface::Surface
    fn shade(s: Surface) -> vec4<f32> {
        var sum = s.albedo.x;
        for (var i = 0u; i < 0xffffffffu; i++) {
            for (var k = 0u; k < 0xffffffffu; k++) {
                for (var l = 0u; l < 0xffffffffu; l++) { sum = fract(sum * 1.7 + 0.1); }
            }
        }
        return vec4(sum);
    }";

impl Renderer for NestedLoops {
    const INFO: UnitInfo = UnitInfo::new("nested-loops", "Nested loops", "Never ends.");
    type Params = ();

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, _frame: &Frame<()>, graph: &mut Graph) -> Result<()> {
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        graph.pass(Pass::shading("endless", NESTED, "shade").target(color));
        graph.output(Output::Color, color);
        Ok(())
    }
}

/// Longest that a graph may hold up the host: 7 s were seen with llvmpipe on two cores that were busy otherwise, and
/// machines of tests may be busier.
const LONGEST: Duration = Duration::from_secs(120);

fn encoded(graph: &Graph) -> EncodedGraph {
    let structure = rmp_serde::to_vec_named(graph.structure()).unwrap();
    EncodedGraph { structure, data: graph.data().to_vec() }
}

/// A graph whose only pass writes a buffer of so many words.
fn computing(wgsl: &str, groups: [u32; 3], words: u64) -> (Graph, BufferId) {
    let mut graph = Graph::new();
    let out = graph.buffer("out", Buffer::new(4 * words));
    graph.pass(Pass::compute("work", wgsl, "main", Groups::Fixed(groups)).bind("out", out));
    (graph, out)
}

fn run(engine: &mut Engine, (graph, out): &(Graph, BufferId)) -> Result<Vec<u32>, RenderError> {
    let read = engine.compute_sandboxed(&encoded(graph), &[out.index() as u32])?;
    let words = read[0].as_chunks::<4>().0.iter();
    Ok(words.map(|word| u32::from_le_bytes(*word)).collect())
}

const HONEST: &str = "
    var<storage, read_write> out: array<u32>;
    @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
        var sum = 0u;
        for (var i = 0u; i <= id.x; i++) { for (var k = 0u; k < 10u; k++) { sum += i; } }
        out[id.x] = sum;
    }";

/// The graph ends, is refused in a line of these words, and what comes after is good.
#[track_caller]
fn overruns(engine: &mut Engine, wgsl: &str, groups: [u32; 3], words: &str) {
    let started = Instant::now();
    let error = run(engine, &computing(wgsl, groups, 1024)).unwrap_err();
    let took = started.elapsed();
    assert!(matches!(error, RenderError::Overran { .. }), "{error:?}");
    let line = error.to_string();
    assert!(line.contains(words) && !line.contains('\n'), "{line}");
    println!("{words}: {took:?}");
    assert!(took < LONGEST, "{took:?}");
    let good = run(engine, &computing(HONEST, [16, 1, 1], 1024)).unwrap();
    assert!(good.iter().zip(0..).all(|(sum, n): (&u32, u32)| *sum == 10 * n * (n + 1) / 2));
}

/// Loops that never end are ended: in loops, and in every invocation. Costs some seconds of all cores.
///
/// Invariant: a sandboxed plugin's WGSL that never ends costs seconds and one line, and the next graph is good
#[test]
fn endless_loops_end_in_a_line() {
    let engine = &mut stage::fresh_engine();
    let head = "var<storage, read_write> out: array<u32>;";
    let nested = format!(
        "{head} fn inner(n: u32) -> u32 {{ var x = n; loop {{ loop {{ x = x * 3u + 1u; if x == 7u {{ break; }} }} }}
            return x; }}
         @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
            loop {{ out[id.x % 1024u] += inner(id.x); }} }}"
    );
    overruns(engine, &nested, [1024, 8, 1], "its loops were ended after");
}

/// One invocation that never ends: the limit ends it, or the driver does before (llvmpipe leaves loops after 65,535
/// rounds). Costs less than a second there.
#[test]
fn an_endless_invocation_holds_nothing_up() {
    let engine = &mut stage::fresh_engine();
    let wgsl = "var<storage, read_write> out: array<u32>;
        @compute @workgroup_size(1) fn main() { loop { out[0] += 1u; } }";
    let started = Instant::now();
    match run(engine, &computing(wgsl, [1, 1, 1], 1024)) {
        Ok(found) => assert!(found[0] > 1000, "{}", found[0]),
        Err(error) => assert!(matches!(error, RenderError::Overran { .. }), "{error}"),
    }
    assert!(started.elapsed() < LONGEST, "{:?}", started.elapsed());
    let good = run(engine, &computing(HONEST, [16, 1, 1], 1024)).unwrap();
    assert_eq!(good[1023], 10 * 1023 * 1024 / 2);
}

/// Invariant: loops with barriers in them end, too, and all of a workgroup leave them alike
#[test]
fn endless_loops_with_barriers_end() {
    let engine = &mut stage::fresh_engine();
    let wgsl = "var<storage, read_write> out: array<u32>;
        var<workgroup> turns: u32;
        @compute @workgroup_size(64) fn main(@builtin(local_invocation_index) i: u32) {
            loop { loop { if i == 0u { turns += 1u; } workgroupBarrier(); } workgroupBarrier(); }
            out[i] = turns;
        }";
    let found = run(engine, &computing(wgsl, [4, 1, 1], 1024)).unwrap();
    assert!(
        found[..64].iter().all(|turns| *turns == found[0] && *turns > 1000),
        "{:?}",
        &found[..9]
    );
}

/// Invariant: a picture that never ends is refused, and the next renderer's picture is good
#[test]
fn an_endless_picture_is_refused_and_the_next_is_good() {
    let mut engine = stage::fresh_engine();
    let cloud = clouds::sphere(500, 1.0).cloud();
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 256);
    let outputs = [Output::Color];
    let mut endless = stage::static_renderer::<SurfelshopPackage>(&engine, 1);
    endless.confine();
    let started = Instant::now();
    let scene = Scene::default();
    let error = stage::render(&mut engine, &mut endless, &cloud, &scene, view, &outputs);
    let error = error.unwrap_err();
    assert!(matches!(error, RenderError::Overran { .. }), "{error:?}");
    assert!(started.elapsed() < LONGEST, "{:?}", started.elapsed());
    let mut fine = stage::static_renderer::<SurfelshopPackage>(&engine, 0);
    let good = stage::render(&mut engine, &mut fine, &cloud, &scene, view, &outputs).unwrap();
    assert!(good.image(&Output::Color).unwrap().data.iter().any(|v| *v > 0.0));
}

/// What the program's own renderers draw fits into what a sandboxed plugin may take, and is the same picture.
///
/// Invariant: limits change no picture that stays within them
#[test]
fn confined_renderers_draw_the_same() {
    let mut engine = stage::engine();
    let cloud = clouds::sphere(2_000, 1.0).cloud();
    let view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 128);
    for unit in [
        ("surfelshop_flat", "flat"),
        ("surfelshop_ewa_phong", "ewa-phong"),
        ("surfelshop_phong_splatting", "phong-splatting"),
        ("surfelshop_global_illumination", "global-illumination"),
        ("surfelshop_procedural", "procedural"),
    ] {
        let mut picture = |is_confined: bool| {
            let mut renderer = stage::built_renderer(&engine, unit.0, unit.1);
            if is_confined {
                renderer.confine();
            }
            let scene = Scene::default();
            let outputs = [Output::Color];
            let made = stage::render(&mut engine, &mut renderer, &cloud, &scene, view, &outputs);
            let made = made.unwrap_or_else(|error| panic!("{}: {error}", unit.1));
            made.image(&Output::Color).unwrap().data.clone()
        };
        let [free, confined] = [false, true].map(&mut picture);
        assert!(free.iter().any(|v| *v > 0.0), "{}", unit.1);
        assert!(free == confined, "{} differs", unit.1);
    }
}

/// Invariant: sizes, passes, workgroups and straight code of sandboxed plugins are refused beyond their limits, before
/// the device sees them
#[test]
fn graphs_beyond_a_limit_are_refused() {
    let engine = &mut stage::engine();
    let wgsl = "var<storage, read_write> out: array<u32>;
        @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            out[id.x % 256u] = id.x;
        }";
    let mut refused = |graph: &(Graph, BufferId), words: &str| {
        let started = Instant::now();
        let line = run(engine, graph).unwrap_err().to_string();
        assert!(line.contains(words) && !line.contains('\n'), "{line}");
        assert!(started.elapsed() < Duration::from_secs(10), "{:?}", started.elapsed());
    };
    // Beyond the limit of graphics cards, too.
    let steps = "x = x * 3u + 1u;".repeat(400);
    let straight = format!(
        "var<storage, read_write> out: array<u32>;
        @compute @workgroup_size(256) fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
            var x = id.x;
            {steps}
            out[id.x % 256u] = x;
        }}"
    );
    refused(&computing(&straight, [65_535, 1_000, 1], 256), "operations, loops taken once");
    let mut large = computing(wgsl, [1, 1, 1], 256);
    for i in 0..8 {
        large.0.buffer(&format!("more {i}"), Buffer::new(1 << 27));
    }
    refused(&large, "a sandboxed plugin's have at most 1073741824");
    let mut long = computing(wgsl, [1, 1, 1], 256);
    for i in 0..256 {
        let pass = Pass::compute(&format!("more {i}"), wgsl, "main", Groups::Fixed([1; 3]));
        long.0.pass(pass.bind("out", long.1));
    }
    refused(&long, "it has 257 passes");
    // At its limits it runs.
    let mut engine = stage::engine();
    let most = computing(wgsl, [4096, 4, 1], 256);
    assert!(run(&mut engine, &most).unwrap().iter().zip(0..).all(|(n, i)| n % 256 == i));
}

/// Invariant: where a device checks no bounds, graphs of sandboxed plugins are refused, by a line that says so
#[test]
fn devices_that_check_no_bounds_refuse() {
    let gpu = GpuOptions { backend: Some(Backend::Gl), ..GpuOptions::default() };
    let mut engine = stage::engine_with(&gpu, &EngineOptions::default());
    let line = run(&mut engine, &computing(HONEST, [1, 1, 1], 64)).unwrap_err().to_string();
    assert!(line.contains("does not check the bounds of buffers: use Vulkan"), "{line}");
}
