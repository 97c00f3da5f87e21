//! Prints how far pictures of splats are from those of the samples they stand for, by number of splats
//! and by mode of drawing, and how many splats each mode takes for one error:
//! `splats [CLOUD...]`; without a cloud, of a body like a torso.

use anyhow::Result;
use surfelshop_cloud::{Cloud, ReadOptions, read};
use surfelshop_tests::splats::{Bench, MODES, Quality, bytes_each, splats, torso};

/// Tolerances, shares of the diagonal; from one to the next there are about twice as many splats.
const TOLERANCES: [f64; 12] =
    [2e-2, 1e-2, 5e-3, 2.5e-3, 1.2e-3, 6e-4, 3e-4, 1.5e-4, 7e-5, 3e-5, 1.5e-5, 7e-6];

/// Pictures' width and height, and paths of a pixel of the reference.
const SIZE: u32 = 512;
const PATHS: u32 = 16;

/// Samples of the torso.
const SAMPLES: usize = 350_000;

pub(crate) fn run() -> Result<()> {
    let files: Vec<String> = std::env::args().skip(2).collect();
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
    cloud: Cloud,
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
        rows.push(Row { n: made.cloud.len(), cloud: made.cloud, modes });
        if rows.last().is_some_and(|row| row.n * 2 > n_samples) {
            break;
        }
    }
    println!();
    told("FLIP", &rows, |quality| quality.flip);
    told("normals", &rows, |quality| quality.normal_degrees);
    memory(&samples, &rows)?;
    speed(&samples, &rows)
}

/// Prints what surfels and splats take where they are drawn.
fn memory(samples: &Cloud, rows: &[Row]) -> Result<()> {
    println!("| drawn | bytes each |\n|---|---|");
    let told = |name: &str, cloud: &Cloud, mode: &str| -> Result<()> {
        println!("| {name} | {:.1} |", bytes_each(cloud, mode)?);
        Ok(())
    };
    told("samples, averaged", samples, "averaged")?;
    if let Some(row) = rows.last() {
        told("splats, averaged", &row.cloud, "averaged")?;
        told("splats, phong", &row.cloud, "phong")?;
    }
    println!();
    Ok(())
}

/// Sizes of pictures that are timed, and frames of each kind.
const TIMED: [u32; 3] = [256, 512, 1024];
const FRAMES: usize = 15;

/// Which of the sets of splats has an error of the first mode that others can reach: about a thousand.
const EQUAL: usize = 1000;

/// Prints what frames take: of one set of splats in all modes beside `ewa-phong`, and of sets that look
/// as good in the mode they are for.
fn speed(samples: &Cloud, rows: &[Row]) -> Result<()> {
    let Some(few) = rows.iter().position(|row| row.n >= EQUAL) else { return Ok(()) };
    println!(
        "| size | set | splats | FLIP | ms, quartiles | splats/s | over phong |\n|---|---|---|---|---|---|---|"
    );
    for size in TIMED {
        let mut bench = Bench::new(samples.clone(), size, PATHS)?;
        let error = bench.quality(&rows[few].cloud, "phong")?.flip;
        let mut kinds = vec![("phong, equal", &rows[few].cloud, "phong", error)];
        for mode in ["blended", "flat"] {
            for row in &rows[few..] {
                let own = bench.quality(&row.cloud, mode)?.flip;
                let is_last = row.n == rows[rows.len() - 1].n;
                if own <= error || is_last {
                    kinds.push((mode, &row.cloud, mode, own));
                    break;
                }
            }
        }
        let many = &rows[rows.len() - 1].cloud;
        for mode in ["phong", "averaged", "ewa-phong"] {
            kinds.push((mode, many, mode, f64::NAN));
        }
        kinds.push(("samples, ewa-phong", samples, "ewa-phong", f64::NAN));
        let mut times = vec![Vec::new(); kinds.len()];
        for frame in 0..=FRAMES {
            for (times, (_, cloud, mode, _)) in times.iter_mut().zip(&kinds) {
                let took = bench.time(cloud, mode)?;
                // The first brings columns along.
                if frame > 0 {
                    times.push(took);
                }
            }
        }
        let quartiles = |times: &mut Vec<f64>| {
            times.sort_by(f64::total_cmp);
            [1, 2, 3].map(|quarter| times[quarter * times.len() / 4])
        };
        let quartiles: Vec<[f64; 3]> = times.iter_mut().map(quartiles).collect();
        for ((name, cloud, _, flip), [low, ms, high]) in kinds.iter().zip(&quartiles) {
            println!(
                "| {size} | {name} | {} | {flip:.4} | {ms:.1} ({low:.1} to {high:.1}) | {:.2} M | {:.2} |",
                cloud.len(),
                cloud.len() as f64 / ms / 1e3,
                ms / quartiles[0][1],
            );
        }
    }
    println!();
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
