//! Makes the sample clouds in `assets/`.
//!
//! `cargo run --release --package surfelshop-assets` writes them again, bit for bit the same on
//! every machine: only correctly rounded arithmetic is used (see [`portable`]), and parallel work
//! is collected in a fixed order.

pub mod field;
pub mod figure;
pub mod grid;
pub mod ground;
pub mod mushroom;
pub mod noise;
mod ply;
pub mod portable;
pub mod sample;
pub mod snail;

use rayon::prelude::*;

use crate::figure::Figure;
use crate::ply::Surfel;
use crate::sample::Sample;

/// The sample cloud as the bytes of `assets/sample.ply`.
#[must_use]
pub fn sample_cloud() -> Vec<u8> {
    let figure = figure::snail_on_mushroom();
    let samples = sample::sample(&figure);
    let surfels: Vec<_> =
        samples.par_iter().map(|(sample, radius)| surfel(&figure, sample, *radius)).collect();
    ply::encode(&surfels)
}

/// Paints a sample; folds are a little darker, since dirt gathers there.
fn surfel(figure: &Figure, sample: &Sample, radius: f64) -> Surfel {
    let painted = figure.part_at(sample.position).paint(sample.position, sample.normal);
    let tinted = painted * (1.0 - 0.28 * sample::cavity(figure, sample));
    Surfel {
        position: sample.position.as_vec3(),
        normal: sample.normal.as_vec3(),
        radius: radius as f32,
        color: tinted.to_array().map(|channel| (channel.clamp(0.0, 1.0) * 255.0).round() as u8),
    }
}
