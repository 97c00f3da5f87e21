//! # `{{id}}`: translucent surfels
//!
//! One WGSL function, `draw` in `splat.wgsl`, is called for each surfel of the clouds in view and says
//! what it looks like: a flat Gaussian. The host sorts these splats and puts them over one another;
//! `resolve.wgsl` makes a picture of the sums.
//!
//! | parameter | type  | default | meaning                                                 |
//! |-----------|-------|---------|---------------------------------------------------------|
//! | `opacity` | float | 0.9     | of each surfel at its centre                            |
//! | `size`    | float | 1       | factor on standard deviations, which are half of radii  |
//! | `ambient` | float | 0.08    | radiance of an unlit white surface                      |

use surfelshop_api::prelude::*;

params! {
    /// Settings of `{{id}}`: the panel, `--set` and `report` are made from these lines.
    pub struct Settings {
        /// Opacity of each surfel at its centre.
        opacity: f32 { default: 0.9, range: 0.0..=1.0 },
        /// Factor on standard deviations, which are half of radii.
        size: f32 { default: 1.0, range: 0.1..=4.0, logarithmic: true },
        /// Light that reaches every surface from everywhere, as a fraction of white.
        ambient: f32 { default: 0.08, range: 0.0..=1.0 },
    }
}

struct {{Name}};

impl Renderer for {{Name}} {
    const INFO: UnitInfo = UnitInfo::new(
        "{{id}}",
        "{{title}}",
        "Translucent surfels: begin here with a splat function of your own.",
    );
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
        // The module `params` of shaders: each parameter is a member of `params::settings`.
        let settings = graph.settings("params", Members::of(&frame.params));
        let all: Vec<u32> = (0..).take(frame.cloud.clouds.len()).collect();
        // Each column is a function of the module `cloud`, from a surfel's number to its value.
        let read = [
            BufferColumn::new(columns::POSITION, 3),
            BufferColumn::new(columns::NORMAL, 3),
            BufferColumn::new(columns::RADIUS, 1),
            BufferColumn::new(columns::COLOR, 3).or(0.5),
        ];
        let (n, cloud) = graph.columns("cloud", &frame.cloud, &all, &read);
        let sums = graph.texture("sums", Texture::view_sized(Format::Rgba32Float));
        graph.pass(
            Pass::splats(
                "splats",
                include_str!("splat.wgsl"),
                "draw",
                Footprint::Conic,
                n,
            )
            .reads(&cloud)
            .settings(&settings)
            .target(sums),
        );
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        // A compute pass, since not every device draws into 32-bit floats.
        let per_pixel = Groups::PerPixel { divisor: 1 };
        graph.pass(
            Pass::compute(
                "resolve",
                include_str!("resolve.wgsl"),
                "resolve",
                per_pixel,
            )
            .bind("sums", sums)
            .bind("color", color),
        );
        // Depth and normals are the host's, of surfels as discs. A graph that draws clouds in their
        // place says `graph.take(&all)`, and offers outputs of its own.
        graph.output(Output::Color, color);
        Ok(())
    }
}

export_plugin! { id: "{{package}}",{{minor}} renderers: [{{Name}}] }
