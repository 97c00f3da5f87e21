//! Programs that measure the renderer `global-illumination`.

pub(crate) mod error;
pub(crate) mod maps;
pub(crate) mod times;
