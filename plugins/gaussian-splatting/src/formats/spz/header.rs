//! What a file says before its points.

use super::super::{ANTIALIASED, rest_of};
use super::RANGE;
use super::axes::Axes;
use surfelshop_api::format::{CloudHeader, FileColumn, UpAxis};
use surfelshop_api::glam::DVec3;
use surfelshop_api::prelude::{Error, Result};

/// The first bytes of a header.
pub(super) const MAGIC: &[u8] = b"NGSP";

/// Bytes that all headers have.
pub(super) const LEN: usize = 16;

/// The flag of scenes that were trained with antialiasing.
const ANTIALIASED_FLAG: u8 = 1;

/// The flag of files with extensions.
const EXTENDED: u8 = 2;

/// The highest degree of spherical harmonics in files.
const MOST_DEGREE: u8 = 4;

/// Most bits behind the point of a position of 24 bits.
const MOST_BITS: u8 = 30;

/// What is stored of a Gaussian, in the order of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Attribute {
    Positions,
    Opacities,
    Colors,
    Sizes,
    Rotations,
    Harmonics,
}

/// All of them.
pub(super) const ATTRIBUTES: [Attribute; 6] = [
    Attribute::Positions,
    Attribute::Opacities,
    Attribute::Colors,
    Attribute::Sizes,
    Attribute::Rotations,
    Attribute::Harmonics,
];

impl Attribute {
    /// The name for people.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Positions => "positions",
            Self::Opacities => "opacities",
            Self::Colors => "colours",
            Self::Sizes => "sizes",
            Self::Rotations => "rotations",
            Self::Harmonics => "spherical harmonics",
        }
    }
}

/// A header.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Header {
    pub(super) version: u32,
    pub(super) points: u64,
    /// Degree of spherical harmonics.
    pub(super) degree: usize,
    /// Bits behind the point of positions.
    pub(super) bits: u8,
    pub(super) antialiased: bool,
    pub(super) extended: bool,
    /// As the default is or an extension says.
    pub(super) axes: Axes,
}

impl Header {
    /// The header in these bytes, of one of these versions.
    pub(super) fn parse(
        bytes: &[u8; LEN],
        versions: std::ops::RangeInclusive<u32>,
    ) -> Result<Self> {
        let (words, _) = bytes.as_chunks::<4>();
        if words[0] != MAGIC {
            return Err(Error::new(
                "expected NGSP at the beginning of the header, found something else: this is no .spz file",
            ));
        }
        let [version, points] = [1, 2].map(|i| u32::from_le_bytes(words[i]));
        if !versions.contains(&version) {
            return Err(Error::new(format!(
                "expected version {} to {}, found {version}: the file is damaged, or newer than this reader",
                versions.start(),
                versions.end()
            )));
        }
        let [degree, bits, flags, _] = words[3];
        if degree > MOST_DEGREE {
            return Err(Error::new(format!(
                "expected spherical harmonics of degree 0 to {MOST_DEGREE}, found {degree}: the file is damaged"
            )));
        }
        if bits > MOST_BITS {
            return Err(Error::new(format!(
                "expected positions with at most {MOST_BITS} bits behind the point, found {bits}: the file is damaged"
            )));
        }
        Ok(Self {
            version,
            points: points.into(),
            degree: degree.into(),
            bits,
            antialiased: flags & ANTIALIASED_FLAG != 0,
            extended: flags & EXTENDED != 0,
            axes: Axes::default(),
        })
    }

    /// The bytes of the header of a file of gzip.
    pub(super) fn bytes(&self) -> [u8; LEN] {
        let mut bytes = [0; LEN];
        let (words, _) = bytes.as_chunks_mut::<4>();
        words[0].copy_from_slice(MAGIC);
        words[1] = self.version.to_le_bytes();
        words[2] = (self.points as u32).to_le_bytes();
        words[3] = [self.degree as u8, self.bits, u8::from(self.antialiased) * ANTIALIASED_FLAG, 0];
        bytes
    }

    /// Bytes of each attribute of a Gaussian.
    pub(super) fn sizes(&self) -> [usize; 6] {
        let position = if self.version == 1 { 6 } else { 9 };
        let rotation = if self.version < 3 { 3 } else { 4 };
        [position, 1, 3, 3, rotation, 3 * rest_of(self.degree)]
    }

    /// The header of the cloud.
    pub(super) fn cloud(&self, columns: Vec<FileColumn>) -> CloudHeader {
        // Extensions of older versions lie behind the points.
        let may_be_turned = self.extended && self.version < 4;
        let step = 1.0 / f64::from(1u32 << self.bits);
        let comments = self.antialiased.then(|| ANTIALIASED.to_owned());
        CloudHeader {
            format: format!("SPZ {}, spherical harmonics of degree {}", self.version, self.degree),
            rows: Some(self.points),
            columns,
            step: (self.version > 1).then(|| DVec3::splat(step)),
            up: if may_be_turned { UpAxis::Unknown } else { self.axes.up() },
            comments: comments.into_iter().collect(),
            ..CloudHeader::default()
        }
    }

    /// What is doubtful.
    pub(super) fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.degree > RANGE.degree {
            warnings.push("spherical harmonics of order 4 are left out".to_owned());
        }
        if self.extended && self.version < 4 {
            warnings.push(
                "the file's extensions are not read, one of which may say that its axes are others"
                    .to_owned(),
            );
        }
        if self.axes.is_mirrored() {
            let axes = self.axes.name();
            warnings.push(format!("the file's axes {axes} are left-handed: it appears mirrored"));
        }
        warnings
    }
}
