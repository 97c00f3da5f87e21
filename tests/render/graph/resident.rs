//! Bytes that are sent once and stay on the device, by count.

use glam::DVec3;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Value;
use surfelshop_api::prelude::*;
use surfelshop_api::{Scene, static_plugin};
use surfelshop_render::{Engine, RendererView};
use surfelshop_tests::{clouds, stage};

static_plugin! {
    id: "org.surfelshop.test.resident",
    renderers: [Table, Plain],
}

const N: u64 = 100_000;

params! {
    struct Which {
        /// The number in the table.
        number: i32 { default: 1, range: 1..=9 },
    }
}

/// Shows a number of a table that stays.
struct Table;

const SHOW: &str = "
    var<storage, read> table: array<f32>;
    var color: texture_storage_2d<rgba32float, write>;
    @compute @workgroup_size(8, 8) fn show(@builtin(global_invocation_id) id: vec3<u32>) {
        if all(id.xy < textureDimensions(color)) {
            textureStore(color, id.xy, vec4(table[arrayLength(&table) - 1u], 0.0, 0.0, 1.0));
        }
    }";

impl Renderer for Table {
    const INFO: UnitInfo = UnitInfo::new("table", "Table", "Shows a number of a table.");
    type Params = Which;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, frame: &Frame<Which>, graph: &mut Graph) -> Result<()> {
        let value = frame.params.number as f32;
        let key = format!("a table of {value}");
        let bytes =
            || vec![value; N as usize].iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>();
        let table = graph.resident("table", &key, 4 * N, bytes);
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        let groups = Groups::PerPixel { divisor: 1 };
        let pass = Pass::compute("show", SHOW, "show", groups);
        graph.pass(pass.bind("table", table).bind("color", color));
        graph.output(Output::Color, color);
        Ok(())
    }
}

/// Shows nothing but black.
struct Plain;

impl Renderer for Plain {
    const INFO: UnitInfo = UnitInfo::new("plain", "Plain", "Black.");
    type Params = ();

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, _frame: &Frame<()>, graph: &mut Graph) -> Result<()> {
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        let wgsl = "#import surfelshop::surface::Surface
            fn shade(s: Surface) -> vec4<f32> { return vec4(0.0); }";
        graph.pass(Pass::shading("shade", wgsl, "shade").target(color));
        graph.output(Output::Color, color);
        Ok(())
    }
}

/// Bytes that crossed with a frame, and how red it is.
fn frame(engine: &mut Engine, renderer: &mut RendererView, number: i64) -> (usize, f32) {
    let cloud = clouds::sphere(50, 1.0).cloud();
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 8);
    let values = [("number".to_owned(), Value::Int(number))].into();
    let outputs = [Output::Color];
    let scene = Scene::default();
    let drawn =
        stage::render_with(engine, renderer, &cloud, &scene, view, &values, &outputs).unwrap();
    (renderer.graph().data.len(), drawn.image(&Output::Color).unwrap().data[0])
}

/// Invariant: bytes that stay cross once, and again only when they were dropped or the device is another
#[test]
fn bytes_cross_once_and_again_when_they_are_gone() {
    let all = 4 * N as usize;
    let mut engine = stage::fresh_engine();
    let mut renderer = stage::static_renderer::<SurfelshopPackage>(&engine, 0);
    assert_eq!(frame(&mut engine, &mut renderer, 1), (all, 1.0));
    for _ in 0..5 {
        assert_eq!(frame(&mut engine, &mut renderer, 1), (0, 1.0));
    }
    assert_eq!(engine.counters().resident_uploads, 1);
    assert_eq!(engine.counters().resident_bytes, all as u64);
    assert_eq!(engine.counters().plans, 2, "with the bytes and without them");

    // Another instance of the unit finds them; another key does not, and then both are there.
    let mut other = stage::static_renderer::<SurfelshopPackage>(&engine, 0);
    assert_eq!(frame(&mut engine, &mut other, 1), (0, 1.0));
    assert_eq!(frame(&mut engine, &mut renderer, 2), (all, 2.0));
    assert_eq!(frame(&mut engine, &mut other, 1), (0, 1.0));
    assert_eq!(frame(&mut engine, &mut renderer, 2), (0, 2.0));
    assert_eq!(engine.counters().resident_bytes, 2 * all as u64);

    // What no frame has used for 64 frames is gone.
    let mut plain = stage::static_renderer::<SurfelshopPackage>(&engine, 1);
    for _ in 0..64 {
        frame(&mut engine, &mut plain, 1);
    }
    assert_eq!(frame(&mut engine, &mut renderer, 1), (all, 1.0));
    assert_eq!(engine.counters().resident_uploads, 3);
    assert_eq!(engine.counters().resident_bytes, all as u64);

    // On another device nothing is there.
    let mut anew = stage::fresh_engine();
    assert_eq!(frame(&mut anew, &mut renderer, 1), (all, 1.0));
    assert_eq!(frame(&mut anew, &mut renderer, 1), (0, 1.0));

    // A graph that is to be kept has them in every frame.
    renderer.send_all();
    assert_eq!(frame(&mut anew, &mut renderer, 1), (all, 1.0));
}
