//! How surfels look, as a scene says it.

use crate::cloud::Cloud;
use surfelshop_api::columns::PLANARITY;
use surfelshop_geometry::radii::PLANAR;

/// How surfels look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplatSettings {
    /// What they are drawn as.
    pub look: Look,
    /// Surfels whose `planarity` is below this are drawn as round splats that face the eye: in [0, 1], 0 for none.
    pub round_below: f32,
    /// The largest radius that discs are drawn with, scene units, above 0. Ellipses are as large as they are.
    pub largest_radius: Option<f32>,
    /// Whether surfels that are seen from behind have a colour of their own, which shows where normals face.
    pub tint_backs: bool,
}

/// What surfels are drawn as.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Look {
    /// Discs and ellipses in their planes, and round splats where they are no surface.
    #[default]
    Surface,
    /// Round splats of one radius in scene units, which face the eye. They are as large as the low-pass at least, and
    /// just so where the radius is 0.
    Points {
        /// At least 0.
        radius: f32,
    },
}

impl Default for SplatSettings {
    fn default() -> Self {
        let (look, round_below) = (Look::Surface, Self::ROUND_BELOW);
        Self { look, round_below, largest_radius: None, tint_backs: false }
    }
}

impl SplatSettings {
    /// Planarity below which surfels are round splats where nobody says otherwise: where radii are estimated, the
    /// same number tells what is a surface.
    pub const ROUND_BELOW: f32 = PLANAR;

    /// Whether a cloud is displayed as it is.
    pub(super) fn leaves(&self, cloud: &Cloud) -> bool {
        let has_planarity = cloud.column(PLANARITY).is_some() && self.round_below > 0.0;
        self.look == Look::Surface && self.largest_radius.is_none() && !has_planarity
    }
}

impl std::fmt::Display for SplatSettings {
    /// For people: `points of radius 0.02`, `round below a planarity of 0.5`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut parts = Vec::new();
        match self.look {
            Look::Surface => {
                if self.round_below.to_bits() != Self::ROUND_BELOW.to_bits() {
                    parts.push(format!("round splats below a planarity of {}", self.round_below));
                }
                if let Some(largest) = self.largest_radius {
                    parts.push(format!("radii of at most {largest}"));
                }
            }
            Look::Points { radius } if radius > 0.0 => {
                parts.push(format!("points of radius {radius}"));
            }
            Look::Points { .. } => parts.push("points as large as the low-pass".to_owned()),
        }
        if self.tint_backs {
            parts.push("tinted backs".to_owned());
        }
        f.write_str(&parts.join(", "))
    }
}
