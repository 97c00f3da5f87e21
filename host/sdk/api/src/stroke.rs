//! Tools that are handled: what a hand does over a cloud, as data.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// How a tool is handled. ABI 3.11.
///
/// A tool that is handled is not run over a whole cloud. The host draws a cursor, follows the pointer, finds the surfels
/// that are concerned and how much, and runs the tool with a cloud of these alone: the column
/// [`WEIGHT`](crate::columns::WEIGHT) says how much, and [`Job::stroke`](crate::Job::stroke) what the hand did. What the
/// tool stages is of these surfels; the host puts it into the whole cloud, shows it, and undoes it as one step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Handling {
    /// It is not: it runs over whole clouds.
    #[default]
    Cloud,
    /// By a click: what lies around the place is concerned.
    Click(Dabs),
    /// By a stroke: what lies along it is concerned.
    Stroke(Dabs),
}

impl Handling {
    /// A stroke with the usual dabs.
    pub const STROKE: Self = Self::Stroke(Dabs::USUAL);
    /// A click with the usual dab.
    pub const CLICK: Self = Self::Click(Dabs::USUAL);

    /// The word used in manifests and lists; empty of a tool that is not handled.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Cloud => "",
            Self::Click(_) => "click",
            Self::Stroke(_) => "stroke",
        }
    }

    /// The dabs that a stroke of it has where nobody chooses others.
    #[must_use]
    pub const fn dabs(self) -> Dabs {
        match self {
            Self::Cloud => Dabs::USUAL,
            Self::Click(dabs) | Self::Stroke(dabs) => dabs,
        }
    }
}

/// What a stroke is made of: spheres along it. ABI 3.11.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Dabs {
    /// How far dabs are apart, in radii, above 0.
    pub spacing: f32,
    /// How much surfels are concerned by their distance from the middle of a dab.
    pub falloff: Falloff,
    /// Which surfels of a dab are concerned.
    pub reach: Reach,
}

impl Dabs {
    /// A quarter of a radius apart, with a smooth edge, on the side that is seen.
    pub const USUAL: Self = Self { spacing: 0.25, falloff: Falloff::Smooth, reach: Reach::Facing };
}

impl Default for Dabs {
    fn default() -> Self {
        Self::USUAL
    }
}

/// How a dab gets weaker towards its edge. ABI 3.11.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Falloff {
    /// It does not.
    Constant,
    /// As a line, from 1 to 0.
    Linear,
    /// As (1 - s²)² of the share s of the radius.
    #[default]
    Smooth,
}

impl Falloff {
    /// All.
    pub const ALL: [Self; 3] = [Self::Constant, Self::Linear, Self::Smooth];

    /// How much a surfel is concerned at a share of the radius: 1 in the middle, 0 beyond the radius.
    #[must_use]
    pub fn weight(self, share: f64) -> f64 {
        if share > 1.0 || share.is_nan() {
            return 0.0;
        }
        match self {
            Self::Constant => 1.0,
            Self::Linear => 1.0 - share,
            Self::Smooth => (1.0 - share * share) * (1.0 - share * share),
        }
    }

    /// The name in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Linear => "linear",
            Self::Smooth => "smooth",
        }
    }
}

/// Which surfels of a dab are concerned. ABI 3.11.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Reach {
    /// Those whose normals point to the same side as the surface under the pointer.
    #[default]
    Facing,
    /// All.
    Volume,
}

/// A stroke of a hand over a cloud. ABI 3.11.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stroke {
    /// Radius of a dab, scene units, above 0.
    pub radius: f64,
    /// What it is made of.
    #[serde(flatten)]
    pub dabs: Dabs,
    /// Where the hand was, in order of time.
    pub samples: Vec<StrokeSample>,
}

/// Where the hand was at a time. ABI 3.11.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StrokeSample {
    /// The place on the surface, world space.
    pub place: DVec3,
    /// The normal of the surface there, unit length, turned to the eye; 0 where it has none.
    #[serde(default)]
    pub normal: Vec3,
    /// Seconds since the stroke began.
    #[serde(default)]
    pub time: f64,
    /// How firmly, in [0, 1]; 1 of a device that does not tell.
    #[serde(default = "full")]
    pub pressure: f32,
}

fn full() -> f32 {
    1.0
}

/// What a tool that is handled is run with: msgpack in the place of the [values](crate::params::Values) alone. ABI 3.11.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct StrokeCall {
    /// Its parameters.
    pub values: crate::params::Values,
    /// What the hand did.
    pub stroke: Stroke,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_fall_from_one_to_zero_and_stay_there() {
        for falloff in Falloff::ALL {
            let at = |share| falloff.weight(share);
            assert!((at(0.0) - 1.0).abs() < f64::EPSILON, "{falloff:?}");
            assert!(at(0.3) >= at(0.6) && at(0.6) >= at(1.0) && at(1.0) >= 0.0);
            assert_eq!([at(1.0001), at(f64::NAN), at(f64::INFINITY)], [0.0; 3]);
        }
    }

    #[test]
    fn strokes_cross_the_boundary_and_files_as_they_are() {
        let sample = StrokeSample {
            place: DVec3::new(1e6 + 0.1, -2.0, 3e-6),
            normal: Vec3::Y,
            time: 0.25,
            pressure: 0.5,
        };
        let stroke = Stroke { radius: 0.1, dabs: Dabs::USUAL, samples: vec![sample; 3] };
        let call = StrokeCall { stroke: stroke.clone(), ..StrokeCall::default() };
        let bytes = rmp_serde::to_vec_named(&call).unwrap();
        assert_eq!(rmp_serde::from_slice::<StrokeCall>(&bytes).unwrap(), call);
        // What is added later is passed over, and what is missing has its usual value.
        let bytes =
            rmp_serde::to_vec_named(&std::collections::BTreeMap::from([("later", 1)])).unwrap();
        assert_eq!(
            rmp_serde::from_slice::<StrokeCall>(&bytes).unwrap_or_default(),
            StrokeCall::default()
        );
    }
}
