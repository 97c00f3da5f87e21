//! How large a probe may be.

/// Most texels along a side of a picture.
pub const LARGEST_SIDE: u32 = 16_384;

/// Most texels of a picture: latitude and longitude at the longest side, 1.5 GiB of floats. A file of
/// megabytes can announce as many, so this bounds what an untrusted file takes.
pub const LARGEST_AREA: u64 = 1 << 27;

/// Most pixels for each byte of a file.
///
/// Radiance files hold at most 16 pixels in a byte, as runs of 127; `ZIP` in `OpenEXR`, which makes
/// at best 1032 bytes of one, holds 172 of three half floats.
pub(super) const PIXELS_PER_BYTE: u64 = 256;
