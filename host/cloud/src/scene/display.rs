//! How the picture of a scene is shown: its tone map and its background.

/// How brightness above white is brought down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneMap {
    /// Cut off.
    #[default]
    Clamp,
    /// Compressed and desaturated (Khronos PBR Neutral).
    Neutral,
}

/// What stands where no surfel is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Backdrop {
    /// Nothing.
    #[default]
    Transparent,
    /// A colour, linear Rec. 709 in [0, 1]; neither exposed nor tone-mapped.
    Color([f32; 3]),
}
