//! Graphs that break a rule are refused with pass and variable, and harm nothing else.

use glam::DVec3;
use surfelshop_api::graph::Output;
use surfelshop_api::prelude::*;
use surfelshop_api::{Scene, static_plugin};
use surfelshop_faulty::{calls, fine, graphs};
use surfelshop_render::Engine;
use surfelshop_tests::materials::Materials;
use surfelshop_tests::{clouds, stage};

static_plugin! {
    id: "org.surfelshop.test.graphs",
    renderers: [
        fine::Fine,
        calls::PanicsInFrame,
        calls::ReturnsError,
        graphs::InvalidWgsl,
        graphs::WrongUniformSize,
        graphs::UnboundVariable,
        graphs::UnknownBinding,
        graphs::NoOutput,
        graphs::WrongTargetSize,
        graphs::HugeTexture,
        EndlessLoop,
        Multiple,
        Materials,
        FailsFirst,
        SameKeys,
        LongSum,
    ],
}

/// The line a renderer of this package is refused with; the engine works on afterwards.
fn refusal(unit: u32) -> String {
    let mut engine = stage::engine();
    let cloud = clouds::sphere(500, 1.0).cloud();
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 32);
    let render = |engine: &mut Engine, unit| {
        let mut renderer = stage::static_renderer::<SurfelshopPackage>(engine, unit);
        let outputs = [Output::Color];
        stage::render(engine, &mut renderer, &cloud, &Scene::default(), view, &outputs)
    };
    let line = render(&mut engine, unit).unwrap_err().to_string();
    assert!(!line.contains('\n'), "more than a line: {line}");
    let good = render(&mut engine, 0).expect("a good renderer still works");
    assert!(good.image(&Output::Color).unwrap().data.iter().any(|v| *v > 0.0));
    line
}

#[track_caller]
fn says(unit: u32, words: &[&str]) {
    let line = refusal(unit);
    for word in words {
        assert!(line.contains(word), "`{word}` is missing in: {line}");
    }
}

#[test]
fn panic_in_frame_is_contained() {
    says(1, &["panicked at", "calls.rs"]);
}

#[test]
fn error_in_frame_is_one_line() {
    refusal(2);
}

#[test]
fn invalid_wgsl_names_pass_and_line() {
    says(3, &["pass `broken`", "line 1"]);
}

/// Invariant: a bad graph is refused in one line, and the next frame is good
#[test]
fn wrong_uniform_size_names_pass_variable_and_both_sizes() {
    says(4, &["`settings` is 32 bytes in the shader, 4 given", "pass `"]);
}

#[test]
fn unbound_variable_is_named() {
    says(5, &["pass `shade`", "`settings`", "not bound"]);
}

#[test]
fn unknown_binding_is_named_with_what_there_is() {
    says(6, &["pass `shade`", "`nonsense`", "settings"]);
}

#[test]
fn missing_output_is_named() {
    says(7, &["`color`", "depth, normal"]);
}

#[test]
fn wrong_target_size_names_both_sizes() {
    says(8, &["pass `shade`", "`small`", "7 x 5", "32 x 32"]);
}

#[test]
fn huge_texture_is_refused_before_it_is_made() {
    says(9, &["`huge`", "1000000 x 1000000"]);
}

/// A shader that never ends by itself.
struct EndlessLoop;

impl Renderer for EndlessLoop {
    const INFO: UnitInfo = UnitInfo::new("endless-loop", "Endless", "Loops for ever.");
    type Params = ();

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, _frame: &Frame<()>, graph: &mut Graph) -> Result<()> {
        let wgsl = "
            var<storage, read_write> counts: array<u32>;
            @compute @workgroup_size(1) fn spin() {
                var i = 0u;
                loop { i = i * 1664525u + 1013904223u; if counts[0] == 7u { break; } }
                counts[1] = i;
            }
            @fragment fn show(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {
                return vec4(f32(counts[1] & 1u), 1.0, 1.0, 1.0);
            }";
        let counts = graph.buffer("counts", Buffer::new(16));
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        graph.pass(
            Pass::compute("spin", wgsl, "spin", Groups::Fixed([1, 1, 1])).bind("counts", counts),
        );
        graph.pass(Pass::fullscreen("show", wgsl, "show").target(color).bind("counts", counts));
        graph.output(Output::Color, color);
        Ok(())
    }
}

/// Invariant: an endless loop in a shader ends
#[test]
fn endless_loop_in_a_shader_ends() {
    let mut engine = stage::engine();
    let cloud = clouds::sphere(10, 1.0).cloud();
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 4);
    let mut renderer = stage::static_renderer::<SurfelshopPackage>(&engine, 10);
    let outputs = [Output::Color];
    let frame =
        stage::render(&mut engine, &mut renderer, &cloud, &Scene::default(), view, &outputs);
    let frame = frame.unwrap();
    assert_eq!(frame.image(&Output::Color).unwrap().data[1], 1.0);
}

/// A graph of every kind of pass and resource: upload, compute into a buffer and a texture, mip
/// levels, a persistent texture, a sampler, an override constant.
struct Multiple;

impl Renderer for Multiple {
    const INFO: UnitInfo = UnitInfo::new("multiple", "Multiple", "Uses every kind of pass.");
    type Params = ();

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, _frame: &Frame<()>, graph: &mut Graph) -> Result<()> {
        let wgsl = "
            override offset: f32 = 0.0;
            var<storage, read> input: array<f32>;
            var<storage, read_write> doubled: array<f32>;
            var ramp: texture_storage_2d<rgba32float, write>;
            @compute @workgroup_size(4) fn double(@builtin(global_invocation_id) id: vec3<u32>) {
                doubled[id.x] = 2.0 * input[id.x] + offset;
            }
            @compute @workgroup_size(1) fn fill(@builtin(global_invocation_id) id: vec3<u32>) {
                textureStore(ramp, id.xy, vec4(f32(id.x), f32(id.y), 0.0, 1.0));
            }
            var levels: texture_2d<f32>;
            var volume: texture_2d_array<f32>;
            var pick: sampler;
            @fragment fn level(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {
                return vec4(offset);
            }
            @fragment fn show(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {
                let blue = textureSampleLevel(levels, pick, vec2(0.5), 1.0).r;
                let red = textureSampleLevel(volume, pick, vec2(0.5), 1, 0.0).r;
                return vec4(input[1], red, blue, 1.0);
            }";
        let input = graph.upload("input", &[1f32, 2.0, 3.0, 4.0].map(f32::to_le_bytes).concat());
        let doubled = graph.buffer("doubled", Buffer::new(16));
        let ramp =
            graph.texture("ramp", Texture::fixed(Format::Rgba32Float, 4, 4).persistent("ramp"));
        let levels = graph.texture("levels", Texture::fixed(Format::Rgba16Float, 4, 4).mips(2));
        let layers = Texture::fixed(Format::Rgba16Float, 4, 4).depth(2, false);
        let layers = graph.texture("layers", layers);
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        let ramp_out = graph.texture("ramp out", Texture::view_sized(Format::Rgba32Float));
        graph.pass(
            Pass::compute("double", wgsl, "double", Groups::Fixed([1, 1, 1]))
                .bind("input", input)
                .bind("doubled", doubled)
                .constant("offset", 0.5),
        );
        let fill = Pass::compute("fill", wgsl, "fill", Groups::Fixed([4, 4, 1]));
        graph.pass(fill.bind("ramp", ramp));
        let target = |texture, mip, layer| Target { texture, mip, layer };
        for (to, value) in [
            (target(levels, 0, 0), 0.25),
            (target(levels, 1, 0), 0.75),
            (target(layers, 0, 0), 0.0),
            (target(layers, 0, 1), 0.5),
        ] {
            graph.pass(
                Pass::fullscreen("level", wgsl, "level").target(to).constant("offset", value),
            );
        }
        graph.pass(
            Pass::fullscreen("show", wgsl, "show")
                .target(color)
                .bind("input", doubled)
                .bind("levels", levels)
                .bind("volume", layers)
                .bind("pick", SamplerKind::Nearest),
        );
        let copy = "
            var ramp: texture_2d<f32>;
            @fragment fn copy(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {
                return textureLoad(ramp, vec2<u32>(p.xy), 0);
            }";
        graph.pass(Pass::fullscreen("copy", copy, "copy").target(ramp_out).bind("ramp", ramp));
        graph.output(Output::Color, color);
        graph.output(Output::Debug("ramp".into()), ramp_out);
        Ok(())
    }
}

#[test]
fn every_kind_of_pass_does_what_it_says() {
    let mut engine = stage::engine();
    let cloud = clouds::sphere(10, 1.0).cloud();
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 4);
    let mut renderer = stage::static_renderer::<SurfelshopPackage>(&engine, 11);
    let ramp = Output::Debug("ramp".into());
    for round in 0..2 {
        let outputs = [Output::Color, ramp.clone()];
        let frame =
            stage::render(&mut engine, &mut renderer, &cloud, &Scene::default(), view, &outputs)
                .unwrap();
        // Twice the second input plus a half; layer 1; mip level 1.
        assert_eq!(frame.image(&Output::Color).unwrap().pixel(2, 2), [4.5, 0.5, 0.75, 1.0]);
        assert_eq!(frame.image(&ramp).unwrap().pixel(3, 1), [3.0, 1.0, 0.0, 1.0]);
        let fill = frame.passes.iter().find(|pass| pass.name == "fill").unwrap();
        let ran = fill.state == surfelshop_render::PassState::Ran;
        assert_eq!(ran, round == 0, "what a key names is made once");
    }
}

#[test]
fn materials_are_those_of_the_nearest_surfel() {
    use glam::Vec3;
    use surfelshop_cloud::{Buffer, Column};
    let mut engine = stage::engine();
    let mut surfels = clouds::Surfels::default();
    surfels.push(Vec3::new(0.0, 0.0, 0.0), Vec3::Z, 0.5);
    surfels.push(Vec3::new(0.0, 0.0, 0.2), Vec3::Z, 0.2);
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 64);
    let plain = surfels.cloud();
    let column = Column::new(columns::MATERIAL, 1, Buffer::U32(vec![7, 9]));
    let with = plain.with_columns(vec![column]).unwrap();
    let mut at_center_and_side = |cloud| {
        let mut renderer = stage::static_renderer::<SurfelshopPackage>(&engine, 12);
        let outputs = [Output::Color];
        let scene = Scene::default();
        let frame = stage::render(&mut engine, &mut renderer, cloud, &scene, view, &outputs);
        let frame = frame.unwrap();
        let color = frame.image(&Output::Color).unwrap();
        [color.pixel(32, 32)[0], color.pixel(42, 32)[0], color.pixel(0, 0)[0]]
    };
    assert_eq!(at_center_and_side(&with), [9.0, 7.0, 0.0]);
    assert_eq!(at_center_and_side(&plain), [0.0, 0.0, 0.0]);
}

/// Fills a persistent texture in a first frame that the device refuses.
struct FailsFirst {
    n_frames: u32,
}

impl Renderer for FailsFirst {
    const INFO: UnitInfo = UnitInfo::new("fails-first", "Fails first", "Fails in its first frame.");
    type Params = ();

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self { n_frames: 0 })
    }

    fn frame(&mut self, _frame: &Frame<()>, graph: &mut Graph) -> Result<()> {
        let wgsl = "
            var kept: texture_2d<f32>;
            @fragment fn fill() -> @location(0) vec4<f32> { return vec4(0.25); }
            @fragment fn show() -> @location(0) vec4<f32> {
                return textureLoad(kept, vec2(0u), 0);
            }";
        let kept = Texture::fixed(Format::Rgba32Float, 8, 8).persistent("kept");
        let kept = graph.texture("kept", kept);
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        graph.pass(Pass::fullscreen("fill", wgsl, "fill").target(kept));
        graph.pass(Pass::fullscreen("show", wgsl, "show").bind("kept", kept).target(color));
        if self.n_frames == 0 {
            // Reads all levels of a texture while it draws into one of them: only the device
            // notices, when the frame is handed to it.
            let levels = graph.texture("levels", Texture::fixed(Format::Rgba32Float, 8, 8).mips(2));
            let to = Target { texture: levels, mip: 1, layer: 0 };
            graph.pass(Pass::fullscreen("bad", wgsl, "show").bind("kept", levels).target(to));
            graph.output(Output::Debug("levels".into()), color);
            let after = "
                var levels: texture_2d<f32>;
                @fragment fn copy() -> @location(0) vec4<f32> {
                    return textureLoad(levels, vec2(0u), 1);
                }";
            graph.pass(Pass::fullscreen("use", after, "copy").bind("levels", levels).target(color));
        }
        self.n_frames += 1;
        graph.output(Output::Color, color);
        Ok(())
    }
}

/// Invariant: a refused frame leaves nothing that a later one would trust
#[test]
fn a_refused_frame_fills_nothing_that_later_frames_would_trust() {
    let mut engine = stage::engine();
    let cloud = clouds::sphere(10, 1.0).cloud();
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 4);
    let mut renderer = stage::static_renderer::<SurfelshopPackage>(&engine, 13);
    let mut render = || {
        let outputs = [Output::Color];
        stage::render(&mut engine, &mut renderer, &cloud, &Scene::default(), view, &outputs)
    };
    render().expect_err("the device refuses the first frame");
    let second = render().unwrap();
    assert_eq!(second.image(&Output::Color).unwrap().data[0], 0.25);
}

/// Two persistent textures of equal size under equal keys.
struct SameKeys;

impl Renderer for SameKeys {
    const INFO: UnitInfo = UnitInfo::new("same-keys", "Same keys", "Keeps two textures.");
    type Params = ();

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, _frame: &Frame<()>, graph: &mut Graph) -> Result<()> {
        let wgsl = "
            override value: f32 = 0.0;
            var a: texture_2d<f32>;
            var b: texture_2d<f32>;
            @fragment fn fill() -> @location(0) vec4<f32> { return vec4(value); }
            @fragment fn show() -> @location(0) vec4<f32> {
                let at = vec2(0u);
                return vec4(textureLoad(a, at, 0).x, textureLoad(b, at, 0).x, 0.0, 1.0);
            }";
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        let [a, b] = [("irradiance", 0.25), ("prefiltered", 0.75)].map(|(label, value)| {
            let kept = Texture::fixed(Format::Rgba32Float, 8, 8).persistent("probe 1");
            let kept = graph.texture(label, kept);
            graph.pass(Pass::fullscreen(label, wgsl, "fill").target(kept).constant("value", value));
            kept
        });
        graph.pass(Pass::fullscreen("show", wgsl, "show").bind("a", a).bind("b", b).target(color));
        graph.output(Output::Color, color);
        Ok(())
    }
}

#[test]
fn equal_keys_keep_different_textures_apart() {
    let mut engine = stage::engine();
    let cloud = clouds::sphere(10, 1.0).cloud();
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 4);
    let mut renderer = stage::static_renderer::<SurfelshopPackage>(&engine, 14);
    let outputs = [Output::Color];
    let scene = Scene::default();
    let frame = stage::render(&mut engine, &mut renderer, &cloud, &scene, view, &outputs).unwrap();
    assert_eq!(frame.image(&Output::Color).unwrap().pixel(0, 0), [0.25, 0.75, 0.0, 1.0]);
}

/// A shader with a sum of a hundred thousand terms.
struct LongSum;

impl Renderer for LongSum {
    const INFO: UnitInfo = UnitInfo::new("long-sum", "Long sum", "Adds up many terms.");
    type Params = ();

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, _frame: &Frame<()>, graph: &mut Graph) -> Result<()> {
        // Too long for a compiler that recurses over it on an ordinary stack. The line is not
        // closed, so nothing of it reaches a driver.
        let wgsl = format!("fn shade() -> f32 {{ return 0.0{} ", "+1.0".repeat(60_000));
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        graph.pass(Pass::shading("long", &wgsl, "shade").target(color));
        graph.output(Output::Color, color);
        Ok(())
    }
}

#[test]
fn long_shaders_do_not_overflow_the_stack() {
    says(15, &["pass `long`"]);
}
