//! Selections that need no cloud: what is selected follows from where a surfel is, and from its numbers.

use super::{Combine, Reach, Region, Selection, SelectionError};
use crate::cloud::Cloud;
use crate::cloud::transform::Transform;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A step of such a selection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RegionStep {
    /// A region, together with what was selected before.
    Take {
        /// How both are combined.
        how: Combine,
        /// The region.
        region: Region,
    },
    /// What was not selected before.
    Invert,
}

/// Steps, one after the other from nothing. Unlike bits for each surfel they say of any part of a cloud, and of merged
/// surfels, what is selected of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RegionSelection {
    /// How the cloud stood in the world, which the regions are in.
    #[serde(default)]
    pub placed: Transform,
    /// The steps.
    pub steps: Vec<RegionStep>,
}

impl RegionSelection {
    /// The surfels of a cloud, or of a part of it, as its file has them.
    ///
    /// # Errors
    /// Where the cloud lacks an attribute, or there is no memory.
    pub fn select(&self, cloud: &Cloud) -> Result<Selection, SelectionError> {
        self.select_from(cloud, &self.placed)
    }

    /// The surfels of a cloud that already stands in the world.
    ///
    /// # Errors
    /// As [`select`](Self::select).
    pub fn select_in_world(&self, cloud: &Cloud) -> Result<Selection, SelectionError> {
        self.select_from(cloud, &Transform::default())
    }

    fn select_from(&self, cloud: &Cloud, placed: &Transform) -> Result<Selection, SelectionError> {
        self.steps.iter().try_fold(Selection::none(cloud.len())?, |chosen, step| match step {
            RegionStep::Invert => Ok(chosen.inverted()),
            RegionStep::Take { how, region } => {
                chosen.combined(&region.select_placed(cloud, placed)?, *how)
            }
        })
    }

    /// A ball in the coordinates of the cloud's file as it stands in the world.
    pub(super) fn in_world(&self, middle: DVec3, radius: f64) -> (DVec3, f64) {
        let Transform { translation, rotation, scale } = self.placed;
        let turn = rotation.quaternion().unwrap_or_default();
        (turn * (middle * scale) + translation, radius * scale)
    }

    /// How much of a ball may be selected, which is in the coordinates of the cloud's file.
    #[must_use]
    pub fn reach(&self, middle: DVec3, radius: f64) -> Reach {
        let (middle, radius) = self.in_world(middle, radius);
        self.steps.iter().fold(Reach::Nothing, |before, step| match step {
            RegionStep::Invert => before.inverted(),
            RegionStep::Take { how, region } => {
                let own = region.reach(middle, radius);
                match how {
                    Combine::Replace => own,
                    Combine::Add => before.inverted().with(own.inverted()).inverted(),
                    Combine::Subtract => before.with(own.inverted()),
                    Combine::Intersect => before.with(own),
                }
            }
        })
    }

    /// The same with another step; one that takes the place of all before leaves these out.
    #[must_use]
    pub fn with(&self, step: RegionStep) -> Self {
        let mut steps = self.steps.clone();
        if matches!(step, RegionStep::Take { how: Combine::Replace, .. }) {
            steps.clear();
        }
        steps.push(step);
        Self { steps, ..self.clone() }
    }
}

impl Reach {
    /// Of what is not in there.
    fn inverted(self) -> Self {
        match self {
            Self::Nothing => Self::All,
            Self::Some => Self::Some,
            Self::All => Self::Nothing,
        }
    }

    /// Of what is in both.
    fn with(self, other: Self) -> Self {
        match (self, other) {
            (Self::Nothing, _) | (_, Self::Nothing) => Self::Nothing,
            (Self::All, Self::All) => Self::All,
            _ => Self::Some,
        }
    }
}
