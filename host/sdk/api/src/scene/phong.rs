//! The parameters of Phong lighting, which renderers share: one member each of `surfelshop::phong::Settings`.

use crate::params;

params! {
    /// The parameters of Phong lighting. ABI 3.7.
    pub struct Phong {
        /// Factor on the diffuse term.
        diffuse: f32 { default: 1.0, range: 0.0..=1.0 },
        /// Radiance of the highlight's peak under a white light.
        specular: f32 { default: 0.25, range: 0.0..=1.0 },
        /// Exponent of the highlight: large is small and sharp.
        shininess: f32 { default: 64.0, range: 1.0..=1024.0, logarithmic: true },
        /// Light that reaches every surface from everywhere, as a fraction of white; ambient
        /// accessibility darkens it where the cloud has any.
        ambient: f32 { default: 0.08, range: 0.0..=1.0 },
    }
}
