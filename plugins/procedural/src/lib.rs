//! # `procedural`: marble, cloth and wood on points
//!
//! A solid pattern, computed for every pixel at its place in the cloud's own box, and lit. Chapter 5
//! of the thesis, with patterns that stay what they are at any distance.
//!
//! | parameter    | type   | default | meaning                                                     |
//! |--------------|--------|---------|-------------------------------------------------------------|
//! | `pattern`    | choice | `simple-marble` | `simple-marble`, `veined-marble`, `plaid`, `wood`, `granite`, `brushed-metal`, `rust`, `checker` |
//! | `file`       | file   |         | a pattern of your own instead                               |
//! | `scale`      | float  | 1       | size of the pattern                                         |
//! | `rotation-x`, `-y`, `-z` | float | 0 | turn of the pattern, degrees                            |
//! | `frequency`  | float  | 4       | cells of the coarsest noise along the cloud                 |
//! | `octaves`    | int    | 6       | noises of rising frequency that are added up                |
//! | `lacunarity` | float  | 2       | frequency from octave to octave                             |
//! | `gain`       | float  | 0.5     | contrast from octave to octave                              |
//! | `warp`       | float  | 0       | how far noise bends the pattern, cells                      |
//! | `seed`       | int    | 0       | another stone from the same quarry                          |
//! | `own-color`  | float  | 1       | how much the cloud's own colours count                      |
//! | `lighting`   | choice | `thesis` | `thesis`, `phong` as `ewa-phong`, `natural` as `environment`, or `none` |
//! | `noise`      | choice | `computed` | `computed` in the shader, or looked up in a `volume`     |
//! | `volume-size` | int   | 128     | texels along the volume                                     |
//! | `filter`     | bool   | true    | show what the pattern is over the pixel, not at its centre  |
//! | `specular`   | float  | 1       | factor on highlights                                        |
//! | `ambient`    | float  | 0.08    | of `phong`: radiance of an unlit white surface              |
//! | `ao-strength` | float | 1       | how much of the cloud's ambient occlusion counts            |
//! | `ao-affects` | choice | `diffuse` | `ambient`, `diffuse`, `reflections` or `all`              |
//!
//! Method. A place is measured in the box of its cloud, 0 to 1 along the largest extent, from an
//! anchor at the eye that is known in f64. Noise is Perlin's with hashed gradients; octaves fade by
//! what a pixel leaves of them, and the deviation they had in there goes with them into the
//! pattern, which computes its mean over it: marble that is too far away to show its veins is as
//! bright as with them. `volume` looks the same noise up in a texture of 16 cells a side, with mip
//! levels, filled once.
//!
//! Deviations from the paper: the marble's three channels are one of mean one half (erratum T25);
//! coordinates are divided by the largest extent instead of axis by axis, which stretched them
//! (T26); the light vector points to the light (T27). Veined marble and plaid are shown there and
//! never given.
//!
//! Limits: filtering takes what varies in a pixel as normally distributed and the two axes of its
//! outline as independent. `wood` measures its radius in f32: closer than a millionth of the cloud
//! its rings show steps. Of several clouds the box of the nearest surfel's counts.
//!
//! The tool `procedural` of the same package bakes a pattern into the column `color`.
//!
//! Source: Liu 2006, "High Quality Rendering for Point Sampled Geometry", chapter 5; Perlin 2002,
//! "Improving Noise"; Jarzynski & Olano 2020, "Hash Functions for GPU Rendering".
//!
//! ```text
//! surfelshop render model.ply -r procedural --set pattern=veined-marble -o marble.png
//! surfelshop bake model.ply -t procedural --set pattern=wood -o wooden.ply
//! ```

mod bake;
mod patterns;
mod placement;
mod settings;
mod volume;

use settings::{Pattern, PatternSettings, pattern_params};
use surfelshop_api::columns::NEUTRAL_ALBEDO;
use surfelshop_api::graph::Members;
use surfelshop_api::prelude::*;
use surfelshop_shading::{Model, NaturalLight, NaturalLighting};

choices! {
    /// How the pattern is lit.
    pub enum Lighting {
        /// As in the thesis: light that reaches round to the far side, and mirrored highlights.
        Thesis = "thesis",
        /// As `ewa-phong` lights.
        Phong = "phong",
        /// As `environment` lights; by the scene's lights where there is no environment.
        Natural = "natural",
        /// Not at all: the pattern itself.
        None = "none",
    }
}

choices! {
    /// Where noise comes from.
    pub enum Noise {
        /// It is computed for each pixel.
        Computed = "computed",
        /// It is looked up in a volume.
        Volume = "volume",
    }
}

pattern_params! {
    /// Settings of the renderer.
    Settings {
        /// How the pattern is lit: as in the thesis, as by `ewa-phong`, as by `environment`, or not
        /// at all.
        lighting: Lighting { default: Lighting::Thesis },
        /// Whether noise is computed for each pixel or looked up in a volume.
        noise: Noise { default: Noise::Computed },
        /// Texels along the volume, a power of two.
        volume_size: u32 { default: 128, range: 16..=256, quality: true },
        /// Show what the pattern is over each pixel, not at its centre, so that it does not flicker.
        filter: bool { default: true },
        /// Factor on highlights.
        specular: f32 { default: 1.0, range: 0.0..=1.0 },
        /// Light that reaches every surface from everywhere under phong lighting, as a fraction of
        /// white.
        ambient: f32 { default: 0.08, range: 0.0..=1.0 },
        /// How much of the cloud's ambient occlusion counts, where it has any: 0 is none.
        ao_strength: f32 { default: 1.0, range: 0.0..=1.0 },
        /// What ambient occlusion darkens: light from everywhere around on matte surfaces, all
        /// light on them (diffuse), reflections of the surroundings too, or all, highlights
        /// included.
        ao_affects: AoAffects { default: AoAffects::Diffuse },
    }
}

struct Procedural {
    light: Option<NaturalLight>,
}

impl Renderer for Procedural {
    const INFO: UnitInfo = UnitInfo::new(
        "procedural",
        "Procedural textures",
        "Marble, cloth, wood and patterns of your own, computed at every pixel.",
    );
    type Params = Settings;
    const LIMITS: &'static [LimitInfo] = &[
        LimitInfo::new(
            "turned",
            "patterns stand in the box along the axes around each cloud, and not in the cloud itself",
        )
        .at_most(1.0),
        LimitInfo::new(
            "neutral-columns",
            "clouds without colours are white below patterns, not grey as in other renderers",
        )
        .at_most(0.75),
    ];

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self { light: None })
    }

    fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
        let p = &frame.params;
        let chosen = p.pattern_settings();
        let pattern = patterns::text(&chosen)?;
        let (wgsl, entry) = match (p.lighting, &frame.environment) {
            (Lighting::Thesis, _) => (include_str!("lit.wgsl"), "shade_thesis"),
            (Lighting::Phong, _) => (include_str!("lit.wgsl"), "shade_phong"),
            (Lighting::None, _) => (include_str!("lit.wgsl"), "shade_look"),
            (Lighting::Natural, Some(_)) => (include_str!("natural.wgsl"), "shade_natural"),
            (Lighting::Natural, None) => (include_str!("natural.wgsl"), "shade_lights"),
        };
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        let pass =
            Pass::shading("procedural", wgsl, entry).surface(SurfaceMode::Blended).merges(true);
        let volume = (p.noise == Noise::Volume).then_some(p.volume_size);
        let mut pass = with_pattern(graph, pass, &chosen, volume, &pattern)
            .module("procedural::shown", "shown.wgsl", include_str!("shown.wgsl"))
            .bind("procedural::shown::shown", graph.members(p.members(frame)))
            .bind("procedural::shown::objects", objects(frame, &chosen, graph))
            .feature("procedural::shown::OWN_COLOR", p.own_color > 0.0)
            .target(color);
        if p.lighting == Lighting::Natural {
            let light = self.light.get_or_insert_with(NaturalLight::new);
            pass = light.light(frame, &p.natural(), graph, pass);
        } else {
            pass = pass
                .occluded(p.ao_strength, &frame.cloud)
                .feature("surfelshop::phong::HIGHLIGHTS", p.specular > 0.0);
        }
        graph.pass(pass);
        graph.output(Output::Color, color);
        Ok(())
    }
}

impl Settings {
    /// The members of the shader's `Settings`.
    fn members(&self, frame: &Frame<Self>) -> Members {
        Members::new()
            .f32("own_color", self.own_color)
            .f32("filtered", f32::from(u8::from(self.filter)))
            .f32("specular", self.specular)
            .f32("ambient", self.ambient)
            .occlusion(self.ao_strength, self.ao_affects, &frame.cloud)
    }

    fn natural(&self) -> NaturalLighting {
        NaturalLighting {
            model: Model::Ggx,
            diffuse: true,
            specular: true,
            sh_order: 2,
            sun: true,
            window: true,
            multiple_scattering: true,
            antialias: true,
            ao_strength: self.ao_strength,
            ao_affects: self.ao_affects,
        }
    }
}

/// Gives a pass a pattern as `procedural::chosen`, with the noise it is made of, which comes from a
/// volume of so many texels where there is one.
fn with_pattern(
    graph: &mut Graph,
    pass: Pass,
    chosen: &PatternSettings,
    volume: Option<u32>,
    pattern: &patterns::Text,
) -> Pass {
    let settings = graph.uniform(chosen.uniform());
    let pass = match volume {
        None => pass.module("procedural::field", "computed.wgsl", include_str!("computed.wgsl")),
        Some(size) => pass
            .module("procedural::field", "volume.wgsl", include_str!("volume.wgsl"))
            .bind("procedural::field::noise_volume", volume::filled(graph, chosen, size))
            .bind("procedural::field::noise_sampler", SamplerKind::LinearRepeat),
    };
    pass.module("procedural::pattern", "pattern.wgsl", include_str!("pattern.wgsl"))
        .module("procedural::chosen", &pattern.file, &pattern.wgsl)
        .bind("procedural::pattern::settings", settings)
}

/// Where each cloud lies in the pattern, as seen from the eye.
fn objects(
    frame: &Frame<Settings>,
    chosen: &PatternSettings,
    graph: &mut Graph,
) -> surfelshop_api::graph::BufferId {
    let eye = frame.view.camera.eye;
    let boxes = &frame.cloud.objects;
    let none = [surfelshop_api::ObjectFrame::default()];
    let boxes = if boxes.is_empty() { &none[..] } else { boxes };
    let bytes = boxes.iter().enumerate().flat_map(|(i, object)| {
        // Clouds without colours are white here and not the grey of other renderers: that grey leaves
        // room for highlights, which patterns have in their own colours.
        let colored = frame.cloud.colored.get(i).copied().unwrap_or(false);
        let whiten = if colored { 1.0 } else { 1.0 / NEUTRAL_ALBEDO[0] };
        chosen.placement.transform(object, eye).bytes(whiten)
    });
    graph.upload("objects", &bytes.collect::<Vec<u8>>())
}

export_plugin! {
    id: "org.surfelshop.procedural",
    renderers: [Procedural],
    tools: [bake::Bake],
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the defaults ask for.
    pub(crate) fn pattern_settings() -> PatternSettings {
        Settings::default().pattern_settings()
    }

    #[test]
    fn octaves_together_have_the_contrast_of_one() {
        let chosen = |octaves, gain| PatternSettings { octaves, gain, ..pattern_settings() };
        let factor = |chosen: &PatternSettings| {
            let bytes = chosen.uniform().into_bytes();
            f32::from_le_bytes([bytes[36], bytes[37], bytes[38], bytes[39]])
        };
        assert_eq!(factor(&chosen(1, 0.5)), 1.0);
        assert_eq!(factor(&chosen(4, 1.0)), 0.5);
        assert_eq!(factor(&chosen(0, 0.5)), 0.0);
        assert_eq!(factor(&chosen(16, 0.0)), 1.0);
    }
}
