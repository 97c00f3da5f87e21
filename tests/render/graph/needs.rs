//! A renderer whose passes need what only some devices have.

use glam::DVec3;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::prelude::*;
use surfelshop_api::{Scene, static_plugin};
use surfelshop_render::RenderRequest;
use surfelshop_tests::{clouds, stage};

static_plugin! {
    id: "org.surfelshop.test.needs",
    renderers: [Halves],
}

/// Makes a picture with 16-bit floats where the device has them.
struct Halves;

const WITH: &str = "
    enable f16;
    #import surfelshop::surface
    fn shade(s: surface::Surface) -> vec4<f32> { return vec4(f32(0.25h), 0.0, 0.0, 1.0); }";
const WITHOUT: &str = "
    #import surfelshop::surface
    fn shade(s: surface::Surface) -> vec4<f32> { return vec4(0.25, 0.0, 0.0, 1.0); }";

impl Renderer for Halves {
    const INFO: UnitInfo = UnitInfo::new("halves", "Halves", "A quarter of red.");
    type Params = ();

    fn new(host: &HostInfo) -> Result<Self> {
        let limits = host.limits;
        assert!(limits.storage_buffers >= 4 && limits.buffer_bytes >= 1 << 27, "{limits:?}");
        assert!(limits.workgroup_invocations >= 256 && limits.texture_side >= 2048, "{limits:?}");
        Ok(Self)
    }

    fn frame(&mut self, _frame: &Frame<()>, graph: &mut Graph) -> Result<()> {
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        let everywhere = Pass::shading("in 32 bits", WITHOUT, "shade").target(color);
        let pass = Pass::shading("in 16 bits", WITH, "shade").target(color);
        graph.pass(pass.needs("f16").instead(everywhere));
        graph.output(Output::Color, color);
        Ok(())
    }
}

#[test]
fn what_runs_instead_is_explained() {
    let mut engine = stage::engine();
    let has = engine.gpu().host_info().features.iter().any(|feature| feature == "f16");
    let cloud = clouds::sphere(500, 1.0).cloud();
    let (scene, values) = (Scene::default(), Values::new());
    let clouds = [cloud.view()];
    let request = RenderRequest {
        clouds: &clouds,
        facts: cloud.facts(),
        scene: &scene,
        view: stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 16),
        values: &values,
        outputs: &[Output::Color],
        frame_index: 0,
        environment: None,
        stride: 1,
        detail_px: 0.0,
        parts: None,
        eye_dome: None,
    };
    let mut renderer = stage::static_renderer::<SurfelshopPackage>(&engine, 0);
    let rendered = engine.render(&mut renderer, &request).unwrap();
    let picture = &rendered.image(&Output::Color).unwrap().data;
    assert!(picture.chunks_exact(4).any(|pixel| pixel == [0.25, 0.0, 0.0, 1.0]));
    let explained = engine.explain(&renderer, &request, &rendered);
    let name = if has { "in 16 bits" } else { "in 32 bits" };
    let pass = explained.passes.iter().find(|pass| pass.name == name).unwrap();
    let words = match has {
        true => "; needs `f16`",
        false => "; runs instead of `in 16 bits`, which needs `f16`",
    };
    assert!(pass.why.contains(words), "{}", pass.why);
    let feature = explained.features.iter().find(|feature| feature.name == "f16").unwrap();
    assert_eq!((feature.here, feature.counts), (has, true));
}
