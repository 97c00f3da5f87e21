//! Imperfect shadow maps of the virtual lights: points go over them, and holes are filled.

use crate::frame::{Passes, groups_of};
use crate::modules::{HEMISPHERE, MAPS, MATERIAL, VPL, with};
use surfelshop_api::graph::{BufferId, UniformId};
use surfelshop_api::prelude::*;

/// Texels that a map's side is a multiple of: few, so that maps of any number of lights have about as
/// many together.
const BLOCK: u32 = 4;

/// At most so many times fewer points and texels are drawn while something moves: with a hundred in each
/// of 64 maps shadows are still about where they are.
const FEWEST: u32 = 16;

/// Texels of a map for each point that goes over it, at most: more of them show the same few discs.
const TEXELS_PER_POINT: f64 = 32.0;

/// Discs of shadow maps by their radius where they cover the surface as the scene's do. Enlarged discs
/// reach beyond the edges of an occluder, holes between smaller ones let light through: at this size the
/// two are balanced, measured against rays; holes are filled.
const ENLARGED: f32 = 0.6;

/// The shadow maps of a frame.
pub(crate) struct ShadowMaps {
    pub(crate) sizes: UniformId,
    pub(crate) scene: BufferId,
    pub(crate) n_points: u32,
    pub(crate) side: u32,
    /// Of all bounces.
    pub(crate) filled: BufferId,
    pub(crate) diffuse_vpls: BufferId,
    pub(crate) specular_vpls: BufferId,
    /// Of the first bounce as the points left them.
    pub(crate) first: BufferId,
    /// The lights of the first bounce.
    pub(crate) own: BufferId,
}

/// The sizes of a frame's shadow maps.
pub(crate) struct MapSizes {
    /// The same as `Sizes` of `maps.wgsl`.
    pub(crate) uniform: UniformId,
    /// Surfels that go over the maps.
    pub(crate) n_points: u32,
    /// Texels on a side of a map.
    pub(crate) side: u32,
    /// Texels of all maps of a bounce.
    pub(crate) n_texels: u64,
}

/// By how many maps surfels move on from frame to frame: without a divisor in common with the number of
/// maps, so that each gets to all.
fn turn_of(n_maps: u32) -> u32 {
    let half = n_maps / 2 + 1;
    if n_maps.is_multiple_of(2) { half | 1 } else { half }
}

impl Passes<'_> {
    /// How many points go over the maps, and how many texels these have.
    pub(crate) fn map_sizes(&mut self) -> MapSizes {
        let p = &self.frame.params;
        let n = u64::from(self.n_vpls);
        let n_surfels = self.frame.cloud.n_surfels;
        // While something moves as much less as of the surfels that are drawn.
        let stride = self.graph.stride().min(FEWEST);
        let n_points = Graph::surfels_given(n_surfels, p.ism_points).div_ceil(stride);
        let texels = f64::from(p.ism_size).powi(2) / f64::from(stride);
        let texels = texels.min(f64::from(n_points) * TEXELS_PER_POINT);
        let side = ((texels / n as f64).sqrt() as u32 / BLOCK).max(1) * BLOCK;
        let n_texels = u64::from(side).pow(2) * n;
        let step = Graph::surfels_per_given(n_surfels, p.ism_points) * u64::from(stride);
        // Each disc stands for so many of the scene's in its map.
        let stands_for = (step as f64 * n as f64).min(n_surfels as f64);
        let uniform = self.graph.uniform(
            Uniform::new()
                .u32(self.n_vpls)
                .u32(side)
                .u32(n_points)
                .u32(stride)
                .u32(self.frame.frame_index.wrapping_mul(turn_of(self.n_vpls)))
                .f32(ENLARGED * (stands_for.sqrt() / self.extent) as f32)
                .f32(self.per_extent()),
        );
        MapSizes { uniform, n_points, side, n_texels }
    }

    /// Splats the surfels into the maps of a bounce.
    pub(crate) fn splat(
        &mut self,
        bounce: u32,
        vpls: BufferId,
        depths: BufferId,
        maps: &ShadowMaps,
    ) {
        let name = format!("shadow maps, bounce {}", bounce + 1);
        let groups = groups_of(maps.n_points, 64);
        let pass = Pass::compute(&name, include_str!("splat.wgsl"), "splat", groups);
        self.graph.pass(
            with(pass, &[MATERIAL, VPL, HEMISPHERE, MAPS])
                .bind("sizes", maps.sizes)
                .bind("scene", maps.scene)
                .bind("vpls", vpls)
                .bind("depths", depths),
        );
    }

    /// Fills the holes of the maps of a bounce.
    pub(crate) fn fill(&mut self, bounce: u32, depths: BufferId, maps: &ShadowMaps) {
        let blocks = maps.side.div_ceil(8);
        let groups = Groups::Fixed([blocks, blocks, self.n_vpls]);
        let place = self.graph.uniform(Uniform::new().u32(bounce * self.n_vpls));
        let name = format!("fill holes, bounce {}", bounce + 1);
        let pass = Pass::compute(&name, include_str!("fill.wgsl"), "fill", groups);
        self.graph.pass(
            with(pass, &[MATERIAL, VPL, HEMISPHERE, MAPS])
                .bind("sizes", maps.sizes)
                .bind("place", place)
                .bind("depths", depths)
                .bind("filled", maps.filled)
                .constant("LEVELS", f64::from(self.frame.params.pull_push)),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::turn_of;
    use std::collections::BTreeSet;

    #[test]
    fn surfels_get_to_every_map() {
        for n in 1..=1024u32 {
            let maps: BTreeSet<u32> = (0..n).map(|frame| frame * turn_of(n) % n).collect();
            assert_eq!(maps.len(), n as usize, "{n}");
        }
    }
}
