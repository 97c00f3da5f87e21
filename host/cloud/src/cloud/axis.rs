//! Directions along the axes of the world.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A direction along an axis of the world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub enum Axis {
    /// Towards +x.
    PlusX,
    /// Towards -x.
    MinusX,
    /// Towards +y: what points upwards where nobody says it.
    #[default]
    PlusY,
    /// Towards -y.
    MinusY,
    /// Towards +z.
    PlusZ,
    /// Towards -z.
    MinusZ,
}

impl Axis {
    /// All six.
    pub const ALL: [Self; 6] =
        [Self::PlusX, Self::MinusX, Self::PlusY, Self::MinusY, Self::PlusZ, Self::MinusZ];

    /// The name in files and on the command line: `x`, `-x` and so on.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::PlusX => "x",
            Self::MinusX => "-x",
            Self::PlusY => "y",
            Self::MinusY => "-y",
            Self::PlusZ => "z",
            Self::MinusZ => "-z",
        }
    }

    /// The axis of a name, with or without `+`.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        let name = name.strip_prefix('+').unwrap_or(name);
        Self::ALL.into_iter().find(|axis| axis.name() == name)
    }

    /// Whether two axes are at a right angle.
    #[must_use]
    pub fn is_across(self, other: Self) -> bool {
        self.direction().cross(other.direction()) != DVec3::ZERO
    }

    /// The unit vector.
    #[must_use]
    pub fn direction(self) -> DVec3 {
        match self {
            Self::PlusX => DVec3::X,
            Self::MinusX => DVec3::NEG_X,
            Self::PlusY => DVec3::Y,
            Self::MinusY => DVec3::NEG_Y,
            Self::PlusZ => DVec3::Z,
            Self::MinusZ => DVec3::NEG_Z,
        }
    }

    /// The index of its coordinate, 0 to 2.
    #[must_use]
    pub fn index(self) -> usize {
        match self {
            Self::PlusX | Self::MinusX => 0,
            Self::PlusY | Self::MinusY => 1,
            Self::PlusZ | Self::MinusZ => 2,
        }
    }

    /// 1, or -1 where it points towards smaller coordinates.
    #[must_use]
    pub fn sign(self) -> f64 {
        match self {
            Self::PlusX | Self::PlusY | Self::PlusZ => 1.0,
            Self::MinusX | Self::MinusY | Self::MinusZ => -1.0,
        }
    }

    /// The axis that a direction is nearest to; +y where it has no length, and where it is NaN.
    #[must_use]
    pub fn nearest(direction: DVec3) -> Self {
        let along = |axis: &Self| axis.direction().dot(direction);
        let nearest = Self::ALL.into_iter().max_by(|a, b| along(a).total_cmp(&along(b)));
        nearest.filter(|axis| along(axis) > 0.0).unwrap_or_default()
    }

    /// A direction of a world whose y axis points upwards, in one where this axis does: a rotation, about x as far as
    /// it can be, so that what is right stays right.
    #[must_use]
    pub fn from_y_up(self, direction: DVec3) -> DVec3 {
        let [x, y, z] = direction.to_array();
        let turned = match self {
            Self::PlusX => [y, -x, z],
            Self::MinusX => [-y, x, z],
            Self::PlusY => [x, y, z],
            Self::MinusY => [x, -y, -z],
            Self::PlusZ => [x, -z, y],
            Self::MinusZ => [x, z, -y],
        };
        DVec3::from_array(turned)
    }

    /// The inverse of [`from_y_up`](Self::from_y_up).
    #[must_use]
    pub fn to_y_up(self, direction: DVec3) -> DVec3 {
        let [x, y, z] = direction.to_array();
        let turned = match self {
            Self::PlusX => [-y, x, z],
            Self::MinusX => [y, -x, z],
            Self::PlusY => [x, y, z],
            Self::MinusY => [x, -y, -z],
            Self::PlusZ => [x, z, -y],
            Self::MinusZ => [x, -z, y],
        };
        DVec3::from_array(turned)
    }
}

impl From<Axis> for String {
    fn from(axis: Axis) -> Self {
        axis.name().to_owned()
    }
}

impl TryFrom<String> for Axis {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        Self::from_name(&name)
            .ok_or_else(|| format!("expected x, y, z, -x, -y or -z, found `{name}`"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_rotations_that_bring_y_upwards_and_back() {
        for axis in Axis::ALL {
            let [x, y, z] = DVec3::AXES.map(|direction| axis.from_y_up(direction));
            assert_eq!(y, axis.direction());
            assert_eq!(x.cross(y), z, "{}: no mirror image", axis.name());
            let direction = DVec3::new(0.3, -0.5, 0.8);
            assert_eq!(axis.to_y_up(axis.from_y_up(direction)), direction);
            assert_eq!(axis.direction()[axis.index()], axis.sign());
            assert_eq!(Axis::nearest(axis.direction() * 0.2 + direction * 0.1), axis);
            assert_eq!(Axis::from_name(axis.name()), Some(axis));
        }
        assert_eq!([DVec3::ZERO, DVec3::NAN].map(Axis::nearest), [Axis::PlusY; 2]);
    }
}
