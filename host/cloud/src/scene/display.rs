//! How the picture of a scene is shown: its tone map, its background, and what is darkened in it.

/// How brightness above white is brought down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneMap {
    /// Cut off.
    #[default]
    Clamp,
    /// Compressed and desaturated (Khronos PBR Neutral).
    Neutral,
}

/// What stands where no surfel is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Backdrop {
    /// Nothing.
    #[default]
    Transparent,
    /// A colour, linear Rec. 709 in [0, 1]; neither exposed nor tone-mapped.
    Color([f32; 3]),
    /// Two colours like that, at the upper and the lower edge of the picture; between them sRGB codes change evenly.
    Gradient {
        /// At the upper edge.
        top: [f32; 3],
        /// At the lower edge.
        bottom: [f32; 3],
    },
}

/// Eye-dome lighting: what lies behind something near it on the screen is darker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeDomeLighting {
    /// Where it is.
    pub when: EyeDomeUse,
    /// Factor on the darkening, 0 to 100; 1 is the usual.
    pub strength: f32,
    /// How far from a pixel those are that darken it, pixels, above 0, at most 32.
    pub radius: f32,
}

/// Where eye-dome lighting is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EyeDomeUse {
    /// In pictures of which normals say little: where many surfels are round splats.
    #[default]
    Automatic,
    /// In no picture.
    Off,
    /// In all.
    On,
}

impl EyeDomeUse {
    /// What it is called in scene files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Automatic => "automatic",
            Self::Off => "off",
            Self::On => "on",
        }
    }

    /// The one of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        [Self::Automatic, Self::Off, Self::On].into_iter().find(|one| one.name() == name)
    }
}

impl Default for EyeDomeLighting {
    fn default() -> Self {
        Self { when: EyeDomeUse::Automatic, strength: 1.0, radius: 1.4 }
    }
}

impl std::fmt::Display for EyeDomeLighting {
    /// For people: `on, strength 1, radius 1.4 pixels`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { when, strength, radius } = self;
        match when {
            EyeDomeUse::Off => f.write_str("off"),
            _ => write!(f, "{}, strength {strength}, radius {radius} pixels", when.name()),
        }
    }
}
