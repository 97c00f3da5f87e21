//! The parameters of a pattern, alike in the renderer and the tool.

use crate::placement::Placement;
use surfelshop_api::glam::DVec3;
use surfelshop_api::prelude::*;

choices! {
    /// The patterns that come with it.
    pub enum Pattern {
        /// The thesis's marble: dark where noise is near its mean.
        SimpleMarble = "simple-marble",
        /// White marble with grey veins and fine ochre ones.
        VeinedMarble = "veined-marble",
        /// A woven tartan.
        Plaid = "plaid",
        /// Rings around an upright axis.
        Wood = "wood",
        /// Grains of three minerals.
        Granite = "granite",
        /// Steel with scratches around an upright axis.
        BrushedMetal = "brushed-metal",
        /// Painted iron that rusts.
        Rust = "rust",
        /// Cubes of two greys.
        Checker = "checker",
    }
}

/// A pattern and how it is laid, as parameters say.
#[derive(Clone, Debug)]
pub(crate) struct PatternSettings {
    pub(crate) pattern: Pattern,
    /// A file of the user's, which counts instead; empty where there is none.
    pub(crate) file: String,
    pub(crate) placement: Placement,
    pub(crate) frequency: f32,
    pub(crate) octaves: u32,
    pub(crate) lacunarity: f32,
    pub(crate) gain: f32,
    pub(crate) warp: f32,
    pub(crate) seed: u32,
}

/// Bits of the cells' numbers that count: all that `noise.wgsl` keeps.
const MASK: u32 = (1 << 28) - 1;

impl PatternSettings {
    /// What moves the hash of the noise.
    pub(crate) fn key(&self) -> [u32; 3] {
        // Odd multiples of the seed, so that seeds differ in all three.
        [0x9e37_79b9, 0x85eb_ca6b, 0xc2b2_ae35].map(|odd: u32| odd.wrapping_mul(self.seed))
    }

    /// The bytes of the shader's `Pattern`.
    pub(crate) fn uniform(&self) -> Uniform {
        let octaves = i32::try_from(self.octaves).unwrap_or(i32::MAX);
        let power: f64 = (0..octaves).map(|k| f64::from(self.gain).powi(2 * k)).sum();
        let to_one_octave = if power > 0.0 { power.sqrt().recip() } else { 0.0 };
        Uniform::new()
            .uvec3(self.key())
            .u32(MASK)
            .f32(self.frequency)
            .u32(self.octaves)
            .f32(self.lacunarity)
            .f32(self.gain)
            .f32(self.warp)
            .f32(to_one_octave as f32)
    }
}

/// Declares a unit's parameters: those of the pattern and then its own.
macro_rules! pattern_params {
    ($(#[$meta:meta])* $name:ident { $($own:tt)* }) => {
        params! {
            $(#[$meta])*
            pub struct $name {
                /// The pattern.
                pattern: Pattern { default: Pattern::SimpleMarble },
                /// A pattern of your own, a file of WGSL; it counts instead of `pattern` until it is
                /// taken away again.
                file: FilePath { default: FilePath::default(), endings: &["wgsl"] },
                /// Size of the pattern: 2 doubles all that is in it.
                scale: f32 { default: 1.0, range: 0.001..=1000.0, logarithmic: true },
                /// Turn of the pattern about the x axis.
                rotation_x: f32 { default: 0.0, range: -180.0..=180.0, unit: "deg" },
                /// Turn of the pattern about the y axis, after that about x.
                rotation_y: f32 { default: 0.0, range: -180.0..=180.0, unit: "deg" },
                /// Turn of the pattern about the z axis, after that about y.
                rotation_z: f32 { default: 0.0, range: -180.0..=180.0, unit: "deg" },
                /// Cells of the coarsest noise along the cloud; the sets of a plaid, the cubes of a
                /// checker, a third of the rings of wood.
                frequency: f32 { default: 4.0, range: 0.0..=1_000_000.0, logarithmic: true },
                /// Noises of rising frequency that are added up.
                octaves: u32 { default: 6, range: 0..=16, quality: true },
                /// Frequency of an octave as a multiple of that before it.
                lacunarity: f32 { default: 2.0, range: 1.0..=4.0 },
                /// Contrast of an octave as a share of that before it.
                gain: f32 { default: 0.5, range: 0.0..=1.0 },
                /// How far noise bends the pattern, in cells of the coarsest noise.
                warp: f32 { default: 0.0, range: 0.0..=4.0 },
                /// Another seed is another stone from the same quarry.
                seed: u32 { default: 0, range: 0..=65_535 },
                /// How much the cloud's own colours count, which the pattern is multiplied by.
                own_color: f32 { default: 1.0, range: 0.0..=1.0 },
                $($own)*
            }
        }

        impl $name {
            fn pattern_settings(&self) -> $crate::settings::PatternSettings {
                $crate::settings::PatternSettings {
                    pattern: self.pattern,
                    file: self.file.0.clone(),
                    placement: $crate::settings::placement(
                        [self.rotation_x, self.rotation_y, self.rotation_z],
                        self.scale,
                    ),
                    frequency: self.frequency,
                    octaves: self.octaves,
                    lacunarity: self.lacunarity,
                    gain: self.gain,
                    warp: self.warp,
                    seed: self.seed,
                }
            }
        }
    };
}
pub(crate) use pattern_params;

/// How a pattern lies after turns in degrees and a scale.
pub(crate) fn placement(degrees: [f32; 3], scale: f32) -> Placement {
    let turn = DVec3::from(degrees.map(|angle| f64::from(angle).to_radians()));
    Placement { turn, scale: f64::from(scale) }
}
