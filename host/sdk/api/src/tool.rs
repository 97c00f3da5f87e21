//! Edits a tool stages, and the tiles a tracer fills.

use crate::columns::{CloudView, Element};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// A rectangle of the picture that a tracer fills.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[repr(C)]
pub struct Tile {
    /// Left edge, pixels.
    pub x: u32,
    /// Upper edge, pixels.
    pub y: u32,
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Which sample of the pixel this call computes, counted from 0.
    pub sample: u32,
}

/// What a tracer sees of the scene besides its frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Traced<'a> {
    /// The clouds in view, in the order of `CloudFacts::objects`.
    pub clouds: &'a [CloudView<'a>],
    /// The light around the scene, radiance before its gain, linear Rec. 709, finite and not
    /// negative: an octahedral map of `facts.side` squared texels, row by row, whose outermost
    /// centres lie on its border. Empty where there is none.
    pub texels: &'a [[f32; 3]],
}

/// A new or replaced column of an edit.
#[derive(Clone, Debug, PartialEq)]
pub struct NewColumn<'a> {
    /// The column's name.
    pub name: &'a str,
    /// Elements per surfel, at least 1.
    pub components: u32,
    /// The values, all components of a surfel together.
    pub values: crate::columns::Values<'a>,
}

/// A staged edit of a cloud, committed whole or dropped.
#[derive(Clone, Debug, PartialEq)]
pub enum Edit<'a> {
    /// Adds or replaces columns; each has as many surfels as the cloud.
    Columns(Vec<NewColumn<'a>>),
    /// Keeps the surfels whose entry is true; one entry per surfel.
    Keep(Cow<'a, [bool]>),
    /// Replaces values of some surfels: in columns that are there, of the type and components that they have.
    /// ABI 3.11.
    Values {
        /// Which surfels: places in the cloud that the tool was given, each at most once.
        surfels: &'a [u32],
        /// Their values, one after the other.
        columns: Vec<NewColumn<'a>>,
    },
    /// Adds surfels behind those that are there. ABI 3.11.
    Add {
        /// For each new surfel one that is there, whose values it has in columns that are not told.
        like: &'a [u32],
        /// The values of the new surfels, in columns that are there.
        columns: Vec<NewColumn<'a>>,
    },
    /// Stands beside the source as a cloud of its own.
    NewCloud {
        /// World position that the new `position` column is relative to.
        origin: glam::DVec3,
        /// All columns of the new cloud.
        columns: Vec<NewColumn<'a>>,
    },
}

/// How an edit's columns are announced to the host; the values follow as raw slices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColumnHeader {
    /// The column's name.
    pub name: String,
    /// Elements per surfel.
    pub components: u32,
    /// Element type.
    pub element: Element,
}

/// The pointer-free part of an edit as it crosses the boundary.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum EditHeader {
    /// See [`Edit::Columns`].
    Columns(Vec<ColumnHeader>),
    /// See [`Edit::Keep`]; one slice of bytes, 0 or 1.
    Keep,
    /// See [`Edit::Values`]; the first slice is the places, u32 each. ABI 3.11.
    Values(Vec<ColumnHeader>),
    /// See [`Edit::Add`]; the first slice is `like`, u32 each. ABI 3.11.
    Add(Vec<ColumnHeader>),
    /// See [`Edit::NewCloud`].
    NewCloud {
        /// Origin of the new cloud, world space.
        origin: glam::DVec3,
        /// The columns.
        columns: Vec<ColumnHeader>,
    },
}
