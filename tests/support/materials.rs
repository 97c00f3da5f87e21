//! A renderer that no plugin is needed for.

use surfelshop_api::prelude::*;

/// Shows materials as brightness.
#[derive(Debug)]
pub struct Materials;

impl Renderer for Materials {
    const INFO: UnitInfo = UnitInfo::new("materials", "Materials", "Shows material indices.");
    type Params = ();

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, _frame: &Frame<()>, graph: &mut Graph) -> Result<()> {
        let wgsl = "
            #import surfelshop::surface::{Surface, material_at}
            fn shade(s: Surface) -> vec4<f32> { return vec4(f32(material_at(s.pixel))); }";
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        graph.pass(Pass::shading("materials", wgsl, "shade").target(color));
        graph.output(Output::Color, color);
        Ok(())
    }
}
