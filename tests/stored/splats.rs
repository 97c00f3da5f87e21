//! A renderer of what came with ABI 3.9: it needs columns of a cloud, reads them on the device, draws splats of
//! them and takes their clouds from the host. Built as `plugin.rs` was, by rustc 1.95, and stored as
//! `VERSION/splats-x86_64-linux.so.gz`.

use surfelshop_api::columns::{OPACITY, POSITION, SPLAT_ROTATION, SPLAT_SCALE};
use surfelshop_api::prelude::*;

params! {
    /// Settings of the renderer.
    pub struct Settings {
        /// Factor on opacities.
        gain: f32 { default: 1.0, range: 0.0..=4.0 },
    }
}

const SPLAT: &str = "
    #import surfelshop::splat
    #import cloud
    struct Settings { gain: f32 }
    var<uniform> settings: Settings;
    fn draw(i: u32) -> splat::Splat {
        let turn = splat::rotation(cloud::splat_rotation(i));
        let scale = cloud::splat_scale(i);
        let axes = mat3x3(scale.x * turn[0], scale.y * turn[1], scale.z * turn[2]);
        var s = splat::gaussian(cloud::position(i), axes, 0.3, false);
        s.opacity *= min(settings.gain * cloud::opacity(i), 1.0);
        s.payload[0] = vec4(cloud::tint(i), 1.0);
        return s;
    }
";

const RESOLVE: &str = "
    var sums: texture_2d<f32>;
    @fragment
    fn resolve(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
        let sum = textureLoad(sums, vec2<u32>(at.xy), 0);
        return vec4(sum.rgb / max(sum.w, 1e-6), min(sum.w, 1.0));
    }
";

const NEEDS: &[NeedInfo] = &[
    NeedInfo::column(SPLAT_SCALE, 2),
    NeedInfo::column(SPLAT_ROTATION, 4),
    NeedInfo::column(OPACITY, 1).optional(),
];

struct Splats;

impl Renderer for Splats {
    const INFO: UnitInfo = UnitInfo::new("stored-splats", "Stored splats", "Gaussians in space.");
    type Params = Settings;
    const NEEDS: &'static [NeedInfo] = NEEDS;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
        let mine = frame.cloud.fulfilling(NEEDS);
        graph.take(&mine);
        let settings = graph.parameters(&frame.params);
        let columns = [
            BufferColumn::new(POSITION, 3),
            BufferColumn::new(SPLAT_SCALE, 3),
            BufferColumn::new(SPLAT_ROTATION, 4).f16(),
            BufferColumn::new(OPACITY, 1).unorm8().or(1.0),
            BufferColumn::new("tint", 3).or(0.5),
        ];
        let (n, cloud) = graph.columns("cloud", &frame.cloud, &mine, &columns);
        let view_sized = |format| Texture::view_sized(format);
        let sums = graph.texture("sums", view_sized(Format::Rgba32Float));
        let depth = graph.texture("depth", view_sized(Format::R32Float));
        let color = graph.texture("color", view_sized(Format::Rgba32Float));
        graph.pass(
            Pass::splats("splats", SPLAT, "draw", Footprint::Conic, n)
                .composed(Composition::Over)
                .tested(true)
                .reads(&cloud)
                .bind("settings", settings)
                .target(sums)
                .depth(SplatDepth::Expected, depth),
        );
        graph
            .pass(Pass::fullscreen("resolve", RESOLVE, "resolve").bind("sums", sums).target(color));
        graph.output(Output::Color, color);
        graph.output(Output::Depth, depth);
        Ok(())
    }
}

export_plugin! { id: "org.surfelshop.test.stored-splats", renderers: [Splats] }
