//! Properties that are columns of numbers as they are: which column, of what, stored how.

use super::property;
use surfelshop_api::columns::Element;

/// How a number of a property is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stored {
    /// A 32-bit float.
    Float,
    /// A byte that stands for 0 to 1.
    Share,
    /// A byte.
    Byte,
    /// 16 bits.
    Short,
    /// 32 bits.
    Word,
}

impl Stored {
    /// Bytes of a number.
    pub(crate) const fn size(self) -> usize {
        match self {
            Self::Share | Self::Byte => 1,
            Self::Short => 2,
            Self::Float | Self::Word => 4,
        }
    }

    /// The type of the column's elements.
    pub(crate) const fn element(self) -> Element {
        match self {
            Self::Float | Self::Share => Element::F32,
            Self::Byte => Element::U8,
            Self::Short => Element::U16,
            Self::Word => Element::U32,
        }
    }

    /// What numbers are rounded to, for people.
    pub(crate) const fn rounding(self) -> &'static str {
        match self {
            Self::Float => "32-bit floats",
            Self::Share => "steps of 1/255 from 0 to 1",
            Self::Byte => "whole numbers from 0 to 255",
            Self::Short => "whole numbers from 0 to 65535",
            Self::Word => "whole numbers from 0 to 4294967295",
        }
    }
}

/// A property that is a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Plain {
    /// The property's number.
    pub(crate) property: usize,
    /// The column's name.
    pub(crate) column: &'static str,
    /// Numbers of a surfel.
    pub(crate) components: usize,
    /// How each is stored.
    pub(crate) stored: Stored,
    /// What it is, for people.
    pub(crate) description: &'static str,
}

const fn plain(
    property: usize,
    column: &'static str,
    components: usize,
    stored: Stored,
    description: &'static str,
) -> Plain {
    Plain { property, column, components, stored, description }
}

/// All of them, in the order of their numbers.
pub(crate) const PLAIN: [Plain; 14] = [
    plain(property::WEIGHT, "weight", 1, Stored::Float, "weight of the surfel"),
    plain(property::DENSITY, "sampling_density", 3, Stored::Float, "density of samples"),
    plain(property::TEXTURE, "texture", 2, Stored::Float, "texture coordinates"),
    plain(
        property::AMBIENT_COEFFICIENT,
        "ambient_coefficient",
        1,
        Stored::Share,
        "share of ambient light",
    ),
    plain(
        property::DIFFUSE_COEFFICIENT,
        "diffuse_coefficient",
        1,
        Stored::Share,
        "share of diffuse light",
    ),
    plain(
        property::SPECULAR_COEFFICIENT,
        "specular_coefficient",
        1,
        Stored::Share,
        "share of specular light",
    ),
    plain(property::SHININESS, "shininess", 1, Stored::Byte, "exponent of highlights"),
    plain(
        property::FLAGS,
        "flags",
        1,
        Stored::Word,
        "bits: 1, 2, 4 selected, 8 emphasised, 16 covered, 32 inside, 64 feature, 128, 256, 512 clipped, 1024 invisible",
    ),
    plain(property::ISOVALUE, "isovalue", 1, Stored::Float, "value of the isosurface"),
    plain(property::ORIGIN_CELL, "origin_cell", 1, Stored::Word, "cell that the surfel is from"),
    plain(property::CAMERA_DEPTH, "camera_depth", 1, Stored::Float, "depth seen from its camera"),
    plain(property::CAMERA_ID, "camera_id", 1, Stored::Byte, "number of its camera"),
    plain(property::CAMERA_XY, "camera_xy", 2, Stored::Short, "pixel of its camera"),
    plain(
        property::CAMERA_ANGLES,
        "camera_angles",
        2,
        Stored::Float,
        "theta and phi of its camera",
    ),
];
