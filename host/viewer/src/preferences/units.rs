//! What a unit of files is that do not say it.

use serde::{Deserialize, Serialize};

/// A unit of length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Unit {
    /// Nobody knows.
    #[default]
    Unknown,
    Millimetres,
    Centimetres,
    Metres,
    Feet,
}

impl Unit {
    /// All, in the order of the list.
    pub(crate) const ALL: [Self; 5] =
        [Self::Unknown, Self::Millimetres, Self::Centimetres, Self::Metres, Self::Feet];

    /// The name in the list.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Millimetres => "millimetres",
            Self::Centimetres => "centimetres",
            Self::Metres => "metres",
            Self::Feet => "feet",
        }
    }

    /// Its length; `None` where it is unknown.
    pub(crate) fn metres(self) -> Option<f64> {
        match self {
            Self::Unknown => None,
            Self::Millimetres => Some(1e-3),
            Self::Centimetres => Some(1e-2),
            Self::Metres => Some(1.0),
            // The international foot.
            Self::Feet => Some(0.3048),
        }
    }
}
