//! Natural (image-based) light: spherical harmonics for diffuse surfaces, a prefiltered map for specular ones.

use crate::diffuse::{Diffuse, HarmonicsOptions};
use crate::reflectance;
use surfelshop_api::graph::{BufferId, Target, TextureId};
use surfelshop_api::prelude::*;

choices! {
    /// How light is reflected at the surface.
    pub enum Model {
        /// Microfacets by Trowbridge and Reitz, with all that they reflect among each other.
        Ggx = "ggx",
        /// Fresnel's term times a blurred environment.
        Thesis = "thesis",
    }
}

/// Largest side of the prefiltered map: a mirror shows a third of a degree.
const LARGEST_SIDE: u32 = 512;
/// Side of its smallest level.
const SMALLEST_SIDE: u32 = 16;

/// Width of the Gaussian, radians, that the thesis's distribution of eccentricity 1 is as wide as:
/// the squared distribution falls to a half at 0.6436 c, mirrored directions lie twice as far, and
/// a Gaussian falls to a half at 1.1774 sigma.
const SIGMA_PER_ECCENTRICITY: f64 = 2.0 * 0.6436 / 1.1774;

/// What of natural light a pass wants, and how well.
#[derive(Clone, Copy, Debug)]
pub struct NaturalLighting {
    /// How light is reflected at the surface.
    pub model: Model,
    /// Whether there are diffuse surfaces.
    pub diffuse: bool,
    /// Whether there are specular ones.
    pub specular: bool,
    /// Order of the spherical harmonics, 1 to 5.
    pub sh_order: i32,
    /// Treat a dominant small light as a light of its own.
    pub sun: bool,
    /// Damp harmonics that ring below black, and cut off what is left of it.
    pub window: bool,
    /// Whether light counts that microfacets reflect more than once.
    pub multiple_scattering: bool,
    /// Widen highlights where one pixel shows several normals.
    pub antialias: bool,
    /// How much of the cloud's ambient occlusion counts, 0 to 1.
    pub ao_strength: f32,
    /// What ambient occlusion darkens.
    pub ao_affects: AoAffects,
}

/// What is kept from frame to frame.
pub struct NaturalLight {
    table: Vec<u8>,
    /// The last harmonics, and what they were made of.
    known: Option<(String, HarmonicsOptions, Diffuse)>,
}

impl Default for NaturalLight {
    fn default() -> Self {
        Self::new()
    }
}

impl NaturalLight {
    /// Computes the table of reflectances: a few milliseconds.
    #[must_use]
    pub fn new() -> Self {
        let table = reflectance::table().into_iter().flatten().flat_map(f32::to_le_bytes).collect();
        Self { table, known: None }
    }

    /// Gives a pass the module `shading::natural` with all that it needs in this frame; passes that
    /// prefilter the environment come before it.
    ///
    /// Without an environment in the scene only `by_lights` of the module may be called; `matte` and
    /// the functions of the model only where they were asked for.
    pub fn light<P>(
        &mut self,
        frame: &Frame<P>,
        how: &NaturalLighting,
        graph: &mut Graph,
        pass: Pass,
    ) -> Pass {
        let lit = frame.environment.as_ref();
        let lights = lights_that_shine(&frame.scene.lights, lit.is_some());
        let mut pass = pass
            .module("shading::natural", "natural.wgsl", include_str!("natural.wgsl"))
            .feature("shading::natural::HAS_LIGHTS", lights != 0)
            .occluded(how.ao_strength, &frame.cloud)
            .constant("shading::natural::REFLECTS_AGAIN", flag(how.multiple_scattering));
        let mut last_level = 0.0;
        if let Some(environment) = lit {
            if how.diffuse || !how.specular {
                pass = self.with_diffuse(environment, how, graph, pass);
            }
            if how.specular {
                let chain = prefiltered(graph, environment, how.model);
                last_level = (chain.n_levels - 1) as f32;
                pass = pass
                    .bind("shading::natural::prefiltered", chain.texture)
                    .bind("shading::natural::prefiltered_sampler", SamplerKind::Linear);
                if how.model == Model::Ggx {
                    let table: BufferId = graph.upload("reflectance", &self.table);
                    pass = pass.bind("shading::natural::reflectance", table);
                }
            }
        }
        let uniform = Uniform::new().f32(last_level).u32(lights).f32(flag(how.antialias) as f32);
        let uniform = uniform.occlusion(how.ao_strength, how.ao_affects, &frame.cloud);
        pass.bind("shading::natural::lighting", graph.uniform(uniform))
    }

    /// Gives a pass the light on a diffuse surface.
    fn with_diffuse(
        &mut self,
        environment: &Environment,
        how: &NaturalLighting,
        graph: &mut Graph,
        pass: Pass,
    ) -> Pass {
        let order = usize::try_from(how.sh_order).unwrap_or(2);
        let choice = HarmonicsOptions { order, sun: how.sun, window: how.window };
        let key = &environment.facts.key;
        let same =
            |(of, chosen, _): &(String, HarmonicsOptions, Diffuse)| of == key && *chosen == choice;
        let diffuse = match self.known.take().filter(same) {
            Some((_, _, diffuse)) => diffuse,
            None => Diffuse::new(&environment.facts, choice),
        };
        let has_sun = diffuse.sun.is_some();
        let uniform = graph.uniform(diffuse.uniform(environment.gain));
        self.known = Some((key.clone(), choice, diffuse));
        pass.feature("shading::natural::HAS_BAND_4", order >= 4)
            .constant("shading::natural::CUTS_OFF", flag(how.window))
            .feature("shading::natural::HAS_SUN", has_sun)
            .bind("shading::natural::diffuse", uniform)
    }
}

fn flag(value: bool) -> f64 {
    f64::from(u8::from(value))
}

/// A bit for each light that shines. One that follows the camera is there to see by, and is left
/// out where there is natural light.
fn lights_that_shine(lights: &[Light], natural: bool) -> u32 {
    let shines = |light: &Light| !(natural && light.follows_camera());
    let bits = lights.iter().enumerate().filter(|(_, light)| shines(light));
    bits.fold(0, |all, (i, _)| all | 1u32.checked_shl(i as u32).unwrap_or(0))
}

/// The environment, blurred more from level to level.
struct MipChain {
    texture: TextureId,
    n_levels: u32,
}

/// Samples of a level's lobe: wide lobes have few texels and may have many.
fn n_samples(level: u32) -> u32 {
    if level == 0 { 1 } else { (64 << level).min(2048) }
}

/// Describes the passes that blur an environment; they run when it is a new one.
fn prefiltered(graph: &mut Graph, environment: &Environment, model: Model) -> MipChain {
    let side = environment.facts.side.clamp(SMALLEST_SIDE, LARGEST_SIDE);
    let n_levels = (side / SMALLEST_SIDE).ilog2() + 1;
    let name = if model == Model::Ggx { "ggx" } else { "gaussian" };
    let key = format!("{} {name} {side}", environment.facts.key);
    let texture =
        Texture::fixed(Format::Rgba16Float, side, side).mips(n_levels).persistent(key).stored();
    let texture = graph.texture("prefiltered environment", texture);
    for level in 0..n_levels {
        let spread = f64::from(level) / f64::from(n_levels - 1).max(1.0);
        let sigma = SIGMA_PER_ECCENTRICITY * spread;
        let (alpha, kappa) = match model {
            Model::Ggx => (spread * spread, 0.0),
            Model::Thesis => (0.0, if level == 0 { 0.0 } else { 1.0 / (sigma * sigma) }),
        };
        let target = Target { texture, mip: level, layer: 0 };
        let lobe = Uniform::new().f32((side >> level) as f32).f32(alpha as f32).f32(kappa as f32);
        let lobe = graph.uniform(lobe.u32(n_samples(level)));
        graph.pass(
            Pass::fullscreen(
                &format!("prefilter {name} {level}"),
                include_str!("prefilter.wgsl"),
                "prefilter",
            )
            .bind("lobe", lobe)
            .target(target),
        );
    }
    MipChain { texture, n_levels }
}
