//! Typed columns of a cloud as plugins see them: shared by reference, never copied.
//!
//! A cloud is a set of named columns of equal length around an origin in f64. Positions are f32
//! offsets from that origin, so millimetres survive at coordinates of a million metres.

use crate::params::srgb_to_linear;
use crate::scene::object::ObjectFrame;
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// Surfel centres: three `f32`, offsets from the cloud's origin in scene units.
pub const POSITION: &str = "position";
/// Unit normals pointing outwards: three `f32`.
pub const NORMAL: &str = "normal";
/// Disc radii: one `f32`, scene units.
pub const RADIUS: &str = "radius";
/// Albedo: three or four `u8` or `u16` (sRGB-encoded) or three or four `f32` (linear Rec. 709).
pub const COLOR: &str = "color";
/// First axis of an elliptical surfel: three `f32`, scene units; its length is the edge.
pub const TANGENT_U: &str = "tangent_u";
/// Second axis of an elliptical surfel: three `f32`, scene units; its length is the edge.
pub const TANGENT_V: &str = "tangent_v";
/// Ambient accessibility, 1 - occlusion: one `f32` in [0, 1].
pub const AO: &str = "ao";
/// Index into the scene's material table: one `u32`.
pub const MATERIAL: &str = "material";
/// How flat the surroundings of a surfel are: one `f32` in [0, 1], from 0 of points without any order to 1 of a
/// plane. Estimated with normals, where some of a cloud is no surface. ABI 3.8.
pub const PLANARITY: &str = "planarity";
/// Which surfels are round splats: one `u8`, 0 for discs. Those of other values face the eye, whatever their
/// normal, which lights them. In perspective they are drawn no larger than [`ROUND_REACH`], unless the first value of
/// the cloud that is not 0 is [`ROUND_UNBOUNDED`]. Not read where there are tangents. ABI 3.8.
pub const ROUND: &str = "round";
/// The first value of [`ROUND`] that is not 0 of a cloud whose round splats are as large as their radius says, however
/// near the eye is. ABI 3.11.
pub const ROUND_UNBOUNDED: u8 = 2;
/// The largest radius that a round splat is drawn with in perspective, in shares of its distance from the eye and times
/// the scene's factor on radii: 8.5 pixels in the middle of a picture of 800 pixels and 35 degrees from bottom to top.
/// What is no surface would otherwise hide the view as a ball when the eye comes near: a point says nothing of what
/// lies between it and its neighbours. ABI 3.11.
pub const ROUND_REACH: f32 = 1.0 / 150.0;

/// The largest radius that a cloud of these values of [`ROUND`] is drawn with in perspective, in shares of the distance
/// from the eye and times the scene's factor on radii: [`ROUND_REACH`], or infinity where they say
/// [`ROUND_UNBOUNDED`]. ABI 3.11.
#[must_use]
pub fn round_reach(round: &[u8]) -> f32 {
    // Many at a time, since the first that is not 0 may be far behind.
    let not_none = |values: &&[u8]| values.iter().fold(0, |all, value| all | value) != 0;
    let some = round.chunks(256).find(not_none).unwrap_or_default();
    match some.iter().find(|&&value| value != 0) {
        Some(&ROUND_UNBOUNDED) => f32::INFINITY,
        _ => ROUND_REACH,
    }
}

/// Which surfels are only around the part of a cloud that a tool is given, for it to look at: one `u8`, 0 for the part
/// itself. What the tool makes of the others is dropped. There where a cloud is worked on part by part, by the tool's
/// [`Scope`](crate::Scope).
pub const CONTEXT: &str = "context";

/// How much a stroke concerns a surfel: one `f32` above 0 and at most 1. There where a tool is
/// [handled](crate::Handling); what it makes of the column is dropped. ABI 3.11.
pub const WEIGHT: &str = "stroke_weight";

/// Linear normal field of an elliptical surfel: four `f32`, x, y, α and β.
///
/// The normal at (u, v), in units of the half axes, has the direction of
/// n + (x + α u) û + (y + β v) v̂, where û and v̂ are the directions of the two tangents and n that of
/// their vector product; all of it is turned round where n points away from the column `normal`. Not
/// read where there are no tangents. Where one of the numbers is not finite all count as 0.
///
/// Source: Botsch et al. 2004, "Phong Splatting", eq. 2 with errata B1 and B2: one orthonormal frame.
/// ABI 3.4.
pub const NORMAL_FIELD: &str = "normal_field";
/// Lines that cut an elliptical surfel: seven `f32`, two lines (a, b, c) and how many of both count.
///
/// A point (u, v), in units of the half axes, is on the side of a line that stays where
/// a u + b v + c >= 0. The last number is 0 where nothing is cut off, 1 where what is on that side of
/// both lines stays (a convex corner), 2 where what is on that side of either stays (a concave one).
/// A line (0, 0, 1) cuts nothing off, one (0, 0, -1) everything. Lines stay where they are when a scene
/// scales radii. Not read where there are no tangents; where one of the numbers is not finite, nothing is
/// cut off. Of the last number, what is above 0.5 counts as 1, and above 1.5 as 2.
///
/// Source: Botsch et al. 2004, "Phong Splatting", section 4, with erratum B9. ABI 3.4.
pub const CLIP: &str = "clip";

/// Opacity of a splat at its centre: one `f32` in [0, 1]. ABI 3.9.
pub const OPACITY: &str = "opacity";
/// Standard deviations of a Gaussian splat along its own axes: three `f32`, or two of a flat one, scene units.
/// ABI 3.9.
pub const SPLAT_SCALE: &str = "splat_scale";
/// Rotation from a Gaussian splat's own axes to the cloud's: a unit quaternion, four `f32` x, y, z, w. Of a flat
/// splat the third axis is its normal. ABI 3.9.
pub const SPLAT_ROTATION: &str = "splat_rotation";
/// What a splat radiates by direction, one column for each order 0 to 3 of the spherical harmonics: three `f32` (red,
/// green, blue) for each coefficient, in the order m = -l to l.
///
/// The colour is 0.5 + Σ c Y(d), at least 0, of the unit direction d from the eye to the splat in the cloud's axes, in
/// the space that it was trained in, which is sRGB-encoded. Y is real, orthonormal and without the Condon-Shortley
/// sign: of order 1 it is 0.488603 (y, z, x). Columns of higher orders may be missing.
///
/// Source: Kerbl et al. 2023, "3D Gaussian Splatting for Real-Time Radiance Field Rendering", section 4; its files have
/// the sign and are converted when they are read. ABI 3.9.
pub const SH: [&str; 4] = ["sh_0", "sh_1", "sh_2", "sh_3"];

/// What the values of a column are, and so what becomes of them where a cloud is scaled, turned or merged. ABI 3.9.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Numbers that stay as they are.
    #[default]
    Plain,
    /// Lengths in scene units.
    Length,
    /// Natural logarithms of lengths in scene units.
    LogLength,
    /// Directions, three components each; any length.
    Direction,
    /// Rotations from own axes to the cloud's, quaternions x, y, z, w.
    Quaternion,
    /// Coefficients of real spherical harmonics of this one order, from m = -l to l, some channels each.
    SphericalHarmonics(u8),
    /// Colours that are radiance, linear Rec. 709.
    Radiance,
}

/// The role of a column that has a meaning by its name; [`Role::Plain`] of others. ABI 3.9.
#[must_use]
pub fn role_of(column: &str) -> Role {
    match column {
        RADIUS | SPLAT_SCALE => Role::Length,
        NORMAL => Role::Direction,
        SPLAT_ROTATION => Role::Quaternion,
        _ => match SH.iter().position(|name| *name == column) {
            Some(order) => Role::SphericalHarmonics(order as u8),
            None => Role::Plain,
        },
    }
}

/// Linear Rec. 709 albedo of clouds without colours: a grey that leaves room for highlights.
pub const NEUTRAL_ALBEDO: [f32; 3] = [0.5; 3];

/// The largest half-precision number, which the surface buffer holds; products of larger albedos would be
/// no numbers.
const MAX_ALBEDO: f32 = 65504.0;

/// The type of a column's elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[repr(u32)]
#[serde(rename_all = "lowercase")]
pub enum Element {
    /// Signed 8-bit integer.
    I8 = 0,
    /// Unsigned 8-bit integer.
    U8 = 1,
    /// Signed 16-bit integer.
    I16 = 2,
    /// Unsigned 16-bit integer.
    U16 = 3,
    /// Signed 32-bit integer.
    I32 = 4,
    /// Unsigned 32-bit integer.
    U32 = 5,
    /// 32-bit float.
    F32 = 6,
    /// 64-bit float.
    F64 = 7,
}

impl Element {
    /// Bytes of one element.
    #[must_use]
    pub const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The element type of a code of the C boundary; `None` where the code is unknown.
    #[must_use]
    pub const fn from_code(code: u32) -> Option<Self> {
        Some(match code {
            0 => Self::I8,
            1 => Self::U8,
            2 => Self::I16,
            3 => Self::U16,
            4 => Self::I32,
            5 => Self::U32,
            6 => Self::F32,
            7 => Self::F64,
            _ => return None,
        })
    }

    /// The name shown to people, such as `f32`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::I8 => "i8",
            Self::U8 => "u8",
            Self::I16 => "i16",
            Self::U16 => "u16",
            Self::I32 => "i32",
            Self::U32 => "u32",
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }
}

/// How values of a column merge when the host stands one surfel in for several.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Merge {
    /// The area-weighted mean.
    Mean,
    /// The mean, made unit length again.
    NormalisedMean,
    /// Values cannot be merged; passes that read the column are drawn in full detail.
    None,
}

/// The merge rule of a well-known column; columns the host does not know are never merged.
#[must_use]
pub fn merge_rule(column: &str) -> Merge {
    match column {
        POSITION | COLOR | AO => Merge::Mean,
        NORMAL => Merge::NormalisedMean,
        _ => Merge::None,
    }
}

/// Borrowed values of a column, all components of a surfel together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Values<'a> {
    /// Signed 8-bit integers.
    I8(&'a [i8]),
    /// Unsigned 8-bit integers.
    U8(&'a [u8]),
    /// Signed 16-bit integers.
    I16(&'a [i16]),
    /// Unsigned 16-bit integers.
    U16(&'a [u16]),
    /// Signed 32-bit integers.
    I32(&'a [i32]),
    /// Unsigned 32-bit integers.
    U32(&'a [u32]),
    /// 32-bit floats.
    F32(&'a [f32]),
    /// 64-bit floats.
    F64(&'a [f64]),
}

macro_rules! for_each_variant {
    ($values:expr, $slice:ident => $body:expr) => {
        match $values {
            Values::I8($slice) => $body,
            Values::U8($slice) => $body,
            Values::I16($slice) => $body,
            Values::U16($slice) => $body,
            Values::I32($slice) => $body,
            Values::U32($slice) => $body,
            Values::F32($slice) => $body,
            Values::F64($slice) => $body,
        }
    };
}

impl Values<'_> {
    /// The element type.
    #[must_use]
    pub const fn element(&self) -> Element {
        match self {
            Self::I8(_) => Element::I8,
            Self::U8(_) => Element::U8,
            Self::I16(_) => Element::I16,
            Self::U16(_) => Element::U16,
            Self::I32(_) => Element::I32,
            Self::U32(_) => Element::U32,
            Self::F32(_) => Element::F32,
            Self::F64(_) => Element::F64,
        }
    }

    /// Number of elements, components counted singly.
    #[must_use]
    pub fn len(&self) -> usize {
        for_each_variant!(self, slice => slice.len())
    }

    /// Whether there are no elements.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The elements as `f64`, which holds all of them exactly.
    pub fn iter_f64(&self) -> Box<dyn Iterator<Item = f64> + '_> {
        macro_rules! widen {
            ($slice:ident) => {
                Box::new($slice.iter().map(|&value| f64::from(value)))
            };
        }
        for_each_variant!(self, slice => widen!(slice))
    }

    /// The address of the first element, for the C boundary.
    #[must_use]
    pub fn as_ptr(&self) -> *const core::ffi::c_void {
        for_each_variant!(self, slice => slice.as_ptr().cast())
    }
}

/// One column as a plugin sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColumnView<'a> {
    /// The column's name.
    pub name: &'a str,
    /// Elements per surfel, at least 1.
    pub components: u32,
    /// Changes whenever the values change; equal generations mean equal values.
    pub generation: u64,
    /// The values.
    pub values: Values<'a>,
}

/// A cloud as a plugin sees it: columns of equal length around an f64 origin.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CloudView<'a> {
    /// World position that `position` is relative to, scene units.
    pub origin: DVec3,
    /// Number of surfels; every column has `len * components` elements.
    pub len: usize,
    /// The columns.
    pub columns: Vec<ColumnView<'a>>,
    /// Triangles between the surfels, as indices of their corners counterclockwise seen from
    /// outside, where the cloud came from a file of a mesh; else empty. Every index is below
    /// `len`.
    pub faces: &'a [[u32; 3]],
    /// The cloud's own box, which textures are fastened to.
    pub object: ObjectFrame,
}

impl<'a> CloudView<'a> {
    /// The column of this name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&ColumnView<'a>> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// The `f32` values of a column with this many components; `None` where there is no such
    /// column or it has another type.
    #[must_use]
    pub fn floats(&self, name: &str, components: u32) -> Option<&'a [f32]> {
        match self.column(name)? {
            ColumnView { values: Values::F32(values), components: found, .. }
                if *found == components =>
            {
                Some(values)
            }
            _ => None,
        }
    }

    /// The three-component `f32` column as vectors, surfel by surfel; empty where absent.
    pub fn vectors(&self, name: &str) -> impl ExactSizeIterator<Item = Vec3> + 'a {
        self.floats(name, 3).unwrap_or_default().chunks_exact(3).map(Vec3::from_slice)
    }

    /// Whether a surfel is only around the part of the cloud that a tool works on: see [`CONTEXT`].
    #[must_use]
    pub fn is_context(&self, index: usize) -> bool {
        match self.column(CONTEXT).map(|column| column.values) {
            Some(Values::U8(values)) => values.get(index).is_some_and(|&value| value != 0),
            _ => false,
        }
    }

    /// How much a stroke concerns each surfel: see [`WEIGHT`]; 1 where there is none. ABI 3.11.
    #[must_use]
    pub fn weights(&self) -> Vec<f32> {
        let weights = self.floats(WEIGHT, 1);
        weights.map_or_else(|| vec![1.0; self.len], <[f32]>::to_vec)
    }

    /// The albedo of each surfel as the host's surface buffer has it: linear Rec. 709, at least 0; 8- and
    /// 16-bit colours decoded, [`NEUTRAL_ALBEDO`] where there are none of three or four components.
    #[must_use]
    pub fn albedos(&self) -> Vec<Vec3> {
        let neutral = Vec3::from(NEUTRAL_ALBEDO);
        let column = self.column(COLOR).filter(|column| column.components >= 3);
        let Some(column) = column else { return vec![neutral; self.len] };
        let channel = |i: usize| match column.values {
            Values::U8(values) => srgb_to_linear(f32::from(values[i]) / 255.0),
            Values::U16(values) => srgb_to_linear(f32::from(values[i]) / 65535.0),
            Values::F32(values) => values[i].clamp(0.0, MAX_ALBEDO),
            _ => neutral.x,
        };
        let components = column.components as usize;
        let first = (0..column.values.len()).step_by(components).take(self.len);
        first.map(|i| Vec3::new(channel(i), channel(i + 1), channel(i + 2))).collect()
    }
}
