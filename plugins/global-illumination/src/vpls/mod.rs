//! The virtual point lights of all bounces: placed by importance, sent on by reflection.

use crate::frame::{Passes, groups_of};
use crate::light_views::CELLS;
use crate::modules::{HEMISPHERE, LIGHT_VIEWS, MAPS, MATERIAL, RANDOM, VPL, with};
use crate::shadow_maps::{MapSizes, ShadowMaps};
use surfelshop_api::graph::BufferId;
use surfelshop_api::prelude::*;

/// Bytes of the structures of the shaders.
const VPL_BYTES: u64 = 80;
const DIFFUSE_VPL_BYTES: u64 = 48;
const SPECULAR_VPL_BYTES: u64 = 32;
const RAY_BYTES: u64 = 32;

/// Cells of all levels of a face's importance.
const PYRAMID: u64 = 5461;

impl Passes<'_> {
    /// The lights of all bounces and their maps.
    pub(crate) fn bounces(&mut self) -> ShadowMaps {
        let p = &self.frame.params;
        let n = u64::from(self.n_vpls);
        let n_surfels = self.frame.cloud.n_surfels;
        let MapSizes { uniform: sizes, n_points, side, n_texels } = self.map_sizes();
        let scene = self.graph.surfels("surfels for shadow maps", n_surfels, p.ism_points);
        let all = u64::from(self.n_bounces) * n;
        let filled = Buffer::new(u64::from(self.n_bounces) * n_texels * 4);
        let filled = self.graph.buffer("shadow maps", filled);
        let diffuse_vpls =
            self.graph.buffer("virtual lights", Buffer::new(all * DIFFUSE_VPL_BYTES));
        // Without highlights nothing of them is kept.
        let n_specular = if self.shines() { all } else { 1 };
        let specular_vpls =
            self.graph.buffer("highlights of lights", Buffer::new(n_specular * SPECULAR_VPL_BYTES));
        let mut latest = self.distribute();
        let mut first = None;
        let own = latest;
        let maps = |first| ShadowMaps {
            sizes,
            scene,
            n_points,
            side,
            filled,
            diffuse_vpls,
            specular_vpls,
            first,
            own,
        };
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
        let n_faces = self.light_views.faces.len() as u32;
        let importance =
            self.graph.buffer("importance", Buffer::new(u64::from(n_faces) * PYRAMID * 4));
        let (groups, wgsl) = (CELLS / 8, include_str!("importance.wgsl"));
        for (name, entry, groups) in [
            ("importance", "weigh", [groups, groups, n_faces]),
            ("importance, levels", "add_up", [n_faces, 1, 1]),
        ] {
            let pass = Pass::compute(name, wgsl, entry, Groups::Fixed(groups));
            let mut pass = with(pass, &[LIGHT_VIEWS, MATERIAL]).bind("importance", importance);
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
        let request = self.graph.uniform(Uniform::new().u32(self.n_vpls).u32(first));
        let groups = groups_of(self.n_vpls, 64);
        let wgsl = include_str!("distribute.wgsl");
        let pass = Pass::compute("distribute lights", wgsl, "distribute", groups);
        self.graph.pass(
            with(pass, &[LIGHT_VIEWS, RANDOM, MATERIAL, VPL])
                .bind("request", request)
                .bind("faces", self.faces)
                .bind("texels", self.texels)
                .bind("importance", importance)
                .bind("vpls", placed),
        );
        placed
    }

    /// Puts the lights of a bounce behind those of the bounces before.
    fn collect(&mut self, bounce: u32, latest: BufferId, maps: &ShadowMaps) {
        let place = Uniform::new().u32(self.n_vpls).u32(bounce * self.n_vpls);
        let place = self.graph.uniform(place);
        let groups = groups_of(self.n_vpls, 64);
        let name = format!("collect lights, bounce {}", bounce + 1);
        let pass = Pass::compute(&name, include_str!("collect.wgsl"), "collect", groups);
        self.graph.pass(
            with(pass, &[MATERIAL, VPL])
                .bind("place", place)
                .bind("body", self.material)
                .bind("latest", latest)
                .bind("diffuse_vpls", maps.diffuse_vpls)
                .bind("specular_vpls", maps.specular_vpls),
        );
    }

    /// The lights of the next bounce.
    fn reflect(
        &mut self,
        bounce: u32,
        latest: BufferId,
        depths: BufferId,
        maps: &ShadowMaps,
    ) -> BufferId {
        let n = u64::from(self.n_vpls);
        let step = Uniform::new().u32(bounce).u32(self.frame.frame_index);
        let step = self.graph.uniform(step);
        let number = bounce + 2;
        let rays = self.graph.buffer(&format!("rays, bounce {number}"), Buffer::new(n * RAY_BYTES));
        let hits = self.graph.buffer(&format!("met by rays, bounce {number}"), Buffer::new(n * 4));
        let next = format!("virtual lights, bounce {number}");
        let next = self.graph.buffer(&next, Buffer::new(n * VPL_BYTES));
        let wgsl = include_str!("bounce.wgsl");
        let pass = |name: &str, entry: &str, groups| {
            let pass = Pass::compute(&format!("{name}, bounce {number}"), wgsl, entry, groups);
            with(pass, &[RANDOM, MATERIAL, VPL, HEMISPHERE, MAPS]).bind("sizes", maps.sizes)
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
                .bind("hits", hits),
        );
        self.graph.pass(
            pass("place lights", "arrive", each)
                .bind("scene", maps.scene)
                .bind("sent", rays)
                .bind("found", hits)
                .bind("next", next),
        );
        next
    }
}
