//! A frame being described: what its passes share.

use crate::light_views::{LightViews, extent_of, side_in_motion};
use crate::settings::{Settings, Show};
use surfelshop_api::graph::Members;
use surfelshop_api::graph::{BufferId, TextureId, UniformId};
use surfelshop_api::prelude::*;

/// Bytes of what a texel of the light surface buffer has.
const TEXEL_BYTES: u64 = 32;

/// A frame being described.
pub(crate) struct Passes<'a> {
    pub(crate) frame: &'a Frame<Settings>,
    pub(crate) graph: &'a mut Graph,
    pub(crate) light_views: LightViews,
    /// Scene units.
    pub(crate) extent: f64,
    /// Lights of a bounce, and bounces: 0 where only direct light counts.
    pub(crate) n_vpls: u32,
    pub(crate) n_bounces: u32,
    pub(crate) faces: UniformId,
    pub(crate) material: UniformId,
    /// How far the lights see.
    pub(crate) depths: BufferId,
    /// The light surface buffer.
    pub(crate) texels: BufferId,
}

/// Enough groups of so many for `n`.
pub(crate) fn groups_of(n: u32, size: u32) -> Groups {
    let groups = n.div_ceil(size).max(1);
    let rows = groups.div_ceil(65_535);
    Groups::Fixed([groups.div_ceil(rows), rows, 1])
}

impl<'a> Passes<'a> {
    pub(crate) fn new(frame: &'a Frame<Settings>, graph: &'a mut Graph) -> Self {
        let p = &frame.params;
        let light_views = LightViews::new(frame, side_in_motion(p.light_map, graph.stride()));
        let extent = extent_of(&frame.cloud);
        let is_lit = !light_views.faces.is_empty() && frame.cloud.n_surfels > 0;
        let bounces = is_lit && p.vpls > 0 && p.bounces > 0 && p.show != Show::Direct;
        let (n_vpls, n_bounces) = if bounces { (p.vpls, p.bounces) } else { (0, 0) };
        let faces = graph.uniform(light_views.uniform(frame.view.camera.eye, extent));
        let material = Members::new().f32("diffuse", p.diffuse).f32("specular", p.specular);
        let material = graph.members(material.f32("shininess", p.shininess).f32("ior", p.ior));
        let n_texels = |side: u32| u64::from(side).pow(2) * light_views.faces.len().max(1) as u64;
        let depths = graph.buffer("depths of lights", Buffer::new(n_texels(light_views.side) * 4));
        let n_lit = if n_bounces > 0 { n_texels(light_views.lit_side()) } else { 1 };
        let texels = graph.buffer("light surfaces", Buffer::new(n_lit * TEXEL_BYTES));
        Self {
            frame,
            graph,
            light_views,
            extent,
            n_vpls,
            n_bounces,
            faces,
            material,
            depths,
            texels,
        }
    }

    /// Whether surfaces have highlights.
    pub(crate) fn shines(&self) -> bool {
        self.frame.params.specular > 0.0
    }

    pub(crate) fn per_extent(&self) -> f32 {
        (1.0 / self.extent) as f32
    }

    /// A picture of the size of the view.
    pub(crate) fn picture(&mut self, label: &str) -> TextureId {
        self.graph.texture(label, Texture::view_sized(Format::Rgba32Float))
    }
}
