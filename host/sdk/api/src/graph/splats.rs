//! Splats that a graph draws itself: a function tells the footprint of each, and the host puts them together.

use crate::graph::passes::{Pass, SurfaceMode, Target, Work};
use crate::graph::resources::TextureId;
use serde::{Deserialize, Serialize};
use std::hash::{Hash, Hasher};

/// Most pictures of a pass of splats: vectors that a splat carries to the pixels.
pub const MAX_PAYLOADS: usize = 4;

/// What the pixels that a splat covers are told by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Footprint {
    /// A Gaussian in pixels: of a covariance that was projected, or a conic of one's own. Each pixel of it has the
    /// depth of its centre.
    Conic,
    /// A Gaussian in a plane of space: where the ray of a pixel meets the plane, exactly. Each pixel has a depth of its
    /// own.
    Planar,
}

/// How splats that cover one pixel are put together.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Composition {
    /// One over the other, from near to far in the order of the depths of their centres.
    Over,
    /// All of them added up.
    Additive,
    /// The nearest that is at least half opaque.
    Nearest,
    /// The nearest that is left where each is dropped with the probability of its transparency; the mean of so many
    /// tries. It tends to what [`Over`](Self::Over) shows where splats do not cut through each other, without sorting.
    Stochastic {
        /// Tries, 1 to 64.
        samples: u32,
    },
    /// The mean, by opacity, of all that are about as far away as the nearest that is at least half opaque: surfaces
    /// that splats overlap on, as EWA splatting shows them. Nothing where no splat is half opaque. ABI 3.10.
    ///
    /// Source: Zwicker et al. 2001, "EWA Volume Splatting"; Botsch et al. 2005, "High-Quality Surface Splatting on
    /// Today's GPUs".
    Normalized {
        /// How much nearer or farther than the nearest they may be, as a share of its distance; finite, 0 or more.
        tolerance: f32,
    },
}

impl Composition {
    /// What tells one from another: tolerances by their bits, so that equality is one even of those that are refused.
    fn key(self) -> (u8, u32) {
        match self {
            Self::Over => (0, 0),
            Self::Additive => (1, 0),
            Self::Nearest => (2, 0),
            Self::Stochastic { samples } => (3, samples),
            Self::Normalized { tolerance } => (4, tolerance.to_bits()),
        }
    }
}

impl PartialEq for Composition {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl Eq for Composition {}

impl Hash for Composition {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.key().hash(state);
    }
}

/// What a picture of depths shows of distances along the viewing axis, in scene units; 0 where nothing is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SplatDepth {
    /// The mean over the splats of a pixel, by how much of each is seen.
    Expected,
    /// That of the splat with which half of the light is kept off.
    Median,
    /// How far the splats of a pixel lie apart: the sum over all pairs of them of the product of their shares and the
    /// square of the difference of their distances, in squared scene units. ABI 3.10.
    ///
    /// Source: Huang et al. 2024, "2D Gaussian Splatting", equation 13, with each pair once and squares as in their
    /// program, which however maps distances to 0 to 1 between its near and far plane.
    Distortion,
}

/// What a pass of splats draws. ABI 3.9.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Splats {
    /// Number of splats: the function is called with 0 and each number below.
    pub n: u64,
    /// What the function makes.
    pub footprint: Footprint,
    /// How they are put together.
    pub composition: Composition,
    /// The pictures of the vectors that splats carry, in their order: sums by how much of each splat is seen.
    /// Four 32-bit floats each, of the view's size.
    pub targets: Vec<TextureId>,
    /// Pictures of depths: one 32-bit float each, of the view's size.
    #[serde(default)]
    pub depths: Vec<(SplatDepth, TextureId)>,
    /// Whether the surface of the surfels that the host draws hides what is behind it.
    #[serde(default)]
    pub tested: bool,
    /// Which surface that is.
    #[serde(default)]
    pub surface: SurfaceMode,
    /// The function that tells opacity and vectors pixel by pixel; none where opacity falls off as a Gaussian and
    /// vectors are the same everywhere. ABI 3.10.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub per_pixel: Option<String>,
}

impl Splats {
    /// The textures drawn into.
    pub fn textures(&self) -> impl Iterator<Item = TextureId> + '_ {
        self.targets.iter().copied().chain(self.depths.iter().map(|(_, texture)| *texture))
    }
}

impl Pass {
    /// A pass that draws splats: the WGSL function `fn(i: u32) -> splat::Splat` of the module `surfelshop::splat` tells
    /// the footprint, the opacity and what the `i`-th of `n` carries. Add [`target`](Self::target)s, one for each vector
    /// of the payload. Over is how they are put together where [`composed`](Self::composed) says nothing else. ABI 3.9.
    #[must_use]
    pub fn splats(name: &str, wgsl: &str, function: &str, footprint: Footprint, n: u64) -> Self {
        let work = Work::Splats(Splats {
            n,
            footprint,
            composition: Composition::Over,
            targets: Vec::new(),
            depths: Vec::new(),
            tested: false,
            surface: SurfaceMode::Blended,
            per_pixel: None,
        });
        Self::new(name, wgsl, function, work)
    }

    /// Puts splats together in this way. ABI 3.9.
    #[must_use]
    pub fn composed(mut self, composition: Composition) -> Self {
        if let Work::Splats(splats) = &mut self.work {
            splats.composition = composition;
        }
        self
    }

    /// Asks a function of the pass's WGSL for the opacity and the vectors of each splat at each pixel that it covers:
    /// `fn NAME(p: splat::Pixel) -> splat::Fragment`, in the module `surfelshop::splat`. The splat function still tells
    /// which pixels these are. Such passes are always composed by the device. ABI 3.10.
    #[must_use]
    pub fn per_pixel(mut self, function: &str) -> Self {
        if let Work::Splats(splats) = &mut self.work {
            splats.per_pixel = Some(function.to_owned());
        }
        self
    }

    /// Draws depths of splats into a texture of [`R32Float`](super::Format::R32Float). ABI 3.9.
    #[must_use]
    pub fn depth(mut self, which: SplatDepth, texture: TextureId) -> Self {
        if let Work::Splats(splats) = &mut self.work {
            splats.depths.push((which, texture));
        }
        self
    }

    /// Says whether the surface that the host draws hides splats behind it. ABI 3.9.
    #[must_use]
    pub fn tested(mut self, yes: bool) -> Self {
        if let Work::Splats(splats) = &mut self.work {
            splats.tested = yes;
        }
        self
    }

    /// Reads columns: brings their module along. ABI 3.9.
    #[must_use]
    pub fn reads(self, columns: &super::Columns) -> Self {
        let file = format!("columns `{}`", columns.path());
        self.module(columns.path(), &file, columns.wgsl())
            .bind(&columns.variable(), columns.buffer())
    }
}

impl Splats {
    /// Adds a picture of the next vector that splats carry.
    pub(super) fn add(&mut self, to: Target) {
        self.targets.push(to.texture);
    }
}
