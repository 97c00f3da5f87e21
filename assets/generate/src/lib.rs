//! Makes the sample cloud, the Cornell box and the sample light probe in `assets/`.
//!
//! `cargo run --release --package surfelshop-assets` writes them again, the clouds bit for bit the same
//! on every machine: only correctly rounded arithmetic is used (see [`portable`]), and parallel work
//! is collected in a fixed order.

pub mod cornell;
pub mod coverage;
pub mod field;
pub mod figure;
pub mod filling;
pub mod grid;
pub mod ground;
pub mod mushroom;
pub mod noise;
pub mod portable;
pub mod sample;
pub mod snail;
pub mod tiles;

use std::path::Path;

use anyhow::Context;
use glam::DVec3;
use rayon::prelude::*;
use surfelshop_api::columns::{COLOR, NORMAL, POSITION, RADIUS};
use surfelshop_cloud::environment_map::Probe;
use surfelshop_cloud::{Buffer, Cloud, CloudError, Column, WriteOptions};

use crate::figure::Figure;
use crate::sample::Sample;

/// Makes the sample cloud and writes it as binary PLY.
///
/// # Errors
/// Where the file cannot be written.
pub fn write_sample(path: &Path) -> anyhow::Result<()> {
    let cloud = sample_cloud().context("the sample is no valid cloud")?;
    let comments = vec!["A snail on a fly agaric, made by surfelshop-assets".to_owned()];
    let options = WriteOptions { comments, ..WriteOptions::default() };
    surfelshop_cloud::write(path, &cloud, &options)?;
    Ok(())
}

/// Writes the built-in sky as a light probe of latitude and longitude, Radiance HDR.
///
/// # Errors
/// Where the file cannot be written.
pub fn write_sky(path: &Path) -> anyhow::Result<()> {
    surfelshop_cloud::environment_map::write_hdr(path, &Probe::sky().picture)?;
    Ok(())
}

/// The sample cloud: positions, normals, radii and sRGB-encoded colours.
///
/// # Errors
/// Where a value is not finite, which would be a fault of the figure.
pub fn sample_cloud() -> Result<Cloud, CloudError> {
    let figure = figure::snail_on_mushroom();
    let samples = sample::sample(&figure);
    let vectors = |vector: fn(&Sample) -> DVec3| {
        let floats = samples.iter().flat_map(|(sample, _)| vector(sample).as_vec3().to_array());
        Buffer::F32(floats.collect())
    };
    let radii = samples.iter().map(|(_, radius)| *radius as f32).collect();
    let colors: Vec<_> = samples.par_iter().map(|(sample, _)| color(&figure, sample)).collect();
    let columns = vec![
        Column::new(POSITION, 3, vectors(|sample| sample.position)),
        Column::new(NORMAL, 3, vectors(|sample| sample.normal)),
        Column::new(RADIUS, 1, Buffer::F32(radii)),
        Column::new(COLOR, 3, Buffer::U8(colors.into_flattened())),
    ];
    Cloud::new(DVec3::ZERO, columns)
}

/// Paints a sample; folds are a little darker, since dirt gathers there.
fn color(figure: &Figure, sample: &Sample) -> [u8; 3] {
    let painted = figure.part_at(sample.position).paint(sample.position, sample.normal);
    let tinted = painted * (1.0 - 0.28 * sample::cavity(figure, sample));
    tinted.to_array().map(|channel| (channel.clamp(0.0, 1.0) * 255.0).round() as u8)
}
