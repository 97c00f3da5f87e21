//! # Gaussian splats
//!
//! | renderer       | what it draws                                                       |
//! |----------------|---------------------------------------------------------------------|
//! | `gaussians`    | Gaussians in space: 3D Gaussian splatting                           |
//! | `gaussians-2d` | Gaussians in planes, met exactly by rays: 2D Gaussian splatting     |
//!
//! The tool `gaussians` makes a Gaussian of each surfel.
//!
//! | format           | files             | what it reads and writes                                              |
//! |------------------|-------------------|-----------------------------------------------------------------------|
//! | `spz`            | `.spz`            | reads versions 1 to 4 of Niantic's packed Gaussians; writes version 3   |
//! | `splat`          | `.splat`          | reads and writes records of 32 bytes, without spherical harmonics      |
//! | `sog`            | `.sog`            | reads versions 1 and 2 of `PlayCanvas`'s images of Gaussians; writes version 2 |
//! | `compressed-ply` | `.compressed.ply` | reads and writes the packed PLY files of `SuperSplat` and `PlayCanvas`   |
//!
//! Each format's file opens with its rules. All of them hand over the same columns, of `f32`:
//!
//! | column              | numbers    |                                                                      |
//! |---------------------|------------|----------------------------------------------------------------------|
//! | `position`          | 3          | centres                                                              |
//! | `opacity`           | 1          | at the centre, 0 to 1                                                |
//! | `splat_scale`       | 3          | standard deviations along the splat's own axes                       |
//! | `splat_rotation`    | 4          | from its own axes to the cloud's: a unit quaternion x, y, z, w       |
//! | `sh_0` to `sh_3`    | 3, 9, 15, 21 | spherical harmonics, without the Condon-Shortley sign that files have |
//!
//! Sizes and colours that are no numbers become 0 and are counted in a warning. Where a cloud without such columns is
//! written, its radii and colours become round, opaque splats.
//!
//! ```text
//! surfelshop info scene.spz
//! surfelshop convert scene.ply scene.spz
//! ```

mod formats;
mod renderers;
#[cfg(test)]
mod tests;
mod tool;

use surfelshop_api::export_plugin;

export_plugin! {
    id: "org.surfelshop.gaussian-splatting",
    renderers: [renderers::gaussians::Gaussians, renderers::gaussians_2d::Gaussians2d],
    tools: [tool::ToGaussians],
    formats: [formats::Spz, formats::Splat, formats::Sog, formats::CompressedPly],
}
