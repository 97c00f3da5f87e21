//! Light probes: pictures of the light that arrives at a point from all directions.
//!
//! [`read()`] loads one from a Radiance or `OpenEXR` file in any [`Mapping`], replaces what is no
//! radiance, and says in [`EnvironmentFacts`] what renderers want to know of it: its spherical
//! harmonics, its sun, its mean. Those are taken from the texels of the file with their exact solid
//! angles; the octahedral map that shaders read serves for looking things up, not for integrals.
//!
//! Radiance is linear Rec. 709 throughout, in whatever unit the file has.

mod built_in;
mod error;
mod facts;
mod limits;
mod mapping;
mod octahedral;
mod picture;
mod read;
mod solid_angle;
mod stored;
mod sun;
#[cfg(test)]
mod tests;
mod texels;

pub use error::{ProbeError, ProbeFault};
pub use facts::VERSION;
pub use limits::{LARGEST_AREA, LARGEST_SIDE};
pub use mapping::Mapping;
pub use picture::{Picture, Repairs, write_hdr};
pub use read::read;
pub use solid_angle::solid_angles;

use surfelshop_api::EnvironmentFacts;
use texels::TexelMap;

/// The light around a point, and how it came to be.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// The file's name or that of a built-in.
    pub name: String,
    /// How `picture` shows the directions.
    pub mapping: Mapping,
    /// Whether the mapping was detected by the picture's shape and corners.
    pub mapping_was_detected: bool,
    /// The picture after repairs; without texels where the probe comes from stored bytes.
    pub picture: Picture,
    /// What was repaired.
    pub repairs: Repairs,
    /// The facts that renderers get, before the probe is turned or scaled.
    pub facts: EnvironmentFacts,
    /// The octahedral map that shaders read, `facts.side` squared texels row by row.
    ///
    /// Texel (i, j) is centred on the octahedral coordinates `2 (i, j) / (side - 1) - 1` of
    /// `shaders/surface/packing.wgsl` in probe space, so that the outermost centres lie on the border.
    /// Those that show one direction are equal bit by bit.
    pub texels: Vec<[f32; 3]>,
}

impl Probe {
    /// Makes a probe of a picture; where no mapping is given, its shape and corners tell it.
    ///
    /// Twice as wide as high is latitude and longitude, 3 to 4 and 4 to 3 are crosses, and a square
    /// is an angular map where it is black beyond the disc and octahedral otherwise. A mirrored
    /// ball looks like an angular map and has to be named.
    ///
    /// Texels that are not finite become the mean of their finite neighbours or 0, negative ones
    /// become 0; both are counted.
    ///
    /// # Errors
    /// Where the picture has no texels, more than [`LARGEST_SIDE`] along a side, another number of
    /// them than it says, or a shape that fits no mapping or not the one given.
    pub fn from_picture(
        name: impl Into<String>,
        picture: Picture,
        mapping: Option<Mapping>,
    ) -> Result<Self, ProbeFault> {
        picture.check()?;
        let detected = mapping.is_none();
        let mapping = match mapping {
            Some(mapping) => picture.fits(mapping)?,
            None => picture.detect()?,
        };
        Ok(Self::of(name.into(), picture, mapping, detected))
    }

    /// A probe of a picture whose size and shape are right.
    fn of(name: String, mut picture: Picture, mapping: Mapping, detected: bool) -> Self {
        let source = TexelMap::new(mapping, picture.width, picture.height);
        let repairs = picture.repair(&source);
        let (facts, texels) = facts::of(&source, &picture);
        Self { name, mapping, mapping_was_detected: detected, picture, repairs, facts, texels }
    }
}
