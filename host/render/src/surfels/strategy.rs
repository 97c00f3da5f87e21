//! How surfels are drawn.

use crate::gpu::Gpu;
use crate::graph::SplatDrawing;

/// How surfels are drawn.
///
/// All ways give the same picture but for rounding at the edges of discs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SurfelDrawing {
    /// By the CPU where the adapter is software, else as quads.
    ///
    /// Measurements on software adapters say that there the CPU comes first, compute second
    /// while discs are small, and quads last. Literature (Schuetz et al. 2021) has compute ahead on
    /// graphics cards too, but of points of a pixel and without blending; quads stay the choice
    /// there until whole frames have been measured on one.
    #[default]
    Automatic,
    /// As quads in the surfels' tangent planes, by the device.
    Quads,
    /// Small discs by compute, large ones as quads, by the device. Frames whose surfels are shaded
    /// one by one, and pictures that do not fit one binding of the device, are drawn as quads.
    Compute,
    /// By the CPU, which hands the surface to the device.
    Processor,
}

impl SurfelDrawing {
    /// Whether the CPU draws where a device is as it is.
    pub(crate) fn on_host(self, gpu: &Gpu) -> bool {
        match self {
            Self::Automatic => gpu.is_software(),
            Self::Quads | Self::Compute => false,
            Self::Processor => true,
        }
    }

    /// How passes of splats are put together.
    pub(crate) fn of_splats(self, gpu: &Gpu) -> SplatDrawing {
        match self {
            Self::Processor => SplatDrawing::Processor,
            Self::Quads => SplatDrawing::Quads,
            Self::Automatic if gpu.is_software() => SplatDrawing::Processor,
            Self::Automatic | Self::Compute if gpu.lists_splats() => SplatDrawing::Lists,
            Self::Automatic | Self::Compute => SplatDrawing::Quads,
        }
    }

    /// Whether compute draws the small surfels of pictures of a size.
    pub(crate) fn computes(self, gpu: &Gpu, size: [u32; 2]) -> bool {
        self == Self::Compute && crate::surfels::compute::fits(gpu, size)
    }
}
