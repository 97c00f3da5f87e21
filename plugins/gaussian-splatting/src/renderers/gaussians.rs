//! # `gaussians`: Gaussians in space (3DGS)
//!
//! | parameter       | type   | default   | meaning                                                               |
//! |-----------------|--------|-----------|-----------------------------------------------------------------------|
//! | `filter`        | choice | `classic` | `classic` as in 2023, `mip` keeps what is small as faint as it is, `none` |
//! | `order` and others | | | those of [`Drawing`](super::Drawing)                                                 |
//!
//! Each Gaussian is projected to an ellipse and drawn over those behind it, in the order of their centres.
//!
//! Limits: Gaussians that cut through each other change places as a whole where the camera moves; the projection is
//! linear around each centre, so that large ones beside the picture are not exact.
//!
//! Source: Kerbl et al. 2023, "3D Gaussian Splatting for Real-Time Radiance Field Rendering"; Yu et al. 2024,
//! "Mip-Splatting"; Kheradmand et al. 2025, "Stochastic Splats".

use super::{Drawing, NEEDS, draw};
use surfelshop_api::prelude::*;

choices! {
    /// What is done with Gaussians that are smaller than a pixel.
    pub enum Filter {
        /// They are widened, and so look brighter, as in the program of 2023.
        Classic = "classic",
        /// They are widened less and made as much fainter.
        Mip = "mip",
        /// Nothing: they flicker.
        None = "none",
    }
}

params! {
    /// Settings of the renderer.
    pub struct Settings {
        /// What is done with Gaussians that are smaller than a pixel.
        filter: Filter { default: Filter::Classic },
        /// How Gaussians are drawn.
        drawing: Drawing { group: Drawing::default() },
    }
}

/// The renderer.
pub(crate) struct Gaussians;

impl Renderer for Gaussians {
    const INFO: UnitInfo = UnitInfo::new(
        "gaussians",
        "Gaussians",
        "Gaussians in space, sorted and blended: 3D Gaussian splatting.",
    );
    type Params = Settings;
    const NEEDS: &'static [NeedInfo] = NEEDS;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
        // Variances in square pixels: those of both papers' programs.
        let (low_pass, keeps_sum) = match frame.params.filter {
            Filter::Classic => (0.3, 0),
            Filter::Mip => (0.1, 1),
            Filter::None => (0.0, 0),
        };
        let own = Members::new().f32("low_pass", low_pass).u32("keeps_sum", keeps_sum);
        let kind = (include_str!("gaussians.wgsl"), Footprint::Conic, own);
        drop(draw(frame, &frame.params.drawing, kind, graph));
        Ok(())
    }
}
