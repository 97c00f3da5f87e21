//! # `gltf`: points, triangles and Gaussian splats of glTF scenes
//!
//! | parameter | type   | default   | meaning                                                         |
//! |-----------|--------|-----------|-----------------------------------------------------------------|
//! | `colors`  | choice | `encoded` | what whole numbers in `COLOR_0` are: sRGB (`encoded`) or `linear` |
//!
//! Reads .glb, and .gltf whose buffers are `data:` URIs or files of the same folder (`.bin`, `.glbin`). All points,
//! triangles, strips and fans of the scene become one cloud in world coordinates, each mesh as often as nodes show it;
//! without a scene, every mesh once. Of several scenes it is the one that the file names, or the first.
//!
//! | attribute  | column                                                                          |
//! |------------|---------------------------------------------------------------------------------|
//! | `POSITION` | `position`, f32 where no node moves a mesh, else f64                              |
//! | `NORMAL`   | `normal`; no numbers where only some meshes have any                              |
//! | `COLOR_0`  | `color`, u8 or u16 where all have the same, else linear f32                       |
//! | `_NAME`    | `name`, of its own type; no number, or 0 of whole ones, where a mesh has none      |
//!
//! Colours are multiplied by the base colour of the material, or are that colour where there is no `COLOR_0`.
//! Quantised, normalised and sparse accessors are read. y points up; units are metres.
//!
//! glTF says that colours are linear in whole numbers, too. Some programs, such as trimesh, write sRGB there as it is,
//! which is what such columns hold here; `colors=linear` reads them by the book, as f32.
//!
//! Points of the extension `KHR_gaussian_splatting` are Gaussians: columns `opacity`, `splat_scale`, `splat_rotation`
//! and `sh_0` to `sh_3`, moved, scaled and turned as nodes say, their spherical harmonics, too. Their colours are those
//! of the harmonics, not `COLOR_0` or materials. In a scene with Gaussians all else is left out, since it would be of none.
//! Those that `KHR_gaussian_splatting_compression_spz_2` packs, a draft, are unpacked; those of other such extensions
//! are refused.
//!
//! Not read: textures, lines, skins, morph targets, animations; buffers in other folders; meshes that Draco or
//! meshopt compressed.
//!
//! Source: Khronos Group, "glTF 2.0 Specification" and `KHR_gaussian_splatting`.

mod accessor;
mod attributes;
mod buffers;
mod columns;
mod container;
mod decode;
mod extensions;
mod mesh;
mod names;
mod packed;
mod read;
mod scene;
mod splats;
#[cfg(test)]
mod tests;
mod triangles;
mod values;

use surfelshop_api::Format;
use surfelshop_api::format::{CloudSink, FileSource, FileTypes};
use surfelshop_api::prelude::{HostInfo, Job, Result, UnitInfo, choices, export_plugin, params};

choices! {
    /// What whole numbers in colours are.
    pub enum Colors {
        /// Encoded as sRGB.
        Encoded = "encoded",
        /// Linear, as glTF says.
        Linear = "linear",
    }
}

params! {
    /// Settings of `gltf`.
    pub struct Settings {
        /// What whole numbers in `COLOR_0` are: sRGB, as some programs write them (encoded), or
        /// linear, as glTF says.
        colors: Colors { default: Colors::Encoded },
    }
}

/// The format.
struct Gltf;

impl Format for Gltf {
    const INFO: UnitInfo = UnitInfo::new(
        "gltf",
        "glTF",
        "Reads points, triangles and Gaussian splats of scenes (.glb, .gltf).",
    );
    const FILES: FileTypes = FileTypes::new()
        .ending("glb")
        .ending("gltf")
        .magic(0, b"glTF")
        .beside("*.bin")
        .beside("*.glbin");
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn read(
        &mut self,
        file: &FileSource,
        params: &Settings,
        clouds: &mut CloudSink<'_>,
        job: &Job<'_>,
    ) -> Result<()> {
        read::read(file, params, clouds, job)
    }
}

export_plugin! {
    id: "org.surfelshop.gltf",
    formats: [Gltf],
}
