//! # `flat`: one colour per surfel
//!
//! The nearest surfel covers its disc with one normal and one albedo under the scene's lights. No
//! blending, and few parameters: the smallest complete renderer, to copy when
//! writing one.
//!
//! | parameter     | type   | default   | meaning                                           |
//! |---------------|--------|-----------|---------------------------------------------------|
//! | `ambient`     | float  | 0.08      | radiance of an unlit white surface, as a fraction |
//! | `ao-strength` | float  | 1         | how much of the cloud's ambient occlusion counts  |
//! | `ao-affects`  | choice | `ambient` | `ambient`, or `diffuse` and more for all light     |
//!
//! Limits: edges of discs show; that is what blending renderers are compared with.
//!
//! ```text
//! surfelshop render model.ply -r flat -o model.png
//! ```

use surfelshop_api::Occlusion;
use surfelshop_api::prelude::*;

params! {
    /// Settings of the flat renderer.
    pub struct Settings {
        /// Light that reaches every surface from everywhere, as a fraction of white.
        ambient: f32 { default: 0.08, range: 0.0..=1.0 },
        /// Ambient occlusion.
        occlusion: Occlusion { group: Occlusion::default() },
    }
}

struct Flat;

impl Renderer for Flat {
    const INFO: UnitInfo =
        UnitInfo::new("flat", "Flat surfels", "One normal and colour per surfel, no blending.");
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
        let p = &frame.params;
        let settings = graph.parameters(p);
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        graph.pass(
            Pass::shading("shade", include_str!("flat.wgsl"), "shade")
                .surface(SurfaceMode::Nearest)
                .bind("settings", settings)
                .occluded(p.occlusion.ao_strength, &frame.cloud)
                .target(color),
        );
        graph.output(Output::Color, color);
        Ok(())
    }
}

export_plugin! { id: "org.surfelshop.flat", renderers: [Flat] }
