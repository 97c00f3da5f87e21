//! # `environment`: natural light
//!
//! Light that arrives from far away in every direction, as photographed by a light probe: diffuse
//! from nine numbers a channel, specular from the mirrored direction in a map that was blurred
//! beforehand. Chapter 3 of the thesis, with a physically based model beside its own.
//!
//! | parameter    | type   | default | meaning                                                     |
//! |--------------|--------|---------|-------------------------------------------------------------|
//! | `model`      | choice | `ggx`   | `ggx` microfacets, or `thesis`: Fresnel times a blurred map |
//! | `kd`         | float  | 1       | weight of the diffuse part                                  |
//! | `ks`         | float  | 1       | weight of the specular part                                 |
//! | `ior`        | float  | 1.5     | index of refraction                                         |
//! | `roughness`  | float  | 0.4     | of `ggx`; 0 is a mirror                                     |
//! | `metallic`   | float  | 0       | of `ggx`; 1 reflects in the surface's own colour            |
//! | `multiple-scattering` | bool | true | of `ggx`: count light that is reflected more than once |
//! | `c`          | float  | 0.3     | of `thesis`: eccentricity, 0 is a mirror                    |
//! | `shading`    | choice | `pixel` | light each `pixel`, or each `surfel` as in the paper        |
//! | `antialias`  | bool   | true    | widen highlights where a pixel shows several normals        |
//! | `sh-order`   | int    | 2       | spherical harmonics of the diffuse part                     |
//! | `sun`        | bool   | true    | treat a dominant small light as one, beside the harmonics   |
//! | `window`     | bool   | true    | damp harmonics that ring below black; cut off the rest      |
//! | `ao-strength` | float | 1      | how much of the cloud's ambient occlusion counts            |
//! | `ao-affects` | choice | `reflections` | `ambient`, `diffuse`, `reflections` or `all`         |
//! | `background` | choice | `none`  | `none`, `sharp` or `blurred`                                |
//!
//! Method. Diffuse: `kd albedo ao E(n) / pi`, with E from harmonics that the host projected in f64
//! from the unblurred probe, evaluated as polynomials of the normal. Specular, `thesis`: `ks F L`
//! with the unpolarised Fresnel term and the environment blurred by a Gaussian on the sphere as
//! wide as the distribution's lobe; `ggx`: `ks (f0 scale + bias) m L` with L prefiltered by the
//! lobe, the other factor from a table and m for light that is reflected more than once. Both maps
//! are made once for an environment and kept.
//!
//! Deviations from the paper: errata T2 to T17; in short, signs and constants of the harmonics,
//! a solid angle per texel, Fresnel with its half, the distribution squared and used once, and
//! accessibility on the diffuse part and, less, on the specular one (`ao-affects` says on which
//! terms; highlights of the scene's lights only with `all`). Nothing is random.
//!
//! Without an environment in the scene the scene's lights alone shine, on a diffuse surface; with
//! one they are added, but for those that follow the camera. No specular pass is described where `ks` is 0, no harmonics where `kd` is.
//!
//! Limits: light is not blocked by the object itself, except by a baked `ao`; GGX is seen as along
//! the normal when the map is filtered, so highlights do not stretch at grazing angles.
//!
//! Source: Liu 2006, "High Quality Rendering for Point Sampled Geometry", chapter 3; Ramamoorthi &
//! Hanrahan 2001; Karis 2013; Fdez-Aguera 2019.
//!
//! ```text
//! surfelshop render model.ply -r environment --env uffizi.hdr --set roughness=0.2 -o model.png
//! ```

use surfelshop_api::Occlusion;
use surfelshop_api::graph::Members;
use surfelshop_api::prelude::*;
use surfelshop_shading::{Model, NaturalLight, NaturalLighting};

choices! {
    /// What stands behind the object.
    pub enum Backdrop {
        /// The scene's own background.
        None = "none",
        /// The environment.
        Sharp = "sharp",
        /// The environment out of focus.
        Blurred = "blurred",
    }
}

choices! {
    /// Where light is computed.
    pub enum Rate {
        /// For each pixel, from the blended normal.
        Pixel = "pixel",
        /// For each surfel, and then blended, as in the thesis.
        Surfel = "surfel",
    }
}

params! {
    /// Settings of the material and of the approximations.
    pub struct Settings {
        /// How light is reflected at the surface.
        model: Model { default: Model::Ggx },
        /// Weight of the diffuse part.
        kd: f32 { default: 1.0, range: 0.0..=1.0, label: "diffuse" },
        /// Weight of the specular part.
        ks: f32 { default: 1.0, range: 0.0..=1.0, label: "specular" },
        /// Index of refraction: 1.33 is water, 1.5 glass or plastic, 2.4 diamond.
        ior: f32 { default: 1.5, range: 0.2..=4.0, label: "refraction index" },
        /// Roughness of the ggx model: 0 is a mirror.
        roughness: f32 { default: 0.4, range: 0.0..=1.0 },
        /// How much of a metal the surface is, in the ggx model.
        metallic: f32 { default: 0.0, range: 0.0..=1.0 },
        /// Whether light counts that microfacets reflect more than once.
        multiple_scattering: bool { default: true, label: "multi-scatter" },
        /// Eccentricity of the thesis's model: 0 is a mirror, 1 dull.
        c: f32 { default: 0.3, range: 0.0..=1.0, label: "eccentricity" },
        /// Where light is computed.
        shading: Rate { default: Rate::Pixel },
        /// Widen highlights where one pixel shows several normals, so that they do not sparkle.
        antialias: bool { default: true },
        /// Order of the spherical harmonics: 9 numbers at 2, 25 at 4. Odd ones above 1 add nothing to diffuse light.
        sh_order: i32 { default: 2, range: 1..=5, quality: true, label: "harmonics order" },
        /// Treat a dominant small light, such as the sun, as a light of its own.
        sun: bool { default: true, label: "separate sun" },
        /// Damp harmonics that ring far below black, and cut off what little is left of it.
        window: bool { default: true, label: "damp ringing" },
        /// Ambient occlusion.
        occlusion: Occlusion { group: Occlusion::affecting(AoAffects::Reflections) },
        /// What stands behind the object.
        background: Backdrop { default: Backdrop::None },
    }
}

impl Settings {
    /// Roughness or eccentricity, as the model has it.
    fn spread(&self) -> f32 {
        match self.model {
            Model::Ggx => self.roughness,
            Model::Thesis => self.c,
        }
    }

    fn lighting(&self) -> NaturalLighting {
        NaturalLighting {
            model: self.model,
            diffuse: self.kd > 0.0,
            specular: self.ks > 0.0,
            sh_order: self.sh_order,
            sun: self.sun,
            window: self.window,
            multiple_scattering: self.multiple_scattering,
            antialias: self.antialias && self.spread() < DULL,
            ao_strength: self.occlusion.ao_strength,
            ao_affects: self.occlusion.ao_affects,
        }
    }

    fn members(&self, background_level: f32) -> Members {
        let at_right_angle = (self.ior - 1.0) / (self.ior + 1.0);
        Members::new()
            .f32("kd", self.kd)
            .f32("ks", self.ks)
            .f32("ior", self.ior)
            .f32("f0", at_right_angle * at_right_angle)
            .f32("spread", self.spread())
            .f32("metallic", self.metallic)
            .f32("background_level", background_level)
    }
}

/// From this spread on nothing sparkles that could be widened.
const DULL: f32 = 0.7;

/// Texels along the side of what a blurred background shows.
const BLURRED_SIDE: f32 = 64.0;

struct EnvironmentLighting {
    light: NaturalLight,
}

impl Renderer for EnvironmentLighting {
    const INFO: UnitInfo = UnitInfo::new(
        "environment",
        "Environment lighting",
        "Natural light from a probe: spherical harmonics for matte, a prefiltered map for shine.",
    );
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self { light: NaturalLight::new() })
    }

    fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
        let p = &frame.params;
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        let lit = frame.environment.as_ref();
        let parts = (lit, p.kd > 0.0, p.ks > 0.0, p.model);
        let entry = match parts {
            (None, ..) => "shade_lights",
            (Some(_), _, false, _) => "shade_diffuse",
            (Some(_), false, true, Model::Thesis) => "shade_specular_thesis",
            (Some(_), true, true, Model::Thesis) => "shade_thesis",
            (Some(_), false, true, Model::Ggx) => "shade_specular_ggx",
            (Some(_), true, true, Model::Ggx) => "shade_ggx",
        };
        let pass = Pass::shading("environment", include_str!("environment.wgsl"), entry)
            .merges(true)
            .surface(SurfaceMode::Blended)
            .per_surfel(p.shading == Rate::Surfel)
            .target(color);
        let mut pass = self.light.light(frame, &p.lighting(), graph, pass);
        let mut background = 0.0;
        if let Some(environment) = lit
            && p.background != Backdrop::None
        {
            background = background_level(environment, frame, p.background);
            let blurred = p.background == Backdrop::Blurred;
            pass =
                pass.constant("IS_BLURRED", f64::from(u8::from(blurred))).elsewhere("background");
        }
        pass = pass.bind("settings", graph.members(p.members(background)));
        graph.pass(pass);
        graph.output(Output::Color, color);
        Ok(())
    }
}

/// The level of the environment whose texels are as large as a pixel, or out of focus.
fn background_level(environment: &Environment, frame: &Frame<Settings>, how: Backdrop) -> f32 {
    let side = environment.facts.side.max(1) as f32;
    let texels_shown = match how {
        Backdrop::Blurred => BLURRED_SIDE,
        Backdrop::None | Backdrop::Sharp => {
            // A pixel's angle, as the side of a map with such texels; none where all look one way.
            let pixel = match frame.view.camera.projection {
                Projection::Perspective { fov_y } => {
                    2.0 * (0.5 * fov_y).tan() / f64::from(frame.view.size_px[1])
                }
                Projection::Orthographic { .. } => 0.0,
            };
            ((4.0 * std::f64::consts::PI).sqrt() / pixel).min(f64::from(side)) as f32
        }
    };
    (side / texels_shown).log2().max(0.0)
}

export_plugin! { id: "org.surfelshop.environment", renderers: [EnvironmentLighting] }
