//! Prints what patterns are worth: how far they are from their twins in f64 on each driver, from 256
//! samples a pixel at five distances, and noise from a volume beside computed noise, error against
//! time and memory: `procedural [twins] [filter] [noise]`, all of them where none is named.

use anyhow::Result;
use glam::DVec3;
use std::collections::BTreeMap;
use std::time::Instant;
use surfelshop_api::ObjectFrame;
use surfelshop_api::params::{Value, Values};
use surfelshop_render::{Backend, GpuOptions, PassReport, PassState};
use surfelshop_tests::procedural::patterns::{ALL, Settings};
use surfelshop_tests::procedural::plane::{PERIODIC, PatternView, Plane, SUM, rmse, unlit};
use surfelshop_tests::procedural::{Bench, places};

pub(crate) fn run() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(2).collect();
    let wanted = |name: &str| arguments.is_empty() || arguments.iter().any(|a| a == name);
    if wanted("twins") {
        twins()?;
    }
    if wanted("filter") {
        filter()?;
    }
    if wanted("noise") {
        noise()?;
    }
    Ok(())
}

fn twins() -> Result<()> {
    let benches = [Backend::Primary, Backend::Gl];
    let mut benches = benches
        .map(|backend| Bench::new(&GpuOptions { backend: Some(backend), ..GpuOptions::default() }));
    println!("Largest differences of albedo, 20,000 places, frequency 11.3, 9 octaves:\n");
    println!("| pattern | {} - f64 | {} - f64 | apart |", benches[0].device(), benches[1].device());
    println!("|---|---|---|---|");
    let settings = Settings { frequency: 11.3, octaves: 9, seed: 5, ..Settings::default() };
    let spots = places::spots(20_000, 2.0, 0.3, 1);
    let object = ObjectFrame { size: 2.0, ..ObjectFrame::default() };
    for pattern in ALL {
        let values = settings.values(pattern);
        let mut colors = Vec::new();
        for bench in &mut benches {
            let found = bench.colors(&spots, DVec3::ZERO, object, &values);
            colors.push(found.map_err(|fault| anyhow::anyhow!("{fault}"))?);
        }
        let exact: Vec<DVec3> = spots
            .iter()
            .map(|spot| {
                let at = spot.place(DVec3::ZERO, &object, true);
                settings.look(pattern, &at, spot.albedo.as_dvec3()).albedo
            })
            .collect();
        let largest = |a: &[DVec3], b: &[DVec3]| {
            let apart = a.iter().zip(b).map(|(a, b)| (*a - *b).abs().max_element());
            apart.fold(0.0, f64::max)
        };
        println!(
            "| {pattern} | {:.1e} | {:.1e} | {:.1e} |",
            largest(&colors[0], &exact),
            largest(&colors[1], &exact),
            largest(&colors[0], &colors[1])
        );
    }
    println!();
    Ok(())
}

fn with(values: &Values, more: &[(&str, Value)]) -> Values {
    let more = more.iter().map(|(id, value)| ((*id).to_owned(), value.clone()));
    values.clone().into_iter().chain(more).collect()
}

fn filter() -> Result<()> {
    let mut plane = Plane::new();
    println!("RMSE of albedo against 256 samples a pixel, filtered / at the pixel's centre:\n");
    println!("| pattern | tilt | 1 | 4 | 16 | 64 | 256 |\n|---|---|---|---|---|---|---|");
    for pattern in ALL {
        let values = unlit(&Settings::default(), pattern, 4.0);
        let points = with(&values, &[("filter", Value::Bool(false))]);
        for tilt in [0.0, 1.2] {
            print!("| {pattern} | {tilt} |");
            for distance in [1.0, 4.0, 16.0, 64.0, 256.0] {
                let sight = PatternView { distance, tilt, size: 96 };
                let truth = plane.truth(sight, &values)?;
                let filtered = rmse(&plane.picture(sight, &values)?.pixels, &truth);
                let points = rmse(&plane.picture(sight, &points)?.pixels, &truth);
                print!(" {filtered:.4} / {points:.4} = {:.2} |", filtered / points);
            }
            println!();
        }
    }
    println!(
        "\nMean change from frame to frame while the distance grows by 0.5 % each, from 256:\n"
    );
    println!("| pattern | filtered | at the centre | 256 samples |\n|---|---|---|---|");
    for pattern in ALL {
        let values = unlit(&Settings::default(), pattern, 4.0);
        let points = with(&values, &[("filter", Value::Bool(false))]);
        let mut frames = [const { Vec::new() }; 3];
        for i in 0..6 {
            let distance = 256.0 * 1.005f64.powi(i);
            let sight = PatternView { distance, tilt: 0.6, size: 64 };
            frames[0].push(plane.picture(sight, &values)?.pixels);
            frames[1].push(plane.picture(sight, &points)?.pixels);
            frames[2].push(plane.truth(sight, &values)?);
        }
        let change = frames.map(|frames| {
            frames.windows(2).map(|pair| rmse(&pair[0], &pair[1])).sum::<f64>() / 5.0
        });
        println!("| {pattern} | {:.5} | {:.5} | {:.5} |", change[0], change[1], change[2]);
    }
    println!();
    Ok(())
}

/// Milliseconds of the passes whose names begin so.
fn milliseconds(passes: &[PassReport], name: &str) -> f64 {
    let ran = passes.iter().filter(|pass| pass.state == PassState::Ran);
    ran.filter(|pass| pass.name.starts_with(name)).filter_map(|pass| pass.gpu_ms).sum()
}

/// A source of noise that is measured.
struct Source {
    name: String,
    values: Values,
    bytes: u64,
    fill: f64,
    errors: Vec<f64>,
    times: Vec<f64>,
}

const SIZES: [i64; 4] = [32, 64, 128, 256];
const DISTANCES: [f64; 4] = [0.25, 4.0, 16.0, 64.0];
const ROUNDS: usize = 9;

fn noise() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let file = |name: &str, text: &str| -> Result<Value> {
        let path = folder.path().join(name);
        std::fs::write(&path, text)?;
        Ok(Value::Text(path.display().to_string()))
    };
    let (sum, periodic) = (file("sum.wgsl", SUM)?, file("periodic.wgsl", PERIODIC)?);
    let mut plane = Plane::new();
    println!(
        "{}: a sum of octaves in 512 x 512 pixels, all covered; RMSE of",
        plane.engine.gpu().describe()
    );
    println!(
        "0.5 + sum / 2 (deviation 0.125) against 256 samples a pixel at distances {DISTANCES:?},"
    );
    println!("medians of {ROUNDS} interleaved rounds:\n");
    println!("| octaves | noise | memory | filled in | errors | pass | over computed |");
    println!("|---|---|---|---|---|---|---|");
    for octaves in [1, 2, 4, 6, 8] {
        let settings = Settings { octaves, ..Settings::default() };
        let base = with(&unlit(&settings, "simple-marble", 4.0), &[("file", sum.clone())]);
        let mut sources = vec![Source::new("computed", base.clone(), 0)];
        for size in SIZES {
            let volume =
                [("noise", Value::Text("volume".to_owned())), ("volume-size", Value::Int(size))];
            let bytes = (0..=size.ilog2()).map(|level| 8 * (size as u64 >> level).pow(3)).sum();
            sources.push(Source::new(&format!("volume {size}"), with(&base, &volume), bytes));
        }
        for distance in DISTANCES {
            let sight = PatternView { distance, tilt: 0.0, size: 64 };
            let truths = [
                plane.truth(sight, &base)?,
                plane.truth(sight, &with(&base, &[("file", periodic.clone())]))?,
            ];
            for (i, source) in sources.iter_mut().enumerate() {
                let started = Instant::now();
                let picture = plane.picture(sight, &source.values)?;
                let first = started.elapsed().as_secs_f64();
                if milliseconds(&picture.passes, "noise volume") > 0.0 {
                    // Drawn once more without it.
                    let started = Instant::now();
                    plane.picture(sight, &source.values)?;
                    source.fill = 1e3 * (first - started.elapsed().as_secs_f64());
                }
                source.errors.push(rmse(&picture.pixels, &truths[usize::from(i > 0)]));
            }
        }
        for round in 0..ROUNDS {
            for source in &mut sources {
                let distance = 4.0 + 1e-6 * round as f64;
                let sight = PatternView { distance, tilt: 0.0, size: 512 };
                let picture = plane.picture(sight, &source.values)?;
                source.times.push(milliseconds(&picture.passes, "procedural"));
            }
        }
        print_sources(octaves, &sources);
    }
    Ok(())
}

impl Source {
    fn new(name: &str, values: Values, bytes: u64) -> Self {
        let (name, errors, times) = (name.to_owned(), Vec::new(), Vec::new());
        Self { name, values, bytes, fill: 0.0, errors, times }
    }
}

fn print_sources(octaves: u32, sources: &[Source]) {
    let median = |values: &[f64]| {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
    };
    let computed: BTreeMap<usize, f64> =
        sources.first().map(|s| s.times.iter().copied().enumerate().collect()).unwrap_or_default();
    for source in sources {
        let ratios: Vec<f64> =
            source.times.iter().enumerate().map(|(i, time)| time / computed[&i]).collect();
        let errors: Vec<String> = source.errors.iter().map(|e| format!("{e:.4}")).collect();
        println!(
            "| {octaves} | {} | {:.1} MB | {:.0} ms | {} | {:.1} ms | {:.2} |",
            source.name,
            source.bytes as f64 / 1e6,
            source.fill,
            errors.join(", "),
            median(&source.times),
            median(&ratios)
        );
    }
}
