//! # `{{id}}`: Lambert's law with a coloured rim
//!
//! One WGSL function, `shade` in `shade.wgsl`, is called for each pixel that the surface covers. The host
//! draws the surfels, blends them and says where the lights are.
//!
//! | parameter   | type   | default           | meaning                  |
//! |-------------|--------|-------------------|--------------------------|
//! | `rim`       | colour | `0.2,0.4,1` (linear) | radiance of the rim |
//! | `sharpness` | float  | 3                 | how narrow the rim is    |

use surfelshop_api::prelude::*;

params! {
    /// Settings of `{{id}}`: the panel, `--set` and `report` are made from these lines.
    pub struct Settings {
        /// Radiance of the rim.
        rim: [f32; 3] { default: [0.2, 0.4, 1.0] },
        /// How narrow the rim is.
        sharpness: f32 { default: 3.0, range: 0.5..=16.0, logarithmic: true },
    }
}

struct {{Name}};

impl Renderer for {{Name}} {
    const INFO: UnitInfo = UnitInfo::new(
        "{{id}}",
        "{{title}}",
        "Lambert's law with a coloured rim: begin here with a shading function of your own.",
    );
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
        // The module `params` of shaders: each parameter is a member of `params::settings`.
        let settings = graph.settings("params", Members::of(&frame.params));
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        graph.pass(
            Pass::shading("shade", include_str!("shade.wgsl"), "shade")
                .settings(&settings)
                .merges(true)
                .target(color),
        );
        graph.output(Output::Color, color);
        Ok(())
    }
}

export_plugin! { id: "{{package}}",{{minor}} renderers: [{{Name}}] }
