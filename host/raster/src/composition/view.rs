//! What is drawn, how it is put together, and where it is seen from.

/// A footprint as the device stores it: [`Footprint`](super::Footprint), and two numbers that mean nothing.
pub type Words = [f32; 12];

/// What footprints are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Gaussians in pixels.
    Conic,
    /// Gaussians in planes of space.
    Planar,
}

/// How splats of a pixel are put together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Composition {
    /// From near to far, each over those behind it.
    Over,
    /// Added up.
    Additive,
    /// The nearest that is at least half opaque.
    Nearest,
    /// The mean of so many tries, each of the nearest that chance leaves.
    Stochastic(u32),
    /// The mean of those whose distance differs from that of the nearest which is at least half opaque by at most this
    /// share of it.
    Normalized(f32),
}

/// Which depths are wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Depths {
    /// The mean, by how much of each splat is seen.
    pub expected: bool,
    /// That of the splat with which half of the light is kept off.
    pub median: bool,
    /// How far splats lie apart.
    pub distortion: bool,
}

/// Where splats are seen from.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Width and height in pixels, at most 65,535.
    pub size_px: [u32; 2],
    /// The nearest distance that is drawn, in units of footprints.
    pub near: f32,
    /// Scene units of a unit of footprints' distances.
    pub unit: f32,
    /// Whether rays are parallel.
    pub orthographic: bool,
}

/// Splats to be put together.
#[derive(Clone, Copy, Debug)]
pub struct Splats<'a> {
    /// What the footprints are.
    pub kind: Kind,
    /// The footprints, by number.
    pub footprints: &'a [Words],
    /// Vectors that each splat carries, `n_payloads` of them behind one another.
    pub payloads: &'a [[f32; 4]],
    /// Vectors of a splat.
    pub n_payloads: usize,
    /// Distances along the viewing axis, in units of footprints, behind which nothing is seen, by pixel; 0 where there is
    /// no end.
    /// Empty where there is none at all.
    pub surface: &'a [f32],
}
