//! # `{{id}}`: a graph of its own, with ink along edges
//!
//! Four passes: `shade` lights the surface that the host made visible, `measure` writes down what the
//! effect needs of each pixel (a small G-buffer), `edges` finds where that bends, and `ink` darkens the
//! light there. What is bound to
//! what follows from the names of the WGSL variables; passes run in the order in which they are declared,
//! and those that nobody asked for do not run: `--output debug.edges` leaves out `shade` and `ink`.
//!
//! | parameter | type  | default | meaning                                         |
//! |-----------|-------|---------|-------------------------------------------------|
//! | `ambient` | float | 0.08    | radiance of an unlit white surface              |
//! | `ink`     | float | 0.8     | how dark edges are: 0 leaves the light as it is |
//! | `width`   | int   | 1       | half the width of the lines                     |

use surfelshop_api::prelude::*;

params! {
    /// Settings of `{{id}}`: the panel, `--set` and `report` are made from these lines.
    pub struct Settings {
        /// Light that reaches every surface from everywhere, as a fraction of white.
        ambient: f32 { default: 0.08, range: 0.0..=1.0 },
        /// How dark edges are; 0 leaves the light as it is.
        ink: f32 { default: 0.8, range: 0.0..=1.0 },
        /// Half the width of the lines.
        width: u32 { default: 1, range: 1..=8, unit: "pixels" },
    }
}

struct {{Name}};

impl Renderer for {{Name}} {
    const INFO: UnitInfo = UnitInfo::new(
        "{{id}}",
        "{{title}}",
        "Lambert's law with ink along edges: begin here with a graph of your own.",
    );
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
        // The module `params` that all shaders here import: each parameter is a member of
        // `params::settings`.
        let settings = graph.settings("params", Members::of(&frame.params));
        let view_sized = || Texture::view_sized(Format::Rgba32Float);
        let lit = graph.texture("lit", view_sized());
        let measured = graph.texture("measured", view_sized());
        let color = graph.texture("color", view_sized());
        let edges = graph.texture("edges", view_sized());
        let per_pixel = Groups::PerPixel { divisor: 1 };
        // Visibility is the host's: a shading pass is called for the pixels that surfels cover.
        graph.pass(
            Pass::shading("shade", include_str!("shade.wgsl"), "shade")
                .settings(&settings)
                .target(lit),
        );
        graph.pass(
            Pass::compute(
                "measure",
                include_str!("measure.wgsl"),
                "measure",
                per_pixel,
            )
            .bind("measured", measured),
        );
        graph.pass(
            Pass::compute("edges", include_str!("edges.wgsl"), "find", per_pixel)
                .settings(&settings)
                .bind("measured", measured)
                .bind("found", edges),
        );
        graph.pass(
            Pass::compute("ink", include_str!("ink.wgsl"), "blend", per_pixel)
                .settings(&settings)
                .bind("lit", lit)
                .bind("edges", edges)
                .bind("color", color),
        );
        graph.output(Output::Color, color);
        graph.output(Output::Debug("edges".to_owned()), edges);
        Ok(())
    }
}

export_plugin! { id: "{{package}}",{{minor}} renderers: [{{Name}}] }
