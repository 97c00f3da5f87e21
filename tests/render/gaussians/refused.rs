//! Passes of splats and columns that cannot be, each refused with one line that names it.

use super::scripted::{Script, drawn, one, refused};
use super::stage::{self, Gaussians};
use surfelshop_api::graph::{ColumnsOf, Output};
use surfelshop_api::prelude::*;
use surfelshop_tests::stage::engine;

/// A graph of one pass of splats, into textures of these formats.
fn pass(
    formats: &'static [Format],
    with: impl Fn(Pass) -> Pass + Send + 'static,
) -> impl Fn(&Frame<Script>, &mut Graph) + Send {
    move |_, graph| {
        let mut splats = with(one("splats", 1));
        let mut shown = None;
        for (i, format) in formats.iter().enumerate() {
            let target = graph.texture(&format!("target {i}"), Texture::view_sized(*format));
            splats = splats.target(target);
            shown = shown.or(Some(target));
        }
        graph.pass(splats);
        let empty = Texture::view_sized(Format::Rgba32Float);
        let shown = shown.unwrap_or_else(|| graph.texture("empty", empty));
        graph.output(Output::Color, shown);
    }
}

type Graphs = Box<dyn Fn(&Frame<Script>, &mut Graph) + Send>;

const FLOATS: [Format; 5] = [Format::Rgba32Float; 5];

/// Costs 0.1 s.
#[test]
fn targets_that_no_splats_are_drawn_into() {
    let cloud = Gaussians::generated(3).cloud();
    let mut engine = engine();
    let mut says = |words: &[&str], graph| refused(&mut engine, &[&cloud], words, graph);
    says(&["pass `splats`", "0 targets", "1 to 4"], Box::new(pass(&[], |p| p)) as Graphs);
    says(&["pass `splats`", "5 targets", "1 to 4"], Box::new(pass(&FLOATS, |p| p)));
    let half = &[Format::Rgba32Float, Format::Rgba16Float];
    says(
        &["pass `splats`", "`target 1`", "Rgba16Float", "Rgba32Float"],
        Box::new(pass(half, |p| p)),
    );
    let words = ["pass `splats`", "`small`", "7 x 5", "16 x 16"];
    says(
        &words,
        Box::new(|_, graph| {
            let small = graph.texture("small", Texture::fixed(Format::Rgba32Float, 7, 5));
            graph.pass(one("splats", 1).target(small));
            graph.output(Output::Color, small);
        }),
    );
    says(
        &["pass `splats`", "`color`", "twice"],
        Box::new(|_, graph| {
            let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
            graph.pass(one("splats", 1).target(color).target(color));
            graph.output(Output::Color, color);
        }),
    );
}

/// A graph whose splat function has this head and body.
fn function(head: &'static str, body: &'static str) -> impl Fn(&Frame<Script>, &mut Graph) + Send {
    let text = format!("#import surfelshop::splat\n\nfn {head} {{\n    {body}\n}}\n");
    move |_, graph| {
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        graph.pass(Pass::splats("splats", &text, "draw", Footprint::Conic, 1).target(color));
        graph.output(Output::Color, color);
    }
}

/// Costs 0.5 s.
///
/// Invariant: a splat or shading function that does not fit is told what is expected, and what is wrong within has a line
#[test]
fn functions_that_do_not_fit_or_are_wrong_within() {
    let cloud = Gaussians::generated(3).cloud();
    let mut engine = engine();
    let good = "return splat::conic(vec2(8.0), vec3(0.1, 0.0, 0.1), 1.0);";
    let fits = "`draw` does not fit; expected `fn draw(i: u32) -> splat::Splat`";
    let heads = ["draw(i: i32) -> splat::Splat", "draw() -> splat::Splat"];
    for head in heads {
        refused(&mut engine, &[&cloud], &["pass `splats`", fits], function(head, good));
    }
    let color = function("draw(i: u32) -> vec4<f32>", "return vec4(f32(i));");
    refused(&mut engine, &[&cloud], &["pass `splats`", fits], color);
    for body in [
        "var s = splat::Splat(); s.payload[0] = vec3(1.0); return s;",
        "var s = splat::Splat(); s.payload[4] = vec4(1.0); return s;",
    ] {
        let graph = function("draw(i: u32) -> splat::Splat", body);
        refused(&mut engine, &[&cloud], &["pass `splats`: line 4: "], graph);
    }
    let plane = "return splat::planar(vec3(0.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0));";
    let words =
        ["pass `splats`", "`splat::planar`", "`Footprint::Planar`", "says `Footprint::Conic`"];
    refused(&mut engine, &[&cloud], &words, function("draw(i: u32) -> splat::Splat", plane));
    let shading = |_: &Frame<Script>, graph: &mut Graph| {
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        let text = "#import surfelshop::surface::Surface\nfn shade(s: Surface) -> vec3<f32> { return s.normal; }";
        graph.pass(Pass::shading("shade", text, "shade").target(color));
        graph.output(Output::Color, color);
    };
    let fits = "`shade` does not fit; expected `fn shade(s: Surface) -> vec4<f32>`";
    refused(&mut engine, &[&cloud], &["pass `shade`", fits], shading);
}

/// Costs 0.1 s.
#[test]
fn numbers_that_no_pass_of_splats_has() {
    let cloud = Gaussians::generated(3).cloud();
    let mut engine = engine();
    let one_target = &FLOATS[..1];
    for samples in [0, 65, u32::MAX] {
        let composed = move |p: Pass| p.composed(Composition::Stochastic { samples });
        let words = ["pass `splats`", &format!("{samples} samples"), "1 to 64"];
        refused(&mut engine, &[&cloud], &words, pass(one_target, composed));
    }
    for samples in [1, 64] {
        let composed = move |p: Pass| p.composed(Composition::Stochastic { samples });
        drawn(&mut engine, &[&cloud], pass(one_target, composed)).unwrap();
    }
    for tolerance in [f32::NAN, -0.1, -0.0 - f32::MIN_POSITIVE, f32::INFINITY] {
        let composed = move |p: Pass| p.composed(Composition::Normalized { tolerance });
        let words = ["pass `splats`", &format!("tolerance is {tolerance};"), "0 or more"];
        refused(&mut engine, &[&cloud], &words, pass(one_target, composed));
    }
    for tolerance in [0.0, -0.0, 1e-9, f32::MAX] {
        let composed = move |p: Pass| p.composed(Composition::Normalized { tolerance });
        drawn(&mut engine, &[&cloud], pass(one_target, composed)).unwrap();
    }
    for n in [(1 << 28) + 1, u64::from(u32::MAX) + 1, u64::MAX] {
        let words = ["pass `many`", &format!("{n} splats"), "268435456"];
        refused(&mut engine, &[&cloud], &words, move |_, graph| {
            let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
            graph.pass(one("many", n).target(color));
            graph.output(Output::Color, color);
        });
    }
    drawn(&mut engine, &[&cloud], |_, graph| {
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        graph.pass(one("none", 0).target(color));
        graph.output(Output::Color, color);
    })
    .unwrap();
}

/// Costs 0.1 s.
#[test]
fn depths_that_no_pass_of_splats_draws() {
    let cloud = Gaussians::generated(3).cloud();
    let mut engine = engine();
    let with_depths = |format: Format, n: usize| {
        move |_: &Frame<Script>, graph: &mut Graph| {
            let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
            let mut pass = one("splats", 1).target(color);
            for i in 0..n {
                let depth = graph.texture(&format!("depth {i}"), Texture::view_sized(format));
                pass = pass.depth(SplatDepth::Median, depth);
            }
            graph.pass(pass);
            graph.output(Output::Color, color);
        }
    };
    let words = ["pass `splats`", "`depth 0`", "Rgba32Float", "R32Float"];
    refused(&mut engine, &[&cloud], &words, with_depths(Format::Rgba32Float, 1));
    let words = ["pass `splats`", "4 depths", "at most 3"];
    refused(&mut engine, &[&cloud], &words, with_depths(Format::R32Float, 4));
    let words = ["pass `splats`", "`missing`"];
    refused(&mut engine, &[&cloud], &words, |_, graph| {
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        let wgsl = "#import surfelshop::splat\n";
        let pass = Pass::splats("splats", wgsl, "missing", Footprint::Conic, 1);
        graph.pass(pass.target(color));
        graph.output(Output::Color, color);
    });
}

/// A graph that shows a buffer of these columns, declared as `with` says.
fn reading(
    names: &'static [&'static str],
    n: u32,
    with: impl Fn(&mut ColumnsOf, &mut u64) + Send + 'static,
) -> impl Fn(&Frame<Script>, &mut Graph) + Send {
    move |_, graph| {
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        let columns = names.iter().map(|name| BufferColumn::new(name, n)).collect();
        let mut of = ColumnsOf { objects: vec![0], columns };
        let mut size = of.bytes(3);
        with(&mut of, &mut size);
        let given = graph.buffer("given", Buffer { columns: Some(of), ..Buffer::new(size) });
        let wgsl = "
            var<storage, read> words: array<u32>;
            @fragment fn show() -> @location(0) vec4<f32> { return vec4(f32(words[1])); }";
        graph.pass(Pass::fullscreen("show", wgsl, "show").bind("words", given).target(color));
        graph.output(Output::Color, color);
    }
}

/// Costs 0.1 s.
#[test]
fn buffers_of_columns_that_are_not_there() {
    let cloud = Gaussians::generated(3).cloud();
    let mut engine = engine();
    drawn(&mut engine, &[&cloud], reading(&["opacity"], 1, |_, _| {})).unwrap();
    let mut says = |words: &[&str], graph| refused(&mut engine, &[&cloud], words, graph);
    let boxed = |names, n, with: fn(&mut ColumnsOf, &mut u64)| -> Graphs {
        Box::new(reading(names, n, with))
    };
    // Sixteen bytes before three surfels of four.
    says(
        &["buffer `given`", "32 bytes", "3 surfels", "28"],
        boxed(&["opacity"], 1, |_, n| *n += 4),
    );
    says(&["buffer `given`", "24 bytes", "28"], boxed(&["opacity"], 1, |_, n| *n -= 4));
    says(&["buffer `given`", "[7]"], boxed(&["opacity"], 1, |of, _| of.objects = vec![7]));
    let twice: fn(&mut ColumnsOf, &mut u64) = |of, _| of.objects = vec![0, 0];
    says(&["buffer `given`", "[0, 0]", "ascending"], boxed(&["opacity"], 1, twice));
    says(&["buffer `given`", "names none"], boxed(&[], 1, |_, _| {}));
    says(&["buffer `given`", "`opacity` twice"], boxed(&["opacity", "opacity"], 1, |_, _| {}));
    says(&["buffer `given`", "`opacity`", "0 components"], boxed(&["opacity"], 0, |_, _| {}));
    says(&["buffer `given`", "5000 components", "1024"], boxed(&["opacity"], 5000, |_, _| {}));
    for name in [&["no name"] as &[&str], &["9lives"], &[""], &["a-b"], &["a\nb"], &["gr\u{fc}n"]] {
        says(&["buffer `given`", "expected a name"], boxed(name, 1, |_, _| {}));
    }
}

/// Names that a module of columns cannot have, and words of WGSL. Costs 0.1 s.
#[test]
fn names_that_wgsl_has_already() {
    let cloud = Gaussians::generated(3).cloud();
    let mut engine = engine();
    for name in ["fn", "var", "at", "words", "vec3"] {
        let describe = move |frame: &Frame<Script>, graph: &mut Graph| {
            let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
            let columns = [BufferColumn::new(name, 1), BufferColumn::new("opacity", 1)];
            let (_, given) = graph.columns("given", &frame.cloud, &[0], &columns);
            let wgsl = "
                #import given
                @fragment fn show() -> @location(0) vec4<f32> { return vec4(given::opacity(0u)); }";
            graph.pass(Pass::fullscreen("show", wgsl, "show").reads(&given).target(color));
            graph.output(Output::Color, color);
        };
        match drawn(&mut engine, &[&cloud], describe) {
            Ok(frame) => stage::all_finite(&frame, name),
            Err(error) => {
                let line = error.to_string();
                stage::say(&format!("a column `{name}`: {line}"));
                assert!(line.contains("pass `show`") && !line.contains('\n'), "{line}");
            }
        }
    }
}

/// A pass that stores into a buffer of columns. Costs 0.1 s.
#[test]
fn columns_are_only_read() {
    let cloud = Gaussians::generated(3).cloud();
    let mut engine = engine();
    let words = ["pass `spoil`", "`words`", "only read"];
    refused(&mut engine, &[&cloud], &words, |frame, graph| {
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        let columns = [BufferColumn::new("opacity", 1)];
        let (_, given) = graph.columns("given", &frame.cloud, &[0], &columns);
        let wgsl = "
            var<storage, read_write> words: array<u32>;
            @compute @workgroup_size(1) fn spoil() { words[4] = 0u; }
            @fragment fn show() -> @location(0) vec4<f32> { return vec4(1.0); }";
        let spoil = Pass::compute("spoil", wgsl, "spoil", Groups::Fixed([1, 1, 1]));
        graph.pass(spoil.bind("words", given.buffer()));
        graph.pass(Pass::fullscreen("show", wgsl, "show").target(color));
        graph.output(Output::Color, color);
    });
}
