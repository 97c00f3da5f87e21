//! What work in parts takes on many machines, simulated from the times of measured parts.
//!
//! `farm PARTS PIECES WANTED [KEY=VALUE …]`: the folder of the parts of a report or film, the pieces they have together, and
//! the pieces that are planned. Values, with what stands where none is typed: `cores=32` of a node, `start=0.2` CPU seconds
//! of a part before its first piece, `dispatch=0.01` seconds in which the scheduler starts a task, `merge=2e-4` seconds a
//! piece, `part-merge=5e-3` seconds a part, `bytes=0` that a piece reads and writes, `storage=1e9` bytes a second that the
//! storage takes and gives. A task is a part on one core. Where no PARTS are measured, `rate=X` pieces a CPU second stand for them.
//!
//! Tasks begin one after the other, as the scheduler starts them and cores are free; each takes its start and, for each of
//! its pieces, what a measured part took of one, so that the spread is that of the measured parts. They wait for the storage
//! as a queue that serves one after the other. The merge is one task at the end. Of the powers of two that parts may be,
//! up to 65536, the one is shown that takes the least time.

use anyhow::{Context as _, Result, ensure};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::path::Path;

const NODES: [usize; 3] = [1, 100, 1000];

/// What is measured or assumed of machines, seconds and bytes.
struct Farm {
    cores: f64,
    start: f64,
    dispatch: f64,
    merge: f64,
    part_merge: f64,
    bytes: f64,
    storage: f64,
}

/// What came of a simulation, seconds.
struct Outcome {
    parts: usize,
    tasks: f64,
    merge: f64,
    cpu: f64,
}

/// Prints the table.
pub(crate) fn run() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(2).collect();
    let value = |key: &str, otherwise: f64| -> Result<f64> {
        let found = words.iter().find_map(|word| word.strip_prefix(key)?.strip_prefix('='));
        found.map_or(Ok(otherwise), |text| text.parse().with_context(|| format!("{key}={text}")))
    };
    let farm = Farm {
        cores: value("cores", 32.0)?,
        start: value("start", 0.2)?,
        dispatch: value("dispatch", 0.01)?,
        merge: value("merge", 2e-4)?,
        part_merge: value("part-merge", 5e-3)?,
        bytes: value("bytes", 0.0)?,
        storage: value("storage", 1e9)?,
    };
    let plain: Vec<&String> = words.iter().filter(|word| !word.contains('=')).collect();
    let rate = value("rate", 0.0)?;
    let (wanted, each): (f64, Vec<f64>) = match plain.as_slice() {
        [wanted] if rate > 0.0 => (wanted.parse()?, vec![1.0 / rate]),
        [parts, pieces, wanted] => {
            (wanted.parse()?, measured(Path::new(parts), pieces.parse()?, farm.start)?)
        }
        _ => anyhow::bail!("expected PARTS PIECES WANTED, or rate=X WANTED"),
    };
    let mean = each.iter().sum::<f64>() / each.len() as f64;
    println!("{:.4} CPU seconds a piece, {} measured parts", mean, each.len());
    println!(
        "| nodes | parts | tasks, s | merge, s | together, s | CPU hours | of the cores' time |"
    );
    println!("|---|---|---|---|---|---|---|");
    for nodes in NODES {
        let cores = nodes as f64 * farm.cores;
        let tried = (0..17).map(|power| (1_usize << power).min(wanted as usize));
        let all = tried.map(|parts| simulated(&farm, &each, wanted, cores as usize, parts));
        let together = |told: &Outcome| told.tasks + told.merge;
        let least = all.min_by(|a, b| together(a).total_cmp(&together(b)));
        let told = least.context("no number of parts was tried")?;
        let whole = together(&told);
        println!(
            "| {nodes} | {} | {:.0} | {:.1} | {whole:.0} | {:.1} | {:.0} % |",
            told.parts,
            told.tasks,
            told.merge,
            told.cpu / 3600.0,
            100.0 * wanted * mean / (whole * cores)
        );
    }
    Ok(())
}

/// CPU seconds a piece of each measured part.
fn measured(folder: &Path, pieces: f64, start: f64) -> Result<Vec<f64>> {
    let mut all = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let file = entry?.path().join("part.json");
        if !file.is_file() {
            continue;
        }
        let told: serde_json::Value = serde_json::from_slice(&std::fs::read(&file)?)?;
        let seconds = told["cpu_seconds"].as_f64();
        all.push(seconds.with_context(|| format!("{}: no CPU seconds", file.display()))?);
    }
    ensure!(!all.is_empty(), "{}: expected the parts of a report or film", folder.display());
    let own = pieces / all.len() as f64;
    Ok(all.iter().map(|seconds| (seconds - start).max(0.0) / own).collect())
}

fn simulated(farm: &Farm, each: &[f64], wanted: f64, cores: usize, parts: usize) -> Outcome {
    let own = wanted / parts as f64;
    // When each core is free, in microseconds: whole numbers have an order.
    let ticks = |seconds: f64| (seconds * 1e6) as u64;
    let mut free: BinaryHeap<Reverse<u64>> = (0..cores).map(|_| Reverse(0)).collect();
    let (mut storage, mut last, mut cpu) = (0, 0, 0.0);
    for part in 0..parts {
        let dispatched = ticks(farm.dispatch * part as f64);
        let Some(Reverse(core)) = free.pop() else { break };
        storage = storage.max(core.max(dispatched)) + ticks(own * farm.bytes / farm.storage);
        let work = farm.start + own * each[part % each.len()];
        cpu += work;
        let end = storage + ticks(work);
        last = last.max(end);
        free.push(Reverse(end));
    }
    let merge = wanted * farm.merge + parts as f64 * farm.part_merge;
    Outcome { parts, tasks: last as f64 * 1e-6, merge, cpu: cpu + merge }
}
