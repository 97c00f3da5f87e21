//! What is measured in a scene: distances, angles, heights, areas, profiles and volumes between places, and notes.
//!
//! A [`Measure`] is places in world space and what is measured between them. [`Measure::quantities`] are the numbers that
//! follow from the places alone, [`Profile`] and [`Volume`] are of the surfels of clouds besides. A [`Figure`] is how a
//! measure is drawn.
//!
//! Invariants: places are f64, and numbers are computed of differences of them, so that those far from the origin are as
//! exact as those near it (`far_places_are_measured_as_exactly_as_near_ones`).

mod csv;
mod figure;
mod grid;
mod plane;
mod profile;
mod quantities;
pub(super) mod table;
#[cfg(test)]
mod tests;
mod volume;
mod words;

pub use csv::MeasuredRow;
pub use figure::{Figure, Segment};
pub use profile::Profile;
pub use quantities::{Quantity, QuantityKind};
pub use volume::Volume;
pub use words::Units;

use crate::memory::OutOfMemory;
use glam::DVec3;
use std::ops::RangeInclusive;

/// The most places of a measure.
pub const MOST_PLACES: usize = 1000;

/// The most measures of a scene.
pub const MOST_MEASURES: usize = 1000;

/// The most characters of a note, or of a name.
pub const LONGEST_NOTE: usize = 1000;

/// What is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum MeasureKind {
    /// The length of a line through two places or more.
    #[default]
    Distance,
    /// The angle of three places, at the second.
    Angle,
    /// How much higher the second of two places is.
    Height,
    /// The area within three places or more.
    Area,
    /// The surfels near the vertical plane through two places, seen from its side.
    Profile,
    /// What lies between the surfels and the plane through three places or more, within these.
    Volume,
    /// A text at a place.
    Note,
}

impl MeasureKind {
    /// All, in the order of menus.
    pub const ALL: [Self; 7] = [
        Self::Distance,
        Self::Angle,
        Self::Height,
        Self::Area,
        Self::Profile,
        Self::Volume,
        Self::Note,
    ];

    /// The name in files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Distance => "distance",
            Self::Angle => "angle",
            Self::Height => "height",
            Self::Area => "area",
            Self::Profile => "profile",
            Self::Volume => "volume",
            Self::Note => "note",
        }
    }

    /// The kind of a name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// How many places it is of.
    #[must_use]
    pub fn n_places(self) -> RangeInclusive<usize> {
        match self {
            Self::Distance => 2..=MOST_PLACES,
            Self::Angle => 3..=3,
            Self::Height | Self::Profile => 2..=2,
            Self::Area | Self::Volume => 3..=MOST_PLACES,
            Self::Note => 1..=1,
        }
    }

    /// Whether its line ends where it began.
    #[must_use]
    pub fn is_closed(self) -> bool {
        matches!(self, Self::Area | Self::Volume)
    }

    /// Whether its numbers are of surfels, and not of places alone.
    #[must_use]
    pub fn is_of_surfels(self) -> bool {
        matches!(self, Self::Profile | Self::Volume)
    }
}

/// Something that is measured in a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measure {
    /// What is measured.
    pub kind: MeasureKind,
    /// What it is called; where that is empty, by its kind and its number.
    pub name: String,
    /// The text of a note; empty elsewhere.
    pub text: String,
    /// In world space, as many as its kind has.
    pub places: Vec<DVec3>,
    /// How thick the slab of a profile is, scene units; `None` for a hundredth of its length.
    pub thickness: Option<f64>,
    /// Whether it is hidden.
    pub hidden: bool,
}

impl Measure {
    /// A measure of these places.
    #[must_use]
    pub fn new(kind: MeasureKind, places: Vec<DVec3>) -> Self {
        Self { kind, places, ..Self::default() }
    }

    /// What it is called in lists, as the `index`-th measure of a scene, counted from 0.
    #[must_use]
    pub fn title(&self, index: usize) -> String {
        match self.name.trim() {
            "" if !self.text.trim().is_empty() => self.text.trim().to_owned(),
            "" => format!("{} {}", self.kind.name(), index + 1),
            name => name.to_owned(),
        }
    }
}

/// Why something cannot be measured.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MeasureError {
    /// There are too few places, or too many.
    #[error("{kind}: expected {least} to {most} places, found {found}", kind = kind.name())]
    Places {
        /// What is measured.
        kind: MeasureKind,
        /// Least places.
        least: usize,
        /// Most places.
        most: usize,
        /// How many there are.
        found: usize,
    },
    /// A profile's places lie above each other, or at one place.
    #[error("profile: expected two places that are not above each other")]
    Vertical,
    /// Places enclose nothing.
    #[error("volume: expected places that enclose an area, found all of them on a line")]
    Flat,
    /// No surfel lies there.
    #[error("{kind}: no surfel lies there", kind = kind.name())]
    Nothing {
        /// What is measured.
        kind: MeasureKind,
    },
    /// There is no memory for it.
    #[error(transparent)]
    Memory(#[from] OutOfMemory),
}

impl Measure {
    /// Checks the number of places.
    fn check(&self) -> Result<(), MeasureError> {
        let (kind, found) = (self.kind, self.places.len());
        let (least, most) = kind.n_places().into_inner();
        match kind.n_places().contains(&found) {
            true => Ok(()),
            false => Err(MeasureError::Places { kind, least, most, found }),
        }
    }
}
