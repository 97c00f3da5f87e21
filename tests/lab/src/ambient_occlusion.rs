//! Prints how far ambient occlusion from points is from rays against triangles, by method and
//! setting, with what it costs: `ambient_occlusion [MESH...] [--out FOLDER]`; and how the cost of
//! the default grows with the number of surfels: `ambient_occlusion --growth`.
//!
//! Scenes are the meshes, at their vertices and with four times fewer surfels (or, of a mesh with
//! fewer than 50,000 vertices, with 87,183), and two that the program makes: an open sheet with
//! objects on it and a closed room. Runs of one scene are taken in turns, and medians shown. With a
//! folder, the table of each scene goes there as CSV with a plot.

use anyhow::{Context as _, Result};
use plotters::prelude::*;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use surfelshop_tests::occlusion::{Baked, Mesh, Truth, bake, blob, room, sheet, truth, values};

/// Rays of each of the truth's two runs.
const TRUTH_RAYS: u32 = 2048;

/// Surfels of the thesis's model.
const MANNEQUIN: usize = 87_183;

/// Settings of each method, cheapest first.
const SETTINGS: [&str; 22] = [
    "method=hybrid tolerance=0.08",
    "method=hybrid tolerance=0.02",
    "method=hybrid",
    "method=hybrid tolerance=0.001",
    "method=hybrid tolerance=0.0002",
    "method=octree tolerance=0.08",
    "method=octree tolerance=0.02",
    "method=octree",
    "method=octree tolerance=0.001",
    "method=octree tolerance=0.0002",
    "method=octree passes=1",
    "method=octree passes=3",
    "method=octree cast-from=front",
    "method=octree cone=true",
    "method=rays rays=4",
    "method=rays rays=16",
    "method=rays rays=64",
    "method=rays rays=256",
    "method=rays rays=1024",
    "method=brute-force",
    "method=brute-force passes=1",
    "method=brute-force cast-from=front",
];

/// Runs of each setting whose first took less than this many CPU seconds.
const CHEAP: f64 = 4.0;
const RUNS: usize = 3;

/// How far accessibility is from what it should be.
#[derive(Clone, Copy)]
struct Errors {
    rms: f64,
    bias: f64,
    max: f64,
    /// Root mean square without the worst hundredth.
    trimmed: f64,
}

impl Errors {
    fn of(ao: &[f32], expected: &[f32], used: &[bool]) -> Self {
        let pairs = ao.iter().zip(expected).zip(used).filter(|&(_, &used)| used);
        let mut errors: Vec<f64> = pairs.map(|((&a, &b), _)| f64::from(a) - f64::from(b)).collect();
        let mean = |errors: &[f64], of: fn(f64) -> f64| {
            errors.iter().map(|&error| of(error)).sum::<f64>() / errors.len().max(1) as f64
        };
        let (rms, bias) = (mean(&errors, |e| e * e).sqrt(), mean(&errors, |e| e));
        errors.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        let max = errors.last().map_or(0.0, |error| error.abs());
        errors.truncate(errors.len() * 99 / 100);
        Self { rms, bias, max, trimmed: mean(&errors, |e| e * e).sqrt() }
    }
}

/// A setting's medians and errors.
struct Row {
    settings: &'static str,
    cpu: f64,
    spread: f64,
    wall: f64,
    truth: Errors,
    pairs: Errors,
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut all: Vec<f64> = values.collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(f64::NAN)
}

pub(crate) fn run() -> Result<()> {
    let mut arguments: Vec<String> = std::env::args().skip(2).collect();
    if arguments.first().is_some_and(|argument| argument == "--growth") {
        return growth();
    }
    let folder = match arguments.iter().position(|argument| argument == "--out") {
        Some(at) if at + 1 < arguments.len() => {
            let folder = PathBuf::from(arguments.remove(at + 1));
            arguments.remove(at);
            std::fs::create_dir_all(&folder)?;
            Some(folder)
        }
        _ => None,
    };
    for file in &arguments {
        let cloud = surfelshop_cloud::read(file, &Default::default())?.cloud;
        let mesh = Mesh::of(&cloud);
        anyhow::ensure!(!mesh.faces.is_empty(), "{file}: expected triangles, found none");
        let name = Path::new(file).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let small = mesh.positions.len() < 50_000;
        let other = if small { MANNEQUIN } else { mesh.positions.len() / 4 };
        compare(&name, &mesh, folder.as_deref())?;
        compare(&name, &mesh.resampled(other), folder.as_deref())?;
    }
    for count in [10_000, 40_000] {
        compare("sheet", &sheet(count), folder.as_deref())?;
        compare("room", &room(count), folder.as_deref())?;
    }
    Ok(())
}

/// Bakes a scene with every setting, and tells.
fn compare(name: &str, mesh: &Mesh, folder: Option<&Path>) -> Result<()> {
    let (cloud, used) = (mesh.cloud(), mesh.is_used());
    let truth = truth(mesh, TRUTH_RAYS, 1.0);
    println!("\n## {name}, {} surfels\n", cloud.len());
    describe(mesh, &truth);
    let mut runs: Vec<Vec<Baked>> = SETTINGS.iter().map(|_| Vec::new()).collect();
    for _ in 0..RUNS {
        for (settings, runs) in SETTINGS.iter().zip(&mut runs) {
            if runs.first().is_none_or(|first| first.cpu < CHEAP) {
                let baked = bake(&cloud.view(), &values(settings));
                runs.push(baked.map_err(anyhow::Error::msg).with_context(|| *settings)?);
            }
        }
    }
    let pairs = |side: &str| SETTINGS.iter().position(|settings| *settings == side);
    let of = |at: Option<usize>| at.map_or(&[][..], |at| &runs[at][0].ao);
    let rows: Vec<Row> = SETTINGS
        .iter()
        .zip(&runs)
        .map(|(settings, all)| {
            // The octree is held to all pairs with the same options.
            let same = if settings.contains("front") {
                pairs("method=brute-force cast-from=front")
            } else if settings.contains("passes=1") {
                pairs("method=brute-force passes=1")
            } else {
                pairs("method=brute-force")
            };
            let [low, high] = [f64::min, f64::max]
                .map(|pick| all.iter().map(|run| run.cpu).reduce(pick).unwrap_or(f64::NAN));
            Row {
                settings,
                cpu: median(all.iter().map(|run| run.cpu)),
                spread: high - low,
                wall: median(all.iter().map(|run| run.wall)),
                truth: Errors::of(&all[0].ao, &truth.ao, &used),
                pairs: Errors::of(&all[0].ao, of(same), &used),
            }
        })
        .collect();
    tell(&rows);
    if let Some(folder) = folder {
        let stem = folder.join(format!("{name}-{}", cloud.len()));
        write_csv(&stem.with_extension("csv"), &rows)?;
        plot(&stem.with_extension("svg"), &format!("{name}, {} surfels", cloud.len()), &rows)?;
    }
    Ok(())
}

/// What the truth is worth.
fn describe(mesh: &Mesh, truth: &Truth) {
    // Every n-th surfel tells as much about the offset as all.
    let step = mesh.positions.len().div_ceil(4000);
    let some = |all: &[glam::Vec3]| all.iter().step_by(step).copied().collect();
    let part =
        Mesh { positions: some(&mesh.positions), normals: some(&mesh.normals), ..mesh.clone() };
    let offset = |factor| {
        let moved = surfelshop_tests::occlusion::truth(&part, TRUTH_RAYS, factor).ao;
        let usual: Vec<f32> = truth.ao.iter().step_by(step).copied().collect();
        Errors::of(&moved, &usual, &vec![true; moved.len()]).rms
    };
    let count = truth.ao.len().max(1) as f64;
    let mean = truth.ao.iter().map(|&ao| f64::from(ao)).sum::<f64>() / count;
    let squares = truth.ao.iter().map(|&ao| (f64::from(ao) - mean).powi(2)).sum::<f64>();
    println!(
        "truth: 2 x {TRUTH_RAYS} rays, mean {mean:.4}, deviation {:.4}, noise of the mean {:.4}; \
         rays that start 10 times lower or higher move it by {:.4} and {:.4}\n",
        (squares / count).sqrt(),
        truth.noise,
        offset(0.1),
        offset(10.0)
    );
}

fn tell(rows: &[Row]) {
    println!(
        "| settings | CPU s | spread | wall s | RMSE | bias | max | without the worst 1 % | to all pairs: RMSE | bias | max |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for Row { settings, cpu, spread, wall, truth, pairs } in rows {
        println!(
            "| {settings} | {cpu:.3} | {spread:.3} | {wall:.3} | {:.4} | {:+.4} | {:.3} | {:.4} | {:.4} | {:+.4} | {:.3} |",
            truth.rms, truth.bias, truth.max, truth.trimmed, pairs.rms, pairs.bias, pairs.max
        );
    }
}

fn write_csv(path: &Path, rows: &[Row]) -> Result<()> {
    let mut file = std::fs::File::create(path)?;
    writeln!(
        file,
        "settings,cpu_s,cpu_spread_s,wall_s,rmse,bias,max,rmse_trimmed,pairs_rmse,pairs_bias,pairs_max"
    )?;
    for Row { settings, cpu, spread, wall, truth, pairs } in rows {
        writeln!(
            file,
            "{settings},{cpu},{spread},{wall},{},{},{},{},{},{},{}",
            truth.rms, truth.bias, truth.max, truth.trimmed, pairs.rms, pairs.bias, pairs.max
        )?;
    }
    Ok(())
}

/// Error against CPU time, both logarithmic, a line a method.
fn plot(path: &Path, title: &str, rows: &[Row]) -> Result<()> {
    let root = SVGBackend::new(path, (900, 600)).into_drawing_area();
    root.fill(&WHITE)?;
    let range = |of: fn(&Row) -> f64| {
        let values = rows.iter().map(of).filter(|value| *value > 0.0);
        let (low, high) = values.fold((f64::MAX, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
        (0.7 * low..1.4 * high).log_scale()
    };
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(60)
        .build_cartesian_2d(range(|row| row.cpu), range(|row| row.truth.rms))?;
    chart
        .configure_mesh()
        .x_desc("CPU seconds")
        .y_desc("RMSE to rays against triangles")
        .light_line_style(TRANSPARENT)
        .y_label_formatter(&|value| format!("{value:.4}"))
        .draw()?;
    let methods = ["method=hybrid", "method=octree", "method=rays", "method=brute-force"];
    for (method, color) in methods.iter().zip([RED, BLUE, BLACK, GREEN]) {
        // A line joins what differs in quality alone.
        let is_knob = |row: &&Row| {
            let words: Vec<&str> = row.settings.split(' ').collect();
            words[0] == *method
                && words[1..].iter().all(|word| word.starts_with("tol") || word.starts_with("rays"))
        };
        let points: Vec<(f64, f64)> =
            rows.iter().filter(is_knob).map(|row| (row.cpu, row.truth.rms)).collect();
        chart
            .draw_series(LineSeries::new(points.clone(), color.stroke_width(2)))?
            .label(method.trim_start_matches("method="))
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color));
        chart.draw_series(points.iter().map(|&at| Circle::new(at, 4, color.filled())))?;
    }
    chart.configure_series_labels().border_style(BLACK).background_style(WHITE).draw()?;
    root.present()?;
    Ok(())
}

/// CPU time of the default from ten thousand to three million surfels of a closed body, and all
/// pairs as far as they go.
fn growth() -> Result<()> {
    println!("| surfels | hybrid CPU s | octree CPU s | us a surfel | all pairs CPU s | ratio |");
    println!("|---|---|---|---|---|---|");
    let mut logs = Vec::new();
    let mut pair = f64::NAN;
    for count in [10_000, 30_000, 100_000, 300_000, 1_000_000, 3_000_000] {
        let cloud = blob(count).cloud();
        let cpu = |settings: &str| -> Result<f64> {
            let runs = if count > 300_000 { 1 } else { RUNS };
            let once = || bake(&cloud.view(), &values(settings)).map_err(anyhow::Error::msg);
            let all: Vec<Baked> = (0..runs).map(|_| once()).collect::<Result<_>>()?;
            Ok(median(all.iter().map(|run| run.cpu)))
        };
        let [hybrid, octree] = [cpu("method=hybrid")?, cpu("method=octree")?];
        logs.push(((count as f64).ln(), hybrid.ln()));
        let squared = (count as f64).powi(2);
        let measured = count <= 100_000;
        if measured {
            pair = cpu("method=brute-force")? / squared;
        }
        let (pairs, mark) = (pair * squared, if measured { "" } else { " (extrapolated)" });
        println!(
            "| {count} | {hybrid:.2} | {octree:.2} | {:.2} | {pairs:.1}{mark} | {:.0} |",
            1e6 * hybrid / count as f64,
            pairs / octree
        );
    }
    // The slope of the least-squares line through the logarithms.
    let n = logs.len() as f64;
    let (x, y) = logs.iter().fold((0.0, 0.0), |(x, y), (a, b)| (x + a / n, y + b / n));
    let (above, below) = logs.iter().fold((0.0, 0.0), |(above, below), (a, b)| {
        (above + (a - x) * (b - y), below + (a - x).powi(2))
    });
    println!("\nfitted exponent of the default: {:.2}", above / below);
    Ok(())
}
