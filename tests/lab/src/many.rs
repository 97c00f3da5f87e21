//! Renders millions of surfels in chunks of two sizes, compares the pictures bit by bit, and
//! measures memory: `many [MILLIONS]`.
//!
//! Each chunk size is drawn in a process of its own, and so is a cloud of one surfel, whose peak of
//! memory is what program, driver and pictures take. On a software driver the device's memory is
//! the process's, so that the peak counts every copy there is of the columns.

use anyhow::{Context as _, Result, ensure};
use glam::DVec3;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;
use surfelshop_api::Scene;
use surfelshop_api::graph::Output;
use surfelshop_render::{EngineOptions, GpuOptions, PassState};
use surfelshop_tests::clouds::{WAVY_BYTES, wavy_sphere};
use surfelshop_tests::measure::{Cost, in_child};
use surfelshop_tests::stage;

/// Surfels per chunk: as by default, and a number without a simple relation to it.
const CHUNKS: [u32; 2] = [1 << 20, 700_001];

/// Side of the pictures in pixels.
const SIZE: u32 = 512;

/// The most memory drawing may take, in sizes of the columns.
const MOST_MEMORY: f64 = 2.5;

pub(crate) fn run() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(2).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["draw", n_surfels, chunk, file] => {
            let (n_surfels, chunk) = (n_surfels.parse()?, chunk.parse()?);
            let ((), cost) = Cost::of(|| draw(n_surfels, chunk, file.as_ref()))?;
            println!("{}", cost.to_line());
            Ok(())
        }
        [] => compare(6_000_000),
        [millions] => compare((millions.parse::<f64>()? * 1e6) as usize),
        _ => anyhow::bail!("many [MILLIONS]"),
    }
}

fn compare(n_surfels: usize) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let drawn = |n_surfels: usize, chunk: u32| -> Result<(Vec<u8>, String)> {
        let path = folder.path().join("pictures");
        let file = path.to_str().context("the temporary folder has a name in UTF-8")?;
        let lines = in_child(&["draw", &n_surfels.to_string(), &chunk.to_string(), file])?;
        Ok((std::fs::read(&path)?, lines))
    };
    let (_, one) = drawn(1, CHUNKS[0])?;
    let one = Cost::from_lines(&one)?;
    let columns = (n_surfels * WAVY_BYTES) as f64;
    println!("{n_surfels} surfels, columns of {:.1} MB, {SIZE} x {SIZE} pixels", columns * 1e-6);
    println!("one surfel: {:.1} s, peak {:.1} MB\n", one.wall, one.peak * 1e-6);
    let mut first = None;
    let mut most = 0.0f64;
    for chunk in CHUNKS {
        let (pictures, lines) = drawn(n_surfels, chunk)?;
        let cost = Cost::from_lines(&lines)?;
        let share = (cost.peak - one.peak) / columns;
        println!("{}", lines.split("cost ").next().unwrap_or_default().trim_end());
        println!(
            "\n{:.1} s, peak {:.1} MB; less that of one surfel {share:.2} x the columns\n",
            cost.wall,
            cost.peak * 1e-6
        );
        most = most.max(share);
        let first = first.get_or_insert_with(|| pictures.clone());
        ensure!(*first == pictures, "chunks of {chunk} make another picture");
    }
    println!("The pictures are equal bit by bit.");
    ensure!(most <= MOST_MEMORY, "memory of {most:.2} x the columns, at most {MOST_MEMORY}");
    Ok(())
}

/// Draws the surfels with both renderers and writes the pictures' numbers to a file.
fn draw(n_surfels: usize, chunk: u32, file: &Path) -> Result<()> {
    let cloud = wavy_sphere(n_surfels);
    let options = EngineOptions { chunk_surfels: chunk, ..EngineOptions::default() };
    let mut engine = stage::engine_with(&GpuOptions::default(), &options);
    let view = stage::view(DVec3::new(0.6, 0.8, 2.6), DVec3::ZERO, SIZE);
    let mut pictures = BufWriter::new(File::create(file)?);
    println!("| surfels per chunk | chunks | renderer | pass | ms |");
    println!("|---|---|---|---|---|");
    for (library, unit) in [("surfelshop_ewa_phong", "ewa-phong"), ("surfelshop_flat", "flat")] {
        let mut renderer = stage::built_renderer(&engine, library, unit);
        let outputs = [Output::Color, Output::Depth];
        let scene = Scene::default();
        let frame = stage::render(&mut engine, &mut renderer, &cloud, &scene, view, &outputs)?;
        for pass in frame.passes.iter().filter(|pass| pass.state == PassState::Ran) {
            let ms = pass.gpu_ms.map_or_else(|| "?".to_owned(), |ms| format!("{ms:.1}"));
            let chunks = engine.counters().chunks;
            println!("| {chunk} | {chunks} | {unit} | {} | {ms} |", pass.name);
        }
        let covered = frame.image(&Output::Color).context("a picture")?.data.chunks_exact(4);
        let covered = covered.filter(|pixel| pixel[3] > 0.0).count();
        ensure!(n_surfels == 1 || covered > 50_000, "{unit} covers {covered} pixels only");
        for (_, image) in &frame.images {
            for number in &image.data {
                pictures.write_all(&number.to_le_bytes())?;
            }
        }
    }
    Ok(pictures.flush()?)
}
