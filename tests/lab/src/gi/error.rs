//! Prints how far pictures of `global-illumination` are from traced ones and how long a frame takes: each
//! knob of quality turned alone, frames added up, and what is missing near the edges of a box:
//! `gi_error [PATHS [CLOUD]]`; paths a pixel of the reference, 256 unless given; the Cornell box, or a cloud
//! with normals and radii in the light of a spot.

use anyhow::Result;
use std::collections::BTreeMap;
use surfelshop_assets::cornell::{N_POINTS, cornell_box};
use surfelshop_cloud::{ReadOptions, read};
use surfelshop_image::TracedPicture;
use surfelshop_tests::gi::{Bench, Error, Set, bias, blurred, error, int, less, relative, text};

/// Pixels on a side.
const SIZE: u32 = 192;

/// Reflections where the number of them is not what is turned.
const BOUNCES: u32 = 2;

/// Knobs and their values.
const KNOBS: [(&str, &[u32]); 9] = [
    ("vpls", &[64, 128, 256, 512, 1024]),
    ("ism-size", &[512, 1024, 2048]),
    ("ism-points", &[25_000, 55_200, 200_000]),
    ("pull-push", &[0, 1, 2, 3, 4]),
    ("interleaving", &[1, 2, 4, 8]),
    ("smoothing", &[0, 1, 2]),
    ("compensation", &[0, 4, 8, 24, 64]),
    ("light-map", &[128, 256, 512, 1024]),
    ("bounces", &[1, 2, 3]),
];

/// Frames that are added up.
const FRAMES: [u32; 5] = [1, 4, 16, 64, 256];

/// How near to an edge is near, scene units.
const NEAR: f64 = 0.1;

/// A measured setting.
struct Row {
    name: String,
    error: Error,
    ms: f64,
}

pub(crate) fn run() -> Result<()> {
    let paths = std::env::args().nth(2).map_or(Ok(256), |paths| paths.parse())?;
    let scan = std::env::args().nth(3);
    let mut bench = match &scan {
        Some(path) => Bench::scan(read(path, &ReadOptions::default())?.cloud, SIZE),
        None => Bench::new(cornell_box(N_POINTS)?, SIZE),
    };
    println!("## {} surfels, {SIZE} pixels a side\n", bench.cloud.len());
    let mut references = BTreeMap::new();
    for bounces in 1..=3 {
        let traced = bench.traced("full", bounces, paths)?;
        let [even, odd] = traced.halves.each_ref();
        let all = vec![true; even.data.len() / 4];
        println!(
            "reference, {bounces} bounces: {paths} paths, standard error {:.5}, halves differ by {:+.4}",
            traced.standard_error(),
            bias(even, odd, &all)
        );
        references.insert(bounces, traced);
    }
    println!();
    direct(&mut bench, paths)?;
    knobs(&mut bench, &references)?;
    converged(&mut bench, &references[&BOUNCES])?;
    // A scan has no walls to be near to.
    if scan.is_none() { edges(&mut bench, &references[&BOUNCES], paths) } else { Ok(()) }
}

/// Prints how far direct light alone is off, which everything else contains.
fn direct(bench: &mut Bench, paths: u32) -> Result<()> {
    let traced = bench.traced("direct", 0, paths)?;
    let inside = bench.inside()?;
    let (picture, ms) = bench.after(&[("bounces", int(0))], 1)?;
    let row = Row {
        name: "direct light alone".to_owned(),
        error: error(&picture, &traced, &inside)?,
        ms,
    };
    println!("| setting | {HEADS} |\n|---|{RULE}");
    println!("| {} | {} |\n", row.name, told(&row));
    Ok(())
}

const HEADS: &str = "relMSE | inside surfaces | FLIP | bias inside | ms";
const RULE: &str = "---|---|---|---|---|";

fn told(row: &Row) -> String {
    let Error { whole, rel_mse, flip, bias } = row.error;
    format!("{whole:.5} | {rel_mse:.5} | {flip:.4} | {bias:+.4} | {:.0}", row.ms)
}

/// Prints each knob turned alone.
fn knobs(bench: &mut Bench, references: &BTreeMap<u32, TracedPicture>) -> Result<()> {
    let inside = bench.inside()?;
    let mut rows = Vec::new();
    for (knob, all) in KNOBS {
        for value in all {
            let mut sets: Vec<Set<'_>> = vec![(knob, int(*value))];
            let bounces = if knob == "bounces" { *value } else { BOUNCES };
            if knob != "bounces" {
                sets.push(("bounces", int(BOUNCES)));
            }
            let (picture, ms) = bench.after(&sets, 1)?;
            let error = error(&picture, &references[&bounces], &inside)?;
            rows.push((bounces, Row { name: format!("{knob} {value}"), error, ms }));
        }
    }
    println!("| setting, one frame | {HEADS} on the front |\n|---|{RULE}---|");
    for (bounces, row) in &rows {
        // Pictures of other numbers of bounces are other pictures.
        let better = |(other_bounces, other): &(u32, Row)| {
            let is_faster = other.ms < row.ms && other.error.rel_mse <= row.error.rel_mse;
            other_bounces == bounces && is_faster
        };
        let front = if rows.iter().any(better) { "" } else { "yes" };
        println!("| {} | {} | {front} |", row.name, told(row));
    }
    println!();
    Ok(())
}

/// Prints errors by how many frames are added up.
fn converged(bench: &mut Bench, reference: &TracedPicture) -> Result<()> {
    let inside = bench.inside()?;
    println!("| frames | {HEADS} a frame |\n|---|{RULE}");
    for frames in FRAMES {
        let (picture, ms) = bench.after(&[("bounces", int(BOUNCES))], frames)?;
        let error = error(&picture, reference, &inside)?;
        println!("| {frames} | {} |", told(&Row { name: String::new(), error, ms }));
    }
    println!();
    Ok(())
}

/// Prints how far reflected light is off near the box's edges and elsewhere.
fn edges(bench: &mut Bench, full: &TracedPicture, paths: u32) -> Result<()> {
    let direct = bench.traced("direct", 0, paths)?;
    let reference = blurred(&less(&full.color, &direct.color));
    let near = bench.near_edges(NEAR)?;
    let away: Vec<bool> =
        bench.inside()?.iter().zip(&near).map(|(inside, near)| *inside && !near).collect();
    println!("{} pixels near edges, {} elsewhere\n", count(&near), count(&away));
    println!(
        "| near | compensation | bias near edges | mean error | bias elsewhere | mean error |\n|---|---|---|---|---|---|"
    );
    for near_as in ["disc", "bounded"] {
        for compensation in [0, 8, 64] {
            let sets = [
                ("show", text("indirect")),
                ("bounces", int(BOUNCES)),
                ("near", text(near_as)),
                ("compensation", int(compensation)),
            ];
            let picture = blurred(&bench.after(&sets, 64)?.0);
            let numbers = [&near, &away].map(|counts| {
                let (bias, mean) =
                    (bias(&picture, &reference, counts), relative(&picture, &reference, counts));
                format!("{bias:+.4} | {mean:.4}")
            });
            println!("| {near_as} | {compensation} | {} |", numbers.join(" | "));
        }
    }
    Ok(())
}

fn count(all: &[bool]) -> usize {
    all.iter().filter(|is| **is).count()
}
