//! Prints how far splats with and without lines that cut them are from a mesh at its sharp edges, and
//! writes pictures of both: `splat_edges FOLDER COUNT [MESH]`; without a mesh, of an L-shaped prism.

use anyhow::{Context as _, Result};
use surfelshop_api::graph::Output;
use surfelshop_api::params::Value;
use surfelshop_cloud::{Cloud, ReadOptions, read};
use surfelshop_image::display_transform::{DisplayTransform, develop_to_8_bit};
use surfelshop_tests::splats::{EdgeBench, bake, ell, sampled};
use surfelshop_tests::stage;

/// Tolerances, shares of the diagonal.
const TOLERANCES: [f64; 5] = [8e-3, 4e-3, 2e-3, 1e-3, 5e-4];

pub(crate) fn run() -> Result<()> {
    let mut arguments = std::env::args().skip(2);
    let folder = arguments.next().context("a folder")?;
    let count: usize = arguments.next().context("a number of samples")?.parse()?;
    let mesh: Cloud = match arguments.next() {
        Some(file) => read(&file, &ReadOptions::default())?.cloud,
        None => ell(),
    };
    let samples = sampled(&mesh, count)?;
    let bench = EdgeBench::new(&mesh, 512)?;
    let mut engine = stage::engine();
    let library = "surfelshop-phong-splatting";
    let mut renderer = stage::built_renderer(&engine, library, "phong-splatting");
    let own = bench.off(&samples, &mut engine, &mut renderer)?;
    println!("the {} samples themselves: {own:?}\n", samples.len());
    println!(
        "| tolerance | clip | splats | radiance at edges | normals at edges, degrees | elsewhere | beyond |"
    );
    println!("|---|---|---|---|---|---|---|");
    for tolerance in TOLERANCES {
        for clip in [false, true] {
            let values = [("tolerance", Value::Float(tolerance)), ("clip", Value::Bool(clip))];
            let made = bake(&samples, &values)?;
            let off = bench.off(&made.cloud, &mut engine, &mut renderer)?;
            println!(
                "| {tolerance:.0e} | {clip} | {} | {:.4} | {:.2} | {:.4} | {:.4} |",
                made.cloud.len(),
                off.radiance,
                off.normal_degrees,
                off.elsewhere,
                off.beyond
            );
            for (i, view) in bench.views().iter().enumerate() {
                let cloud = &made.cloud;
                let scene = bench.scene();
                let color = [Output::Color];
                let drawn = stage::render(&mut engine, &mut renderer, cloud, scene, *view, &color)?;
                let picture = drawn.image(&Output::Color).context("no colours")?;
                let bytes = develop_to_8_bit(picture, &DisplayTransform::default());
                let path = format!("{folder}/{i}-{tolerance:.0e}-{clip}.png");
                let [width, height] = view.size_px;
                image::save_buffer(&path, &bytes, width, height, image::ColorType::Rgba8)?;
            }
        }
    }
    Ok(())
}
