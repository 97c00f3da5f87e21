//! A renderer that describes what a test tells it.

use super::stage;
use glam::DVec3;
use std::sync::{Mutex, PoisonError};
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::prelude::*;
use surfelshop_api::static_plugin;
use surfelshop_cloud::Cloud;
use surfelshop_render::{Engine, RenderError, Rendered};
use surfelshop_tests::stage::{static_renderer, view};

static_plugin! { id: "org.surfelshop.test.gaussians", renderers: [Description] }

params! {
    /// Which graph.
    pub struct Script {
        /// Its number.
        script: u32 { default: 0, range: 0..=10_000 },
    }
}

type Describe = Box<dyn Fn(&Frame<Script>, &mut Graph) + Send>;

static SCRIPTS: Mutex<Vec<Describe>> = Mutex::new(Vec::new());

/// Describes what the script of its number says.
struct Description;

impl Renderer for Description {
    const INFO: UnitInfo = UnitInfo::new("told", "Description", "Describes what it is told.");
    type Params = Script;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, frame: &Frame<Script>, graph: &mut Graph) -> Result<()> {
        let scripts = SCRIPTS.lock().unwrap_or_else(PoisonError::into_inner);
        scripts[frame.params.script as usize](frame, graph);
        // Without normals clouds are no surfaces.
        graph.take(&(0..frame.cloud.clouds.len() as u32).collect::<Vec<_>>());
        Ok(())
    }
}

/// Pixels on a side of the pictures.
pub(super) const SIZE: u32 = 16;

/// What a graph draws of clouds.
pub(super) fn drawn(
    engine: &mut Engine,
    clouds: &[&Cloud],
    describe: impl Fn(&Frame<Script>, &mut Graph) + Send + 'static,
) -> std::result::Result<Rendered, RenderError> {
    drawn_at(engine, clouds, SIZE, describe)
}

/// The same with so many pixels on a side.
pub(super) fn drawn_at(
    engine: &mut Engine,
    clouds: &[&Cloud],
    size: u32,
    describe: impl Fn(&Frame<Script>, &mut Graph) + Send + 'static,
) -> std::result::Result<Rendered, RenderError> {
    let mut scripts = SCRIPTS.lock().unwrap_or_else(PoisonError::into_inner);
    scripts.push(Box::new(describe));
    let number = Value::Int(scripts.len() as i64 - 1);
    drop(scripts);
    let mut renderer = static_renderer::<SurfelshopPackage>(engine, 0);
    let values: Values = [("script".to_owned(), number)].into();
    let front = view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, size);
    stage::frame(engine, &mut renderer, clouds, front, &values, &[Output::Color])
}

/// Holds the line that a graph is refused with against words of it; the engine works on afterwards.
#[track_caller]
pub(super) fn refused(
    engine: &mut Engine,
    clouds: &[&Cloud],
    words: &[&str],
    describe: impl Fn(&Frame<Script>, &mut Graph) + Send + 'static,
) {
    let line = drawn(engine, clouds, describe).err().unwrap().to_string();
    assert!(!line.contains('\n'), "more than a line: {line}");
    for word in words {
        assert!(line.contains(word), "`{word}` is missing in: {line}");
    }
    let good = drawn(engine, clouds, |_, graph| {
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        graph.pass(one("splats", 1).target(color));
        graph.output(Output::Color, color);
    });
    let good = stage::pixels(&good.unwrap(), &Output::Color);
    assert!(good[(SIZE * SIZE / 2 + SIZE / 2) as usize][3] > 0.5, "a good graph still works");
}

/// Splats in the middle of the picture that carry ones.
const ONE: &str = "
    #import surfelshop::splat
    fn one(i: u32) -> splat::Splat {
        var s = splat::conic(vec2(8.0), vec3(0.1, 0.0, 0.1), 1.0 + f32(i));
        s.payload = array(vec4(1.0), vec4(1.0), vec4(1.0), vec4(1.0));
        return s;
    }
    fn same(p: splat::Pixel) -> splat::Fragment {
        return splat::Fragment(p.opacity, p.payload);
    }
";

/// A pass of so many of them.
pub(super) fn one(name: &str, n: u64) -> Pass {
    Pass::splats(name, ONE, "one", Footprint::Conic, n)
}
