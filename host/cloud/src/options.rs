//! How clouds are read and written.

use crate::formats::plugins::{Formats, NoFormats};
use crate::summary::Loaded;
use std::sync::Arc;
use surfelshop_api::params::Values;
use surfelshop_geometry::{Progress, normals, silent};

/// Takes previews of a file while it is read: clouds of some of its points.
pub type PreviewSink = Arc<dyn Fn(Loaded) + Send + Sync>;

/// What colours of 16 bits hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorBits {
    /// What their values tell: 8 bits where none is larger than 255, as programs that leave them unscaled write LAS
    /// files.
    #[default]
    Told,
    /// Values of 8 bits; larger ones are taken as 255.
    Eight,
    /// Values of 16 bits, however dark they are.
    Sixteen,
}

impl ColorBits {
    /// Whether colours are taken as those of 8 bits, of which `most` is the largest value.
    #[must_use]
    pub fn are_eight(self, most: u16) -> bool {
        match self {
            Self::Told => (1..=u16::from(u8::MAX)).contains(&most),
            Self::Eight => true,
            Self::Sixteen => false,
        }
    }
}

/// How a file is read.
#[derive(Clone, Copy)]
pub struct ReadOptions<'a> {
    /// Neighbours that missing normals are fitted to.
    pub n_neighbours: usize,
    /// The radius of every point of a file that gives none, counted as given; where it is `None`
    /// or not positive, radii are estimated.
    pub radius: Option<f32>,
    /// Takes how far the work is, in [0, 1], and may ask it to stop.
    pub progress: Progress<'a>,
    /// Formats of plugins, beside those that are built in.
    pub formats: &'a dyn Formats,
    /// The id of the format to read with, whatever the file looks like.
    pub format: Option<&'a str>,
    /// Parameters of the format that were set.
    pub values: Option<&'a Values>,
    /// What colours of 16 bits hold.
    pub color_bits: ColorBits,
    /// Takes some of the points while the file is read and while what is missing is estimated, several times where it
    /// takes long.
    pub preview: Option<&'a PreviewSink>,
}

impl Default for ReadOptions<'_> {
    fn default() -> Self {
        Self {
            n_neighbours: normals::DEFAULT_NEIGHBOURS,
            radius: None,
            progress: &silent,
            formats: &NoFormats,
            format: None,
            values: None,
            color_bits: ColorBits::default(),
            preview: None,
        }
    }
}

/// How a file is written.
#[derive(Clone)]
pub struct WriteOptions<'a> {
    /// Text instead of binary little endian; several times larger, and just as exact.
    pub ascii: bool,
    /// Comments for the header.
    pub comments: Vec<String>,
    /// Takes how far the work is, in [0, 1], and may ask it to stop.
    pub progress: Progress<'a>,
    /// Formats of plugins, beside PLY.
    pub formats: &'a dyn Formats,
    /// Parameters of the format that were set.
    pub values: Option<&'a Values>,
}

impl Default for WriteOptions<'_> {
    fn default() -> Self {
        Self {
            ascii: false,
            comments: Vec::new(),
            progress: &silent,
            formats: &NoFormats,
            values: None,
        }
    }
}
