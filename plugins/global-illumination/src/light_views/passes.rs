//! The passes that draw the light views, and direct light with their shadow maps.

use crate::frame::Passes;
use crate::modules::{LIGHT_VIEWS, MATERIAL, with};
use surfelshop_api::graph::{CameraId, TextureId};
use surfelshop_api::prelude::*;

impl Passes<'_> {
    /// What the lights see: how far all texels do, and of one of each block the surface, for the first lights.
    pub(crate) fn see_from(&mut self, cameras: &[CameraId]) {
        for (i, camera) in cameras.iter().enumerate() {
            let which = self.graph.uniform(Uniform::new().u32(i as u32));
            let (side, lit_side) = (self.light_views.side, self.light_views.lit_side());
            let pass = self.view_pass(&format!("light depths {}", i + 1), "measure", side);
            let depths = pass.seen_from(*camera).bind("which", which).bind("depths", self.depths);
            self.graph.pass(depths);
            if self.n_bounces > 0 {
                let pass = self.view_pass(&format!("light surface {}", i + 1), "fill", lit_side);
                let texels =
                    pass.seen_from(*camera).bind("which", which).bind("texels", self.texels);
                self.graph.pass(texels);
            }
        }
    }

    /// A pass over so many texels on a side of what a light sees.
    fn view_pass(&self, name: &str, entry: &str, side: u32) -> Pass {
        let groups = Groups::Fixed([side / 8, side / 8, 1]);
        let pass = Pass::compute(name, include_str!("light_surface.wgsl"), entry, groups);
        with(pass, &[LIGHT_VIEWS]).merges(true).bind("faces", self.faces)
    }

    /// Direct light.
    pub(crate) fn direct(&mut self) -> TextureId {
        let direct = self.picture("direct light");
        let pass = Pass::shading("direct light", include_str!("direct.wgsl"), "shade");
        self.graph.pass(
            with(pass, &[LIGHT_VIEWS, MATERIAL])
                .merges(true)
                .bind("faces", self.faces)
                .bind("body", self.material)
                .bind("depths", self.depths)
                .feature("gi::material::SHINES", self.shines())
                .target(direct),
        );
        direct
    }
}
