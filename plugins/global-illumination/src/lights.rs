//! The virtual lights of all bounces, and their shadow maps.

use crate::lamps::CELLS;
use crate::passes::{Passes, with};
use surfelshop_api::graph::{BufferId, UniformId};
use surfelshop_api::prelude::*;

/// Bytes of the structures of the shaders.
const VPL_BYTES: u64 = 80;
const SENDER_BYTES: u64 = 48;
const SHINE_BYTES: u64 = 32;
const RAY_BYTES: u64 = 32;

/// Cells of all levels of a face's importance.
const PYRAMID: u64 = 5461;

/// Texels that a map's side is a multiple of: few, so that maps of any number of lights have about as
/// many together.
const BLOCK: u32 = 4;

/// At most so many times fewer points and texels are drawn while something moves: with a hundred in each
/// of 64 maps shadows are still about where they are.
const FEWEST: u32 = 16;

/// Texels of a map for each point that goes over it, at most: more of them show the same few discs.
const TEXELS_PER_POINT: f64 = 32.0;

/// Discs of shadow maps by their radius where they cover the surface as the scene's do. Enlarged discs
/// reach beyond the edges of what throws a shadow, holes between smaller ones let light through: at this
/// size the two are balanced, measured against rays; holes are filled.
const ENLARGED: f32 = 0.6;

/// The shadow maps of a frame.
pub(crate) struct Maps {
    pub(crate) sizes: UniformId,
    scene: BufferId,
    pub(crate) n_points: u32,
    pub(crate) side: u32,
    /// Of all bounces.
    pub(crate) filled: BufferId,
    pub(crate) senders: BufferId,
    pub(crate) shines: BufferId,
    /// Of the first bounce as the points left them.
    pub(crate) first: BufferId,
    /// The lights of the first bounce.
    pub(crate) own: BufferId,
}

fn groups_of(n: u32, size: u32) -> Groups {
    let groups = n.div_ceil(size).max(1);
    let rows = groups.div_ceil(65_535);
    Groups::Fixed([groups.div_ceil(rows), rows, 1])
}

/// By how many maps surfels move on from frame to frame: without a divisor in common with the number of
/// maps, so that each gets to all.
fn turn_of(n_maps: u32) -> u32 {
    let half = n_maps / 2 + 1;
    if n_maps.is_multiple_of(2) { half | 1 } else { half }
}

impl Passes<'_> {
    /// The lights of all bounces and their maps.
    pub(crate) fn bounces(&mut self) -> Maps {
        let p = &self.frame.params;
        let n = u64::from(self.n_vpls);
        let n_surfels = self.frame.cloud.n_surfels;
        // While something moves as much less as of the surfels that are seen.
        let stride = self.graph.stride().min(FEWEST);
        let n_points = Graph::surfels_given(n_surfels, p.ism_points).div_ceil(stride);
        let texels = f64::from(p.ism_size).powi(2) / f64::from(stride);
        let texels = texels.min(f64::from(n_points) * TEXELS_PER_POINT);
        let side = ((texels / n as f64).sqrt() as u32 / BLOCK).max(1) * BLOCK;
        let n_texels = u64::from(side).pow(2) * n;
        let step = Graph::surfels_per_given(n_surfels, p.ism_points) * u64::from(stride);
        // Each disc stands for so many of the scene's in its map.
        let stands_for = (step as f64 * n as f64).min(n_surfels as f64);
        let sizes = self.graph.uniform(
            Uniform::new()
                .u32(self.n_vpls)
                .u32(side)
                .u32(n_points)
                .u32(stride)
                .u32(self.frame.frame_index.wrapping_mul(turn_of(self.n_vpls)))
                .f32(ENLARGED * (stands_for.sqrt() / self.extent) as f32)
                .f32(self.per_extent()),
        );
        let scene = self.graph.surfels("surfels for shadow maps", n_surfels, p.ism_points);
        let all = u64::from(self.n_bounces) * n;
        let filled = Buffer::new(u64::from(self.n_bounces) * n_texels * 4);
        let filled = self.graph.buffer("shadow maps", filled);
        let senders = self.graph.buffer("virtual lights", Buffer::new(all * SENDER_BYTES));
        // Where nothing shines nothing of it is kept.
        let n_shines = if self.shines() { all } else { 1 };
        let shines = self.graph.buffer("highlights of lights", Buffer::new(n_shines * SHINE_BYTES));
        let mut latest = self.distribute();
        let mut first = None;
        let own = latest;
        let maps =
            |first| Maps { sizes, scene, n_points, side, filled, senders, shines, first, own };
        for bounce in 0..self.n_bounces {
            let label = format!("points of shadow maps, bounce {}", bounce + 1);
            let depths = self.graph.buffer(&label, Buffer::new(n_texels * 4));
            let first = *first.get_or_insert(depths);
            self.collect(bounce, latest, &maps(first));
            self.splat(bounce, latest, depths, &maps(first));
            self.fill(bounce, depths, &maps(first));
            if bounce + 1 < self.n_bounces {
                latest = self.reflect(bounce, latest, depths, &maps(first));
            }
        }
        maps(first.unwrap_or(filled))
    }

    /// The lights of the first bounce.
    fn distribute(&mut self) -> BufferId {
        let n_faces = self.lamps.faces.len() as u32;
        let importance =
            self.graph.buffer("importance", Buffer::new(u64::from(n_faces) * PYRAMID * 4));
        let (groups, wgsl) = (CELLS / 8, include_str!("importance.wgsl"));
        for (name, entry, groups) in [
            ("importance", "weigh", [groups, groups, n_faces]),
            ("importance, levels", "add_up", [n_faces, 1, 1]),
        ] {
            let pass = Pass::compute(name, wgsl, entry, Groups::Fixed(groups));
            let mut pass = with!(pass, "lamps", "material").bind("importance", importance);
            if entry == "weigh" {
                pass = pass
                    .bind("faces", self.faces)
                    .bind("body", self.material)
                    .bind("texels", self.texels);
            }
            self.graph.pass(pass);
        }
        let placed = self
            .graph
            .buffer("virtual lights, bounce 1", Buffer::new(u64::from(self.n_vpls) * VPL_BYTES));
        let first = self.frame.frame_index.wrapping_mul(self.n_vpls);
        let wanted = self.graph.uniform(Uniform::new().u32(self.n_vpls).u32(first));
        let groups = groups_of(self.n_vpls, 64);
        let wgsl = include_str!("distribute.wgsl");
        let pass = Pass::compute("distribute lights", wgsl, "distribute", groups);
        self.graph.pass(
            with!(pass, "lamps", "chance", "material", "vpl")
                .bind("wanted", wanted)
                .bind("faces", self.faces)
                .bind("texels", self.texels)
                .bind("importance", importance)
                .bind("vpls", placed),
        );
        placed
    }

    /// Puts the lights of a bounce behind those of the bounces before.
    fn collect(&mut self, bounce: u32, latest: BufferId, maps: &Maps) {
        let place = Uniform::new().u32(self.n_vpls).u32(bounce * self.n_vpls);
        let place = self.graph.uniform(place);
        let groups = groups_of(self.n_vpls, 64);
        let name = format!("collect lights, bounce {}", bounce + 1);
        let pass = Pass::compute(&name, include_str!("collect.wgsl"), "collect", groups);
        self.graph.pass(
            with!(pass, "material", "vpl")
                .bind("place", place)
                .bind("body", self.material)
                .bind("latest", latest)
                .bind("senders", maps.senders)
                .bind("shines", maps.shines),
        );
    }

    fn splat(&mut self, bounce: u32, vpls: BufferId, depths: BufferId, maps: &Maps) {
        let name = format!("shadow maps, bounce {}", bounce + 1);
        let groups = groups_of(maps.n_points, 64);
        let pass = Pass::compute(&name, include_str!("splat.wgsl"), "splat", groups);
        self.graph.pass(
            with!(pass, "material", "vpl", "hemisphere", "maps")
                .bind("sizes", maps.sizes)
                .bind("scene", maps.scene)
                .bind("vpls", vpls)
                .bind("depths", depths),
        );
    }

    fn fill(&mut self, bounce: u32, depths: BufferId, maps: &Maps) {
        let blocks = maps.side.div_ceil(8);
        let groups = Groups::Fixed([blocks, blocks, self.n_vpls]);
        let place = self.graph.uniform(Uniform::new().u32(bounce * self.n_vpls));
        let name = format!("fill holes, bounce {}", bounce + 1);
        let pass = Pass::compute(&name, include_str!("fill.wgsl"), "fill", groups);
        self.graph.pass(
            with!(pass, "material", "vpl", "hemisphere", "maps")
                .bind("sizes", maps.sizes)
                .bind("place", place)
                .bind("depths", depths)
                .bind("filled", maps.filled)
                .constant("LEVELS", f64::from(self.frame.params.pull_push)),
        );
    }

    /// The lights of the next bounce.
    fn reflect(
        &mut self,
        bounce: u32,
        latest: BufferId,
        depths: BufferId,
        maps: &Maps,
    ) -> BufferId {
        let n = u64::from(self.n_vpls);
        let step = Uniform::new().u32(bounce).u32(self.frame.frame_index);
        let step = self.graph.uniform(step);
        let number = bounce + 2;
        let rays = self.graph.buffer(&format!("rays, bounce {number}"), Buffer::new(n * RAY_BYTES));
        let winners =
            self.graph.buffer(&format!("met by rays, bounce {number}"), Buffer::new(n * 4));
        let next = format!("virtual lights, bounce {number}");
        let next = self.graph.buffer(&next, Buffer::new(n * VPL_BYTES));
        let wgsl = include_str!("bounce.wgsl");
        let pass = |name: &str, entry: &str, groups| {
            let pass = Pass::compute(&format!("{name}, bounce {number}"), wgsl, entry, groups);
            with!(pass, "chance", "material", "vpl", "hemisphere", "maps").bind("sizes", maps.sizes)
        };
        let each = groups_of(self.n_vpls, 64);
        self.graph.pass(
            pass("send light", "send", each)
                .bind("step", step)
                .bind("body", self.material)
                .bind("vpls", latest)
                .bind("depths", depths)
                .bind("filled", maps.filled)
                .bind("rays", rays)
                .constant("gi::material::SHINES", f64::from(u8::from(self.shines()))),
        );
        self.graph.pass(
            pass("meet surfels", "offer", groups_of(maps.n_points, 64))
                .bind("scene", maps.scene)
                .bind("vpls", latest)
                .bind("sent", rays)
                .bind("winners", winners),
        );
        self.graph.pass(
            pass("place lights", "arrive", each)
                .bind("scene", maps.scene)
                .bind("sent", rays)
                .bind("found", winners)
                .bind("next", next),
        );
        next
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
