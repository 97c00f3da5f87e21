//! # `ewa-phong`: blended splats with the half-vector highlight
//!
//! The baseline of the thesis: overlapping surfels are blended with Gaussian weights, filtered to
//! the pixels, into one normal and albedo per pixel, which is then lit by the scene's lights.
//!
//! | parameter     | type   | default   | meaning                                                |
//! |---------------|--------|-----------|--------------------------------------------------------|
//! | `diffuse`     | float  | 1         | factor on the diffuse term                             |
//! | `specular`    | float  | 0.25      | radiance of the highlight's peak under a white light   |
//! | `shininess`   | float  | 64        | exponent of the highlight, 1 to 1024                   |
//! | `ambient`     | float  | 0.08      | radiance of an unlit white surface                     |
//! | `ao-strength` | float  | 1         | how much of the cloud's ambient occlusion counts       |
//! | `ao-affects`  | choice | `ambient` | `ambient`, `diffuse`, or `all` for highlights too      |
//!
//! Method. `radiance = albedo (diffuse L max(n.l, 0) + ambient ao) + specular L max(n.h, 0)^m`, `ao`
//! on the other terms as well where `ao-affects` says so, summed over the lights; h is the normalised
//! sum of the unit vectors to light and eye. The power is evaluated as `exp2(m log2 x)` from the sine
//! of the angle. The filter is the host's and a setting of the scene (`--low-pass`).
//!
//! Deviations from the paper: the vector to the light points to the light, and the exponent is what it
//! says, not clamped to 128 (erratum T27). The vector to the eye is the pixel's own, not (0, 0, 1).
//!
//! Limits: no shadows. Example: `surfelshop render model.ply -r ewa-phong --set shininess=1024 -o a.png`
//!
//! Source: Liu 2006, "High Quality Rendering for Point Sampled Geometry", appendix; Zwicker et al.
//! 2001, "Surface Splatting"; Ren et al. 2002, "Object Space EWA Surface Splatting".

use surfelshop_api::prelude::*;
use surfelshop_api::{Occlusion, Phong};

params! {
    /// Settings of the baseline.
    pub struct Settings {
        /// Phong's four.
        phong: Phong { group: Phong::default() },
        /// Ambient occlusion.
        occlusion: Occlusion { group: Occlusion::default() },
    }
}

struct EwaPhong;

impl Renderer for EwaPhong {
    const INFO: UnitInfo = UnitInfo::new(
        "ewa-phong",
        "Blended splats, Phong lighting",
        "Gaussian-blended surfels with diffuse light and a half-vector highlight.",
    );
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
        let Settings { phong, occlusion } = &frame.params;
        let settings = graph.parameters(&frame.params);
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        graph.pass(
            Pass::shading("phong", include_str!("ewa_phong.wgsl"), "shade")
                .merges(true)
                .bind("settings", settings)
                .occluded(occlusion.ao_strength, &frame.cloud)
                .feature("surfelshop::phong::HIGHLIGHTS", phong.specular > 0.0)
                .target(color),
        );
        graph.output(Output::Color, color);
        Ok(())
    }
}

export_plugin! { id: "org.surfelshop.ewa-phong", renderers: [EwaPhong] }
