//! Splats that a graph draws itself: a function tells the footprint of each, and the host puts them together.

use crate::graph::passes::{Pass, SurfaceMode, Target, Work};
use crate::graph::resources::TextureId;
use serde::{Deserialize, Serialize};

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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
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
}

/// Which distance a picture of depths shows, along the viewing axis in scene units; 0 where nothing is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SplatDepth {
    /// The mean over the splats of a pixel, by how much of each is seen.
    Expected,
    /// That of the splat with which half of the light is kept off.
    Median,
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
