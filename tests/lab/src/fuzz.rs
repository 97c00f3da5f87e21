//! Changes good inputs of one target of the fuzzer, for minutes of processor time: `fuzz NAME MINUTES SEED`.

use anyhow::Context;
use std::path::Path;
use std::time::{Duration, Instant};
use surfelshop_fuzz::{Chance, TARGETS, allow_contained_panics, corpus, mutated};

/// An input that takes longer is told.
const SLOW: Duration = Duration::from_secs(2);

/// Inputs between two looks at the clock of the process.
const ROUND: u64 = 64;

pub(super) fn run() -> anyhow::Result<()> {
    let words: Vec<String> = std::env::args().skip(2).collect();
    let [name, minutes, seed] = words.as_slice() else {
        anyhow::bail!("expected a target, minutes and a seed, found {words:?}")
    };
    let known = TARGETS.iter().find(|(known, _)| known == name);
    let (name, target) = *known.with_context(|| format!("there is no target `{name}`"))?;
    let minutes: f64 = minutes.parse()?;
    let mut chance = Chance::new(seed.parse()?);
    let seeds: Vec<Vec<u8>> = corpus(name)?.iter().map(std::fs::read).collect::<Result<_, _>>()?;
    allow_contained_panics();
    let (mut runs, mut findings, mut longest) = (0u64, 0u64, Duration::ZERO);
    while runs % ROUND != 0 || processor_minutes()? < minutes {
        let bytes = mutated(&seeds, &mut chance);
        let started = Instant::now();
        let failed = std::panic::catch_unwind(|| target(&bytes)).is_err();
        let took = started.elapsed();
        longest = longest.max(took);
        if failed || took > SLOW {
            findings += 1;
            let path = std::env::temp_dir().join(format!("surfelshop-{name}-{runs}"));
            std::fs::write(&path, &bytes)?;
            println!("{name} {runs}: failed {failed}, {took:.1?}: {}", path.display());
        }
        runs += 1;
    }
    let minutes = processor_minutes()?;
    println!(
        "{name}: {runs} inputs, {findings} findings, {minutes:.1} minutes, slowest {longest:.1?}"
    );
    Ok(())
}

/// Processor time of this process so far, on all its threads.
fn processor_minutes() -> anyhow::Result<f64> {
    // The fields behind the name, which may hold spaces, are the 3rd and further; the 14th and 15th are ticks of a
    // hundredth of a second.
    let text = std::fs::read_to_string(Path::new("/proc/self/stat"))?;
    let (_, rest) = text.rsplit_once(')').context("no name")?;
    let fields: Vec<&str> = rest.split_ascii_whitespace().collect();
    let ticks = |place: usize| fields.get(place - 3).and_then(|field| field.parse::<f64>().ok());
    let ticks = ticks(14).zip(ticks(15)).context("no times")?;
    Ok((ticks.0 + ticks.1) / 6000.0)
}
