//! Writes pictures of splats in every mode beside the path-traced samples, and of how far their normals
//! are off (white is 30 degrees): `splat_pictures FOLDER TOLERANCE [CLOUD]`.

use anyhow::{Context as _, Result};
use glam::Vec3;
use surfelshop_api::graph::Output;
use surfelshop_cloud::{ReadOptions, read};
use surfelshop_image::Image;
use surfelshop_image::display_transform::{DisplayTransform, develop_to_8_bit};
use surfelshop_tests::splats::{Bench, MODES, splats, torso};

pub(crate) fn run() -> Result<()> {
    let mut arguments = std::env::args().skip(2);
    let folder = arguments.next().context("a folder")?;
    let tolerance: f64 = arguments.next().context("a tolerance")?.parse()?;
    let samples = match arguments.next() {
        Some(file) => read(&file, &ReadOptions::default())?.cloud,
        None => torso(350_000),
    };
    let mut bench = Bench::new(samples.clone(), 512, 4)?;
    let made = splats(&samples, tolerance)?;
    println!("{}", made.told);
    let save = |name: &str, picture: &Image| -> Result<()> {
        let bytes = develop_to_8_bit(picture, &DisplayTransform::default());
        let path = format!("{folder}/{name}.png");
        image::save_buffer(&path, &bytes, picture.width, picture.height, image::ColorType::Rgba8)?;
        Ok(())
    };
    for (i, view) in bench.views().to_vec().into_iter().enumerate() {
        save(&format!("{i}-reference"), &bench.traced(i).color.clone())?;
        let truth = bench.draw(&samples, view, "averaged", &[Output::Normal])?;
        let truth = truth.image(&Output::Normal).context("no normals")?.clone();
        for mode in MODES {
            let drawn = bench.draw(&made.cloud, view, mode, &[Output::Color, Output::Normal])?;
            save(&format!("{i}-{mode}"), drawn.image(&Output::Color).context("no colours")?)?;
            let mut off = drawn.image(&Output::Normal).context("no normals")?.clone();
            for (own, other) in off.data.chunks_exact_mut(4).zip(truth.data.chunks_exact(4)) {
                let angle = Vec3::from_slice(own).angle_between(Vec3::from_slice(other));
                let both = own[3] > 0.0 && other[3] > 0.0;
                own[..3].fill(if both { angle.to_degrees() / 30.0 } else { 0.0 });
                own[3] = 1.0;
            }
            save(&format!("{i}-{mode}-normals"), &off)?;
        }
    }
    Ok(())
}
