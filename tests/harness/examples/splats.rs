//! Prints how far pictures of splats are from those of the samples they stand for, by number of splats
//! and by mode of drawing, and how many splats each mode takes for one error:
//! `splats [CLOUD...]`; without a cloud, of a body like a torso.

#![allow(clippy::print_stdout, reason = "a program that prints tables")]

use anyhow::Result;
use surfelshop_cloud::{Cloud, ReadOptions, read};
use surfelshop_tests::splats::{Bench, MODES, Quality, splats, torso};

/// Tolerances, shares of the diagonal; from one to the next there are about twice as many splats.
const TOLERANCES: [f64; 12] =
    [2e-2, 1e-2, 5e-3, 2.5e-3, 1.2e-3, 6e-4, 3e-4, 1.5e-4, 7e-5, 3e-5, 1.5e-5, 7e-6];

/// Pictures' width and height, and paths of a pixel of the reference.
const SIZE: u32 = 512;
const PATHS: u32 = 16;

/// Samples of the torso.
const SAMPLES: usize = 350_000;

fn main() -> Result<()> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    if files.is_empty() {
        return measure("torso", torso(SAMPLES));
    }
    for file in files {
        let name = file.rsplit('/').next().unwrap_or(&file).to_owned();
        measure(&name, read(&file, &ReadOptions::default())?.cloud)?;
    }
    Ok(())
}

/// A set of splats with the quality of each mode.
struct Row {
    n: usize,
    modes: [Quality; MODES.len()],
}

fn measure(name: &str, samples: Cloud) -> Result<()> {
    let n_samples = samples.len();
    let facts = samples.facts();
    let diagonal = (facts.bounds_max - facts.bounds_min).length();
    let mut bench = Bench::new(samples.clone(), SIZE, PATHS)?;
    println!("## {name}: {n_samples} samples, {}\n", bench.engine.gpu().describe());
    let noise = bench.traced(0).standard_error();
    println!("reference: {PATHS} paths a pixel, standard error {noise:.5}\n");
    let own = MODES.map(|mode| bench.quality(&samples, mode));
    for (mode, quality) in MODES.iter().zip(own) {
        let Quality { flip, normal_degrees } = quality?;
        println!("the samples themselves, {mode}: FLIP {flip:.4}, normals {normal_degrees:.2}");
    }
    println!();
    println!(
        "| tolerance | splats | s | FLIP: {} | normals, degrees: {} | holes |",
        MODES.join(", "),
        MODES.join(", ")
    );
    println!("|---|---|---|---|---|---|");
    let mut rows = Vec::new();
    for tolerance in TOLERANCES {
        let made = splats(&samples, tolerance)?;
        let mut modes = [Quality::default(); MODES.len()];
        for (quality, mode) in modes.iter_mut().zip(MODES) {
            *quality = bench.quality(&made.cloud, mode)?;
        }
        let list = |of: fn(&Quality) -> f64, digits: usize| {
            modes.iter().map(|q| format!("{:.digits$}", of(q))).collect::<Vec<_>>().join(", ")
        };
        let holes = bench.holes(&made.cloud, tolerance * diagonal)?;
        println!(
            "| {tolerance:.1e} | {} | {:.1} | {} | {} | {holes} |",
            made.cloud.len(),
            made.seconds,
            list(|q| q.flip, 4),
            list(|q| q.normal_degrees, 2),
        );
        rows.push(Row { n: made.cloud.len(), modes });
        if made.cloud.len() * 2 > n_samples {
            break;
        }
    }
    println!();
    told("FLIP", &rows, |quality| quality.flip);
    told("normals", &rows, |quality| quality.normal_degrees);
    Ok(())
}

/// Prints how many splats the other modes take for the error of the first.
fn told(what: &str, rows: &[Row], of: fn(&Quality) -> f64) {
    println!("| {what} | {} |", MODES.map(|mode| format!("{mode}, splats")).join(" | "));
    println!("|---|{}", "---|".repeat(MODES.len()));
    for row in rows {
        let error = of(&row.modes[0]);
        let counts: Vec<String> = (0..MODES.len())
            .map(|mode| match count_at(rows, mode, of, error) {
                Some(n) => format!("{n:.0} ({:.1} x)", n / row.n as f64),
                None => "-".to_owned(),
            })
            .collect();
        println!("| {error:.4} | {} |", counts.join(" | "));
    }
    println!();
}

/// The number of splats at which a mode has an error, between the rows around it, on a scale of powers;
/// `None` where no row has so small a one.
fn count_at(rows: &[Row], mode: usize, of: fn(&Quality) -> f64, error: f64) -> Option<f64> {
    let at = |row: &Row| (row.n as f64, of(&row.modes[mode]));
    rows.windows(2).find_map(|pair| {
        let ((n, before), (m, after)) = (at(&pair[0]), at(&pair[1]));
        let share = (before / error).ln() / (before / after).ln();
        (before >= error && after <= error && share.is_finite()).then(|| n * (m / n).powf(share))
    })
}
