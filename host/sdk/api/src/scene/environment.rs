use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// A small bright light in an environment, such as the sun: what spherical harmonics show badly.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sun {
    /// Unit vector towards its centre, probe space.
    pub towards: DVec3,
    /// Irradiance on a surface that faces it divided by pi, linear Rec. 709, beyond what its
    /// surroundings give; as [`Light::Directional`](crate::Light) counts radiance.
    pub radiance: [f64; 3],
    /// Half of its apparent diameter, radians.
    pub angular_radius: f64,
}

/// What is known of the light that arrives from each direction, before it is turned or scaled.
///
/// Probe space is right-handed with y up and -z in front, as a photographer sees it: the centre of
/// an unturned picture is -z, its right side +x. Coefficients are ordered and signed as in
/// `surfelshop_geometry::harmonics`, 36 of them up to order 5.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EnvironmentFacts {
    /// Equal keys mean equal light: what is derived from it can be kept under this.
    pub key: String,
    /// Texels along one side of the octahedral map that shaders read.
    pub side: u32,
    /// Spherical harmonics of the whole, linear Rec. 709.
    pub harmonics: Vec<[f64; 3]>,
    /// Its dominant small light, where it has one.
    pub sun: Option<Sun>,
    /// Spherical harmonics of what is left without the sun; as `harmonics` where there is none.
    pub harmonics_without_sun: Vec<[f64; 3]>,
    /// Mean radiance over all directions, linear Rec. 709.
    pub mean_radiance: [f64; 3],
    /// Largest radiance of any channel.
    pub max_radiance: f64,
}

/// The light around a scene, as renderers are told of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Environment {
    /// What is known of it.
    pub facts: EnvironmentFacts,
    /// Rotation from the world to probe space.
    pub probe_from_world: DMat3,
    /// Factor on its radiance, not below 0.
    pub gain: f64,
}

/// An environment with its pixels, as the host's engine takes it.
#[derive(Clone, Copy, Debug)]
pub struct EnvironmentView<'a> {
    /// What renderers are told.
    pub environment: &'a Environment,
    /// Radiance, linear Rec. 709, finite and not negative, row by row: an octahedral map of
    /// `facts.side` squared texels whose outermost centres lie on its border, so that it can be
    /// interpolated without a seam.
    pub texels: &'a [[f32; 3]],
}
