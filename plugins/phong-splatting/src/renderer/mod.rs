//! # `phong-splatting`: light on normals that vary over each splat
//!
//! | parameter     | type   | default   | meaning                                                     |
//! |---------------|--------|-----------|-------------------------------------------------------------|
//! | `mode`        | choice | `phong`   | `phong`, or as others do: `averaged`, `blended`, `flat`      |
//! | `lighting`    | choice | `exact`   | `exact` for each pixel, from a `map`, or `natural` light     |
//! | `map-size`    | int    | 128       | texels along the map of light                                |
//! | `diffuse`     | float  | 1         | factor on the diffuse term                                   |
//! | `specular`    | float  | 0.25      | radiance of the highlight's peak under a white light         |
//! | `shininess`   | float  | 64        | exponent of the highlight, 1 to 1024                         |
//! | `ambient`     | float  | 0.08      | radiance of an unlit white surface                           |
//! | `roughness`, `metallic` | float | 0.4, 0 | of `natural` light                                    |
//! | `ao-strength` | float  | 1         | how much of the cloud's ambient occlusion counts             |
//! | `ao-affects`  | choice | `ambient` | `ambient`, `diffuse`, `reflections` or `all`                 |
//!
//! Method. A splat's column `normal_field` gives every point of it a normal (eq. 2). The host's drawing
//! takes each pixel to the very point of the splat that it shows, in its plane and in perspective,
//! blends the normals there with Gaussian weights and divides; the result is lit once, as by
//! `ewa-phong` or, in natural light, as by `environment`. The other modes show what that is worth:
//! `averaged` blends one normal for each splat and lights the result, `blended` lights each splat once
//! and blends colours (Gouraud shading, about), `flat` does neither: the nearest splat with its one
//! normal. All of them draw the same splats, lines that cut them included; clouds without
//! fields look alike in the first two.
//!
//! `map` is the paper's way to light: what arrives on a white surface, diffuse and specular, is computed
//! for every direction of the normal, seen from where the eye sees the middle of the scene, and looked
//! up. Here it is one octahedral map instead of six faces of a cube.
//!
//! Deviations from the paper: fields stand in one orthonormal frame (errata B1, B2); splats are quads
//! in their planes, which cover what they cover at any angle and are cut by the near plane, where the
//! paper's screen-space squares are too small by up to 2.4 times (B3, B6); normals are blended and lit
//! once instead of lighting every splat's pixel, which leaves highlights their shape and costs one
//! evaluation a pixel (as Botsch et al. 2005 do); splats smaller than a pixel go through the
//! screen-space low-pass of the host, and their fields with it: what a pixel sees of a field is its mean
//! under the filter (B10).
//!
//! Limits: no shadows. A `map` holds for one direction to the eye and for lights as they arrive in the
//! middle of the scene: highlights move where perspective is strong or a light is near, and of
//! exponents the map shows as much as its texels hold. Light of more than 65,504 is cut off in it.
//!
//! Source: Botsch, Spornat & Kobbelt 2004, "Phong Splatting", section 4; Botsch, Hornung, Zwicker &
//! Kobbelt 2005, "High-Quality Surface Splatting on Today's GPUs", for lighting blended normals.
//!
//! ```text
//! surfelshop bake scan.ply -t splats -o splats.ply
//! surfelshop render splats.ply -r phong-splatting -o scan.png
//! ```

use surfelshop_api::prelude::*;
use surfelshop_api::{Occlusion, Phong};
use surfelshop_shading::{Model, NaturalLight, NaturalLighting};

choices! {
    /// What of splats is shown.
    pub enum Mode {
        /// Normals that vary over splats.
        Phong = "phong",
        /// One normal for each splat, blended before lighting.
        Averaged = "averaged",
        /// One colour for each splat, blended after lighting.
        Blended = "blended",
        /// The nearest splat with its one normal.
        Flat = "flat",
    }
}

choices! {
    /// Where light comes from.
    pub enum Lighting {
        /// The scene's lights, computed for each pixel.
        Exact = "exact",
        /// The scene's lights, looked up by the normal.
        Map = "map",
        /// The environment, as `environment` lights.
        Natural = "natural",
    }
}

params! {
    /// Settings of the renderer.
    pub struct Settings {
        /// What of splats is shown: normals that vary over each (phong), or as older techniques do: one
        /// normal for each, blended (averaged); one colour for each, blended (blended); neither
        /// (flat).
        mode: Mode { default: Mode::Phong },
        /// Light computed for each pixel (exact), looked up by the normal (map), or of the environment
        /// (natural).
        lighting: Lighting { default: Lighting::Exact },
        /// Texels along the map of light.
        map_size: u32 { default: 128, range: 4..=1024, quality: true, logarithmic: true },
        /// The material under lights.
        phong: Phong { group: Phong::default() },
        /// Roughness of the surface in natural light: 0 is a mirror.
        roughness: f32 { default: 0.4, range: 0.0..=1.0 },
        /// How much of a metal the surface is, in natural light.
        metallic: f32 { default: 0.0, range: 0.0..=1.0 },
        /// Ambient occlusion.
        occlusion: Occlusion { group: Occlusion::default() },
    }
}

pub(crate) struct PhongSplatting {
    light: Option<NaturalLight>,
}

impl Renderer for PhongSplatting {
    const INFO: UnitInfo = UnitInfo::new(
        "phong-splatting",
        "Phong splatting",
        "Splats whose normals vary over them, blended and lit for each pixel.",
    );
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self { light: None })
    }

    fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
        let p = &frame.params;
        let (wgsl, entry) = match (p.lighting, &frame.environment) {
            (Lighting::Exact, _) => (include_str!("exact.wgsl"), "shade"),
            (Lighting::Map, _) => (include_str!("mapped.wgsl"), "shade"),
            (Lighting::Natural, Some(_)) => (include_str!("natural.wgsl"), "shade_natural"),
            (Lighting::Natural, None) => (include_str!("natural.wgsl"), "shade_lights"),
        };
        let surface = match p.mode {
            Mode::Phong => SurfaceMode::Fields,
            Mode::Averaged | Mode::Blended => SurfaceMode::Blended,
            Mode::Flat => SurfaceMode::Nearest,
        };
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        let mut pass = Pass::shading("phong splats", wgsl, entry)
            .surface(surface)
            .per_surfel(p.mode == Mode::Blended)
            .merges(true)
            .target(color);
        if p.lighting == Lighting::Map {
            let [diffuse, highlight] = light_map(frame, graph);
            pass = pass
                .bind("diffuse_map", diffuse)
                .bind("highlight_map", highlight)
                .bind("map_sampler", SamplerKind::Linear);
        }
        if p.lighting == Lighting::Natural {
            let light = self.light.get_or_insert_with(NaturalLight::new);
            pass = light.light(frame, &p.natural(), graph, pass);
        } else {
            pass = pass
                .occluded(p.occlusion.ao_strength, &frame.cloud)
                .feature("surfelshop::phong::HIGHLIGHTS", p.phong.specular > 0.0);
        }
        let settings = graph.settings("phong_splats", p.members(frame));
        graph.pass(pass.settings(&settings));
        graph.output(Output::Color, color);
        Ok(())
    }
}

impl Settings {
    /// The settings of the shader.
    fn members(&self, frame: &Frame<Self>) -> Members {
        let members = Members::new().f32("diffuse", self.phong.diffuse);
        match self.lighting {
            Lighting::Natural => {
                members.f32("roughness", self.roughness).f32("metallic", self.metallic)
            }
            Lighting::Exact | Lighting::Map => members
                .f32("specular", self.phong.specular)
                .f32("shininess", self.phong.shininess)
                .f32("ambient", self.phong.ambient)
                .occlusion(self.occlusion.ao_strength, self.occlusion.ao_affects, &frame.cloud),
        }
    }

    fn natural(&self) -> NaturalLighting {
        NaturalLighting {
            model: Model::Ggx,
            diffuse: self.phong.diffuse > 0.0,
            specular: true,
            sh_order: 2,
            sun: true,
            window: true,
            multiple_scattering: true,
            antialias: true,
            ao_strength: self.occlusion.ao_strength,
            ao_affects: self.occlusion.ao_affects,
        }
    }
}

/// Describes the pass that fills the maps of light, diffuse and specular; it runs when something of what
/// they show is new.
fn light_map(frame: &Frame<Settings>, graph: &mut Graph) -> [TextureId; 2] {
    let p = &frame.params;
    let camera = &frame.view.camera;
    let middle = 0.5 * (frame.cloud.bounds_min + frame.cloud.bounds_max) - camera.eye;
    let to_eye = match camera.projection {
        Projection::Perspective { .. } => -middle,
        Projection::Orthographic { .. } => camera.eye - camera.target,
    };
    let to_eye = to_eye.normalize_or(surfelshop_api::glam::DVec3::Z).as_vec3();
    let members = Members::new()
        .vec3("middle", middle.as_vec3())
        .f32("shininess", p.phong.shininess)
        .vec3("to_eye", to_eye)
        .f32("side", p.map_size as f32);
    // Lights with a place, and those that follow the camera, arrive otherwise when the view moves.
    let key = format!(
        "{} {} {middle:?} {:?} {:?}",
        p.map_size, p.phong.shininess, frame.view, frame.scene.lights
    );
    let map = |name: &str| {
        Texture::fixed(Format::Rgba16Float, p.map_size, p.map_size)
            .persistent(format!("{name} {key}"))
    };
    let diffuse = graph.texture("matte light", map("matte"));
    let highlight = graph.texture("shiny light", map("shiny"));
    let settings = graph.members(members);
    graph.pass(
        Pass::fullscreen("map of light", include_str!("map.wgsl"), "fill")
            .bind("settings", settings)
            .feature("surfelshop::phong::HIGHLIGHTS", p.phong.specular > 0.0)
            .target(diffuse)
            .target(highlight),
    );
    [diffuse, highlight]
}
