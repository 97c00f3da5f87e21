//! # `gaussians-2d`: Gaussians in planes (2DGS)
//!
//! The parameters are those of [`Drawing`](super::Drawing).
//!
//! Each Gaussian is a surfel without an edge: the ray of a pixel meets its plane exactly, and depth and normal are
//! those of the plane. Of a Gaussian in space the shortest axis is left out.
//!
//! The output `debug.distortion` shows how far the Gaussians of a pixel lie apart along its ray.
//!
//! Limits: the order is that of the centres, not that of each pixel.
//!
//! Source: Huang et al. 2024, "2D Gaussian Splatting for Geometrically Accurate Radiance Fields".

use super::{Drawing, NEEDS, draw};
use surfelshop_api::prelude::*;

params! {
    /// Settings of the renderer.
    pub struct Settings {
        /// How Gaussians are drawn.
        drawing: Drawing { group: Drawing::default() },
    }
}

/// The renderer.
pub(crate) struct Gaussians2d;

impl Renderer for Gaussians2d {
    const INFO: UnitInfo = UnitInfo::new(
        "gaussians-2d",
        "Gaussians in planes",
        "Gaussians in planes, met exactly by rays: 2D Gaussian splatting.",
    );
    type Params = Settings;
    const NEEDS: &'static [NeedInfo] = NEEDS;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
        let kind = (include_str!("gaussians_2d.wgsl"), Footprint::Planar, Members::new());
        let pass = draw(frame, &frame.params.drawing, kind, graph);
        // What training shrinks. Gaussians in space are met at no distance of their own.
        let distortion = graph.texture("distortion", Texture::view_sized(Format::R32Float));
        let unread = graph.texture("not read either", Texture::view_sized(Format::Rgba32Float));
        let apart = pass("distortion of splats", "footprint").target(unread);
        graph.pass(apart.depth(SplatDepth::Distortion, distortion));
        graph.output(Output::Debug("distortion".to_owned()), distortion);
        Ok(())
    }
}
