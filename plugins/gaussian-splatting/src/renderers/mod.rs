//! What both renderers share: columns of Gaussians, their colours, and what lies beside and behind them.

pub(crate) mod gaussians;
pub(crate) mod gaussians_2d;

use surfelshop_api::columns::{OPACITY, POSITION, SH, SPLAT_ROTATION, SPLAT_SCALE};
use surfelshop_api::prelude::*;

choices! {
    /// How Gaussians that cover a pixel are put together.
    pub enum Blend {
        /// From near to far.
        Sorted = "sorted",
        /// By chance: without sorting, noisy.
        Stochastic = "stochastic",
        /// Added up, as if they glowed.
        Additive = "additive",
        /// The nearest that is at least half opaque.
        Nearest = "nearest",
        /// The mean of those about as far away as the nearest: as surfels are blended.
        Normalized = "normalized",
    }
}

choices! {
    /// What the numbers of colours mean.
    pub enum Space {
        /// As pictures have them: what nearly all programs train.
        Srgb = "srgb",
        /// Light.
        Linear = "linear",
    }
}

params! {
    /// Settings of both renderers.
    pub struct Drawing {
        /// Highest order of spherical harmonics that is drawn; 0 is one colour for all directions.
        order: u32 { default: 3, range: 0..=3 },
        /// Factor on the size of every Gaussian.
        size: f32 { default: 1.0, range: 0.01..=4.0 },
        /// Gaussians of less opacity are left out.
        least_opacity: f32 { default: 0.0, range: 0.0..=1.0 },
        /// How Gaussians are put together.
        blend: Blend { default: Blend::Sorted },
        /// Tries of each pixel where chance decides.
        samples: u32 { default: 16, range: 1..=64 },
        /// How much nearer or farther than the nearest those may be that are averaged, as a share of its distance.
        tolerance: f32 { default: 0.02, range: 0.0..=1.0 },
        /// The space of colours, in which they are blended.
        space: Space { default: Space::Srgb },
    }
}

/// What clouds have to have.
pub(crate) const NEEDS: &[NeedInfo] = &[
    NeedInfo::column(SPLAT_SCALE, 2),
    NeedInfo::column(SPLAT_ROTATION, 4),
    NeedInfo::column(OPACITY, 1).optional(),
    NeedInfo::column(SH[0], 3).optional(),
    NeedInfo::column(SH[1], 9).optional(),
    NeedInfo::column(SH[2], 15).optional(),
    NeedInfo::column(SH[3], 21).optional(),
];

/// Describes a frame of splats of this kind, with `settings` of its own besides size and least opacity; gives what
/// makes further passes over the same splats.
pub(crate) fn draw<P>(
    frame: &Frame<P>,
    p: &Drawing,
    (wgsl, footprint, settings): (&'static str, Footprint, Members),
    graph: &mut Graph,
) -> impl Fn(&str, &str) -> Pass + use<P> {
    let facts = &frame.cloud;
    let taken = facts.fulfilling(NEEDS);
    let has_surface = facts.has_others(&taken);
    graph.take(&taken);
    if p.space == Space::Srgb {
        graph.blend_encoded();
    }
    let columns = [
        BufferColumn::new(POSITION, 3),
        BufferColumn::new(SPLAT_SCALE, 3),
        BufferColumn::new(SPLAT_ROTATION, 4),
        BufferColumn::new(OPACITY, 1).or(1.0),
    ];
    let (n, gaussians) = graph.columns("gaussian", facts, &taken, &columns);
    let radiance = graph.radiance("radiance", facts, &taken, p.order);
    let settings = settings.f32("size", p.size).f32("least_opacity", p.least_opacity);
    let settings = graph.settings("drawing", settings);
    let pass = move |name: &str, function: &str| {
        Pass::splats(name, wgsl, function, footprint, n)
            .reads(&gaussians)
            .reads_radiance(&radiance)
            .settings(&settings)
            .tested(has_surface)
    };
    let sums = graph.texture("sums", Texture::view_sized(Format::Rgba32Float));
    graph.pass(pass("splats", "colored").target(sums).composed(match p.blend {
        Blend::Sorted => Composition::Over,
        Blend::Stochastic => Composition::Stochastic { samples: p.samples },
        Blend::Additive => Composition::Additive,
        Blend::Nearest => Composition::Nearest,
        Blend::Normalized => Composition::Normalized { tolerance: p.tolerance },
    }));
    let behind = graph.texture("surface", Texture::view_sized(Format::Rgba32Float));
    if has_surface {
        graph.pass(Pass::shading("surface", include_str!("surface.wgsl"), "shade").target(behind));
    }
    let encoded = u32::from(p.space == Space::Srgb);
    let shown = Members::new().u32("encoded", encoded).u32("has_surface", u32::from(has_surface));
    let shown = graph.members(shown);
    let color = resolved(graph, "color", sums);
    graph.pass(color.1.bind("settings", shown).bind("behind", behind));
    graph.output(Output::Color, color.0);

    // Asked for by name; else neither these passes nor what they write is there.
    let facing = graph.texture("sums of normals", Texture::view_sized(Format::Rgba32Float));
    graph.pass(pass("normals of splats", "facing").target(facing));
    let normal = resolved(graph, "normal", facing);
    graph.pass(normal.1);
    graph.output(Output::Normal, normal.0);
    let unread = graph.texture("not read", Texture::view_sized(Format::Rgba32Float));
    let median = graph.texture("median depth", Texture::view_sized(Format::R32Float));
    let expected = graph.texture("expected depth", Texture::view_sized(Format::R32Float));
    let depths = pass("depths of splats", "facing").target(unread);
    graph.pass(depths.depth(SplatDepth::Median, median).depth(SplatDepth::Expected, expected));
    graph.output(Output::Depth, median);
    graph.output(Output::Debug("expected-depth".to_owned()), expected);
    pass
}

/// A pass that turns sums into a picture.
fn resolved(graph: &mut Graph, entry: &str, sums: TextureId) -> (TextureId, Pass) {
    let picture = graph.texture(entry, Texture::view_sized(Format::Rgba32Float));
    let name = format!("{entry} of sums");
    let groups = Groups::PerPixel { divisor: 1 };
    // No render pass: not every device draws into 32-bit floats.
    let pass = Pass::compute(&name, include_str!("resolve.wgsl"), entry, groups);
    (picture, pass.bind("sums", sums).bind("picture", picture))
}
