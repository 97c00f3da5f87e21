//! # `ewa-phong`: blended splats with the half-vector highlight
//!
//! The baseline of the thesis: overlapping surfels are blended with Gaussian weights, filtered to
//! the pixels, into one normal and albedo per pixel, which is then lit: diffuse from the scene's lights, and a
//! highlight from the angle between the normal and the half vector of light and eye.
//!
//! | parameter   | type  | default | meaning                                                  |
//! |-------------|-------|---------|----------------------------------------------------------|
//! | `diffuse`   | float | 1       | factor on the diffuse term                               |
//! | `specular`  | float | 0.25    | radiance of the highlight's peak under a white light     |
//! | `shininess` | float | 64      | exponent of the highlight, 1 to 1024                      |
//! | `ambient`   | float | 0.08    | radiance of an unlit white surface                       |
//! | `ao-strength` | float | 1     | how much of the cloud's ambient occlusion counts         |
//! | `ao-affects` | choice | `ambient` | `ambient`, `diffuse`, or `all` for highlights too      |
//!
//! Method. `radiance = albedo (diffuse L max(n.l, 0) + ambient ao) + specular L max(n.h, 0)^m`, `ao`
//! on the other terms as well where `ao-affects` says so,
//! summed over the lights, with unit vectors and h the normalised sum of the vectors to light and
//! eye. The power is evaluated as `exp2(m log2 x)` from the sine of the angle, which keeps an
//! exponent of 1024 smooth (its lobe is 2 degrees wide).
//!
//! Deviations from the paper: the printed light vector `normalize(position)` points from the light
//! to the surface if `position` is the surface's, and the printed `lit(..., 1024)` was clamped to
//! 128 by the hardware of its time; here the vector points to the light and the exponent is what
//! it says (erratum T27). The eye vector is the pixel's own, not (0, 0, 1).
//!
//! The elliptical weighted average itself, object-space Gaussians joined with a screen-space
//! low-pass, is the host's surfel drawing and a setting of the scene (`--low-pass`), so that every
//! renderer over the surface buffer has it.
//!
//! Limits: no shadows.
//!
//! Source: Liu 2006, "High Quality Rendering for Point Sampled Geometry", appendix; Zwicker et al.
//! 2001, "Surface Splatting"; Ren et al. 2002, "Object Space EWA Surface Splatting".
//!
//! ```text
//! surfelshop render model.ply -r ewa-phong --set shininess=1024 -o model.png
//! ```

use surfelshop_api::prelude::*;

params! {
    /// Settings of the baseline.
    pub struct Settings {
        /// Factor on the diffuse term.
        diffuse: f32 { default: 1.0, range: 0.0..=1.0 },
        /// Radiance of the highlight's peak under a white light.
        specular: f32 { default: 0.25, range: 0.0..=1.0 },
        /// Exponent of the highlight: large is small and sharp.
        shininess: f32 { default: 64.0, range: 1.0..=1024.0, logarithmic: true },
        /// Light that reaches every surface from everywhere, as a fraction of white; ambient
        /// accessibility darkens it where the cloud has any.
        ambient: f32 { default: 0.08, range: 0.0..=1.0 },
        /// How much of the cloud's ambient occlusion counts, where it has any: 0 is none.
        ao_strength: f32 { default: 1.0, range: 0.0..=1.0 },
        /// What ambient occlusion darkens: light from everywhere around on matte surfaces, all
        /// light on them (diffuse), reflections of the surroundings too, or all, highlights
        /// included.
        ao_affects: AoAffects { default: AoAffects::Ambient },
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
        let p = &frame.params;
        let uniform = Uniform::new().f32(p.diffuse).f32(p.specular).f32(p.shininess).f32(p.ambient);
        let uniform = uniform.occlusion(p.ao_strength, p.ao_affects, &frame.cloud);
        let settings = graph.uniform(uniform);
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        graph.pass(
            Pass::shading("phong", include_str!("ewa_phong.wgsl"), "shade")
                .merges(true)
                .surface(SurfaceMode::Blended)
                .bind("settings", settings)
                .occluded(p.ao_strength, &frame.cloud)
                .feature("surfelshop::phong::HIGHLIGHTS", p.specular > 0.0)
                .target(color),
        );
        graph.output(Output::Color, color);
        Ok(())
    }
}

export_plugin! { id: "org.surfelshop.ewa-phong", renderers: [EwaPhong] }
