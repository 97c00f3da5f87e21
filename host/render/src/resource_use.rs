//! Textures and buffers as `explain` lists them.

use crate::graph::texels;
use serde::Serialize;

/// A texture or buffer.
#[derive(Clone, Debug, Serialize)]
pub struct ResourceUse {
    /// Its label.
    pub label: String,
    /// Texels and format, or that it is a buffer.
    pub what: String,
    /// Bytes that it takes, or would take.
    pub bytes: u64,
    /// Whether it was made.
    pub made: bool,
    /// Why it was or was not.
    pub why: String,
}

impl ResourceUse {
    /// A texture that the host has.
    pub(crate) fn of(label: &str, texture: &wgpu::Texture, why: &str) -> Self {
        let size = texture.size();
        let (mips, is_volume) = (texture.mip_level_count(), false);
        let texels = texels([size.width, size.height, size.depth_or_array_layers], mips, is_volume);
        Self {
            label: label.to_owned(),
            what: format!("{} x {} {:?}", size.width, size.height, texture.format()),
            bytes: texels * u64::from(texture.format().block_copy_size(None).unwrap_or(4)),
            made: true,
            why: why.to_owned(),
        }
    }

    /// A texture of the host that is not there.
    pub(crate) fn missing(label: &str, why: &str) -> Self {
        let what = "texture".to_owned();
        Self { label: label.to_owned(), what, bytes: 0, made: false, why: why.to_owned() }
    }
}
