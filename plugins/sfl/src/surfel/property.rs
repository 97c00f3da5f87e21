//! Numbers of properties: bits of the property vector.

/// Centre.
pub(crate) const POSITION: usize = 0;
/// Normal.
pub(crate) const NORMAL: usize = 1;
/// Radius.
pub(crate) const RADIUS: usize = 4;
/// Weight.
pub(crate) const WEIGHT: usize = 5;
/// Sampling density.
pub(crate) const DENSITY: usize = 6;
/// Texture coordinates.
pub(crate) const TEXTURE: usize = 7;
/// Ambient colour.
pub(crate) const AMBIENT: usize = 8;
/// Its coefficient.
pub(crate) const AMBIENT_COEFFICIENT: usize = 9;
/// Diffuse colour.
pub(crate) const DIFFUSE: usize = 10;
/// Its coefficient.
pub(crate) const DIFFUSE_COEFFICIENT: usize = 11;
/// Specular colour.
pub(crate) const SPECULAR: usize = 12;
/// Its coefficient.
pub(crate) const SPECULAR_COEFFICIENT: usize = 13;
/// Shininess.
pub(crate) const SHININESS: usize = 14;
/// Two tangents.
pub(crate) const TANGENTS: usize = 24;
/// Flags.
pub(crate) const FLAGS: usize = 27;
/// Isovalue.
pub(crate) const ISOVALUE: usize = 28;
/// Cell of origin.
pub(crate) const ORIGIN_CELL: usize = 29;
/// Depth seen from the camera.
pub(crate) const CAMERA_DEPTH: usize = 30;
/// Number of the camera.
pub(crate) const CAMERA_ID: usize = 31;
/// Pixel of the camera.
pub(crate) const CAMERA_XY: usize = 32;
/// Two angles of the camera. Numbers 33 and 34 are rays, which files hold at places that are wrong.
pub(crate) const CAMERA_ANGLES: usize = 35;
/// Numbers that are known, and one.
pub(crate) const END: usize = 36;
