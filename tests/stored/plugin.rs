//! One unit of each kind, as simple as they come: built once for each revision of the interface and stored
//! as `VERSION/plugin-x86_64-linux.so.gz`, so that today's host is tried with yesterday's plugins.
//!
//! It was built outside this tree, against `host/sdk/api` of the revision, with
//! `opt-level = "z"`, `lto = true`, `codegen-units = 1` and `strip = true`, and with
//! `--remap-path-prefix` for the folders of the tree and of cargo: those of 3.0, 3.4 and 3.9 by rustc 1.95, the
//! others by Debian's rustc 1.85, so that some are another compiler's.
//! Its package has version 1.2.3 and the authors "A. Author" and "B. Author".

use surfelshop_api::columns::{AO, Values};
use surfelshop_api::prelude::*;
use surfelshop_api::tool::NewColumn;

params! {
    /// Settings of all units.
    pub struct Settings {
        /// How bright it is.
        gain: f32 { default: 1.0, range: 0.0..=4.0 },
    }
}

const SHADER: &str = "
    #import surfelshop::surface::Surface
    #import surfelshop::light
    struct Settings { gain: f32 }
    var<uniform> settings: Settings;
    fn shade(s: Surface) -> vec4<f32> {
        var arriving = vec3(0.0);
        for (var i = 0u; i < light::lights.count; i++) {
            let source = light::lights.items[i];
            arriving += source.radiance * max(dot(s.normal, source.towards), 0.0);
        }
        return vec4(settings.gain * s.albedo * arriving, 1.0);
    }
";

struct Shade;

impl Renderer for Shade {
    const INFO: UnitInfo = UnitInfo::new("stored", "Stored", "Lambert's law.");
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
        let settings = graph.uniform(Uniform::new().f32(frame.params.gain));
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        let pass = Pass::shading("shade", SHADER, "shade");
        graph.pass(pass.bind("settings", settings).target(color));
        graph.output(Output::Color, color);
        Ok(())
    }
}

struct Ray;

impl Tracer for Ray {
    const INFO: UnitInfo = UnitInfo::new("stored", "Stored", "Pixel coordinates.");
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn tile(
        &self,
        frame: &Frame<Settings>,
        _scene: &Traced<'_>,
        tile: Tile,
        pixels: &mut [f32],
        job: &Job<'_>,
    ) -> Result<()> {
        job.check()?;
        for (i, pixel) in pixels.chunks_exact_mut(4).enumerate() {
            let (x, y) = (tile.x + i as u32 % tile.width, tile.y + i as u32 / tile.width);
            pixel.copy_from_slice(&[frame.params.gain * x as f32, y as f32, 0.0, 1.0]);
        }
        Ok(())
    }
}

struct Half;

impl Tool for Half {
    const INFO: UnitInfo = UnitInfo::new("stored", "Stored", "Sets ao to half the gain.");
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let values = job.map(cloud.len, 0.0..1.0, |_| 0.5 * params.gain)?;
        let column = NewColumn { name: AO, components: 1, values: Values::F32(&values) };
        job.edit(&Edit::Columns(vec![column]))
    }
}

export_plugin! {
    id: "org.surfelshop.test.stored",
    renderers: [Shade],
    tracers: [Ray],
    tools: [Half],
}
