//! The volume of noise: described as passes that run once and are kept.

use crate::settings::PatternSettings;
use surfelshop_api::graph::{Resource, TextureId};
use surfelshop_api::prelude::*;

/// Cells along the volume, a power of two. Twin: `PERIOD` of the two shaders.
const PERIOD: u32 = 16;

/// Samples along a texel of a level: one of the first, and then as many as it has texels of the
/// first, up to eight, since its noise varies over a cell and not within it.
const MOST_SAMPLES: u32 = 8;

/// The side that is used for one that was asked for: a power of two, from the period itself on.
pub(crate) fn side(requested: u32) -> u32 {
    let below = requested.max(1).ilog2();
    (1u32 << below).max(PERIOD)
}

/// Describes the passes that fill the volume; they run when seed or size are new.
pub(crate) fn filled(graph: &mut Graph, chosen: &PatternSettings, requested: u32) -> TextureId {
    let side = side(requested);
    let n_levels = side.ilog2() + 1;
    let texture = Texture::fixed(Format::Rgba16Float, side, side)
        .depth(side, true)
        .mips(n_levels)
        .persistent(format!("noise {side} {}", chosen.seed));
    let texture = graph.texture("noise volume", texture);
    for level in 0..n_levels {
        let texels = side >> level;
        let uniform = Uniform::new().u32(texels).u32((1 << level).min(MOST_SAMPLES));
        let uniform = graph.uniform(uniform.uvec3(chosen.key()));
        let groups = texels.div_ceil(4);
        let name = format!("noise volume {level}");
        let target = Resource::Texture { id: texture, mip: Some(level) };
        graph.pass(
            Pass::compute(
                &name,
                include_str!("fill_volume.wgsl"),
                "fill",
                Groups::Fixed([groups; 3]),
            )
            .bind("level", uniform)
            .bind("filled", target),
        );
    }
    texture
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_powers_of_two() {
        let sides = [0, 1, 15, 16, 33, 63, 64, 200, 256].map(side);
        assert_eq!(sides, [16, 16, 16, 16, 32, 32, 64, 128, 256]);
    }
}
