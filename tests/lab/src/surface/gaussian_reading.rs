//! What Gaussians cost a reader: `surface gaussian-reading FILE.ply [ROUNDS]`, for a binary PLY file of a trainer,
//! such as `surface gaussians` writes.
//!
//! The same bytes are read as Gaussians, as a cloud of plain columns (a copy in which the properties have other names,
//! three of them those of normals), and as bytes. Every reader runs in a process of its own, one after the other in each
//! round; a first round, which brings the files into the page cache, is left out.

use anyhow::{Context as _, Result};
use std::io::Read as _;
use std::path::Path;
use surfelshop_cloud::ReadOptions;
use surfelshop_tests::measure::{Cost, in_child};

/// Properties that make Gaussians, and what they are called in the plain copy.
const RENAMED: [(&str, &str); 7] = [
    (" nx\n", " mx\n"),
    (" ny\n", " my\n"),
    (" nz\n", " mz\n"),
    ("f_dc_0", "nx"),
    ("f_dc_1", "ny"),
    ("f_dc_2", "nz"),
    ("rot_", "turn_"),
];

const END: &[u8] = b"end_header\n";

pub(super) fn run(arguments: &[String]) -> Result<()> {
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["measure", how, file] => {
            let (_, cost) = Cost::of(|| read(how, file.as_ref()))?;
            println!("{}", cost.to_line());
            Ok(())
        }
        [file] => compare(file.as_ref(), 9),
        [file, rounds] => compare(file.as_ref(), rounds.parse()?),
        _ => anyhow::bail!("expected a PLY file and how often, found {arguments:?}"),
    }
}

fn read(how: &str, file: &Path) -> Result<usize> {
    if how == "bytes" {
        let (mut file, mut block, mut total) = (std::fs::File::open(file)?, vec![0; 1 << 20], 0);
        loop {
            match std::hint::black_box(file.read(&mut block)?) {
                0 => return Ok(total),
                n => total += n,
            }
        }
    }
    // Radii are given, so that the plain columns need no estimates.
    let options = ReadOptions { radius: Some(0.001), ..ReadOptions::default() };
    let loaded = surfelshop_cloud::read(file, &options)?;
    let are_splats = loaded.summary.splats.is_some();
    anyhow::ensure!(are_splats == (how == "gaussians"), "{}", file.display());
    Ok(loaded.cloud.len())
}

fn compare(file: &Path, rounds: usize) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let plain = folder.path().join("plain.ply");
    let bytes = std::fs::read(file)?;
    let end = bytes.windows(END.len()).position(|window| window == END).context("a header")?;
    let renamed =
        RENAMED.iter().fold(String::from_utf8(bytes[..end].to_vec())?, |header, (from, to)| {
            header.replace(from, to)
        });
    std::fs::write(&plain, [renamed.as_bytes(), &bytes[end..]].concat())?;
    drop(bytes);
    let name = |path: &Path| path.to_str().map(str::to_owned).context("a name in UTF-8");
    let (file, plain) = (name(file)?, name(&plain)?);
    let readers = [("bytes", &file), ("columns", &plain), ("gaussians", &file)];
    let mut costs: [Vec<Cost>; 3] = Default::default();
    for round in 0..=rounds {
        for ((how, file), costs) in readers.iter().zip(&mut costs) {
            let told = in_child(&["surface", "gaussian-reading", "measure", how, file])?;
            if round > 0 {
                costs.push(Cost::from_lines(&told)?);
            }
        }
    }
    println!(
        "| read as | CPU ms, median (least to most) | wall ms | peak MB | of the columns' CPU |"
    );
    println!("|---|---|---|---|---|");
    let columns = sorted(&costs[1], |cost| cost.cpu);
    for ((how, _), costs) in readers.iter().zip(&costs) {
        let cpu = sorted(costs, |cost| cost.cpu);
        let middle = |part: fn(&Cost) -> f64| median(&sorted(costs, part));
        println!(
            "| {how} | {:.0} ({:.0} to {:.0}) | {:.0} | {:.0} | {:.2} |",
            1e3 * median(&cpu),
            1e3 * cpu.first().copied().unwrap_or_default(),
            1e3 * cpu.last().copied().unwrap_or_default(),
            1e3 * middle(|cost| cost.wall),
            1e-6 * middle(|cost| cost.peak),
            median(&cpu) / median(&columns),
        );
    }
    Ok(())
}

fn sorted(costs: &[Cost], part: impl Fn(&Cost) -> f64) -> Vec<f64> {
    let mut parts: Vec<f64> = costs.iter().map(part).collect();
    parts.sort_by(f64::total_cmp);
    parts
}

fn median(sorted: &[f64]) -> f64 {
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}
