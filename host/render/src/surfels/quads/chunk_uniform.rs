//! What the shaders know of a chunk of surfels.

use crate::host_uniform::HostUniform;
use glam::Mat4;
use surfelshop_api::SurfaceSettings;
use surfelshop_api::columns::NEUTRAL_ALBEDO;

/// A chunk of surfels as its shaders know it.
pub(super) struct PlacedChunk {
    pub(super) view_from_chunk: Mat4,
    /// Number of its first surfel, plus one.
    pub(super) first: u32,
    pub(super) count: u32,
    /// Which of the scene's clouds it belongs to.
    pub(super) object: u32,
    /// The radius of all its surfels, where they have one.
    pub(super) equal_radius: f32,
    /// The largest radius of round splats, in shares of their distance and times the scene's factor on radii.
    pub(super) round_reach: f32,
    /// How many of its surfels stand before merged ones.
    pub(super) n_own: u32,
}

/// The bytes of `Chunk` of `disc.wgsl`.
pub(super) fn chunk_uniform(
    settings: &SurfaceSettings,
    unit: f64,
    stride: u32,
    placed: &PlacedChunk,
) -> HostUniform {
    // No infinity for shaders, whose compilers need not know any.
    let is_bounded = placed.round_reach.is_finite();
    HostUniform::new()
        .mat4("view_from_chunk", placed.view_from_chunk)
        .u32("first", placed.first)
        .u32("count", placed.count)
        .f32("radius_scale", (f64::from(settings.radius_scale) / unit) as f32)
        .f32("tolerance", settings.depth_tolerance)
        .u32("two_sided", u32::from(settings.two_sided))
        .f32("low_pass", settings.low_pass)
        .f32("unit", unit as f32)
        .f32("tangent_scale", settings.radius_scale)
        .u32("stride", stride)
        .u32("object", placed.object)
        .vec3("albedo", NEUTRAL_ALBEDO.into())
        .f32("radius", placed.equal_radius)
        .f32(
            "round_reach",
            if is_bounded { placed.round_reach * settings.radius_scale } else { 0.0 },
        )
        .u32("n_bounded", if is_bounded { placed.n_own } else { 0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surfels::quads::DISC;

    /// Invariant: the host's own uniforms have the members of the shaders' structures
    #[test]
    fn chunks_are_laid_out_as_the_shaders_declare_them() {
        let placed = PlacedChunk {
            view_from_chunk: Mat4::IDENTITY,
            first: 1,
            count: 2,
            object: 3,
            equal_radius: 4.0,
            round_reach: 5.0,
            n_own: 2,
        };
        let source = format!(
            "{DISC}\nvar<storage, read_write> seen: u32;\n\
             @compute @workgroup_size(1) fn main() {{ seen = chunk.first; }}"
        );
        let uniform = chunk_uniform(&SurfaceSettings::default(), 1.0, 1, &placed);
        uniform.assert_is_laid_out_as(&source, "main", "chunk");
    }
}
