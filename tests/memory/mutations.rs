//! Good inputs of every kind, changed tens of thousands of times by a fixed seed: no panic, no hang, no
//! allocation beyond the limit. Costs 20 s; with `SURFELSHOP_LONG` minutes, for more than 250,000 changes.

use std::sync::mpsc::channel;
use std::time::Duration;
use surfelshop_fuzz::{
    Chance, FORMATS, MOST_BYTES, TARGETS, Target, allow_contained_panics, corpus, mutated,
};

use crate::corpus::of_plugins;
use crate::{MEMORY, resident};

/// Far more than any input takes, on a machine that does other things besides.
const HANGS: Duration = Duration::from_secs(60);

/// Changes of the inputs of a target; those of graphs and shaders are compiled, each for milliseconds.
fn n_changes(name: &str) -> u64 {
    let is_long = std::env::var_os("SURFELSHOP_LONG").is_some();
    match (name, is_long) {
        ("graph" | "shader", false) => 150,
        ("graph" | "shader", true) => 5_000,
        ("probe", false) => 500,
        (format, false) if FORMATS.contains(&format) => 400,
        (format, true) if FORMATS.contains(&format) => 20_000,
        (_, false) => 3_000,
        ("probe", true) => 10_000,
        (_, true) => 25_000,
    }
}

fn seeds(target: &str) -> Vec<Vec<u8>> {
    let paths = corpus(target).unwrap();
    let seeds: Vec<Vec<u8>> = paths.iter().map(|path| std::fs::read(path).unwrap()).collect();
    assert!(!seeds.is_empty(), "{target}");
    seeds
}

/// Where an input that is a finding is kept.
fn keep(name: &str, number: u64, bytes: &[u8]) -> String {
    let path = std::env::temp_dir().join(format!("surfelshop-{name}-{number}"));
    std::fs::write(&path, bytes).unwrap();
    path.display().to_string()
}

fn run(name: &'static str, target: Target) {
    let seeds = seeds(name);
    let mut chance = Chance::new(28);
    for number in 0..n_changes(name) {
        let bytes = mutated(&seeds, &mut chance);
        let before = MEMORY.current_usage();
        MEMORY.reset_peak_usage();
        let resident = resident::reset();
        let (done, ended) = channel();
        let given = bytes.clone();
        let thread = std::thread::spawn(move || {
            target(&given);
            // Nobody listens where it took too long.
            let _sent = done.send(());
        });
        if ended.recv_timeout(HANGS).is_err() {
            let path = keep(name, number, &bytes);
            let what = if thread.is_finished() { "panics" } else { "hangs" };
            panic!("{name} {number} {what}: {path}");
        }
        thread.join().unwrap();
        let taken = MEMORY.peak_usage().saturating_sub(before).max(of_plugins(name, resident));
        if taken >= MOST_BYTES {
            let path = keep(name, number, &bytes);
            panic!("{name} {number} takes {taken} bytes, at most {MOST_BYTES} are allowed: {path}");
        }
    }
}

// One test, since memory is counted for the whole process.
/// Invariant: good inputs of every kind, changed at random, end in success or one line
#[test]
fn changed_inputs_neither_panic_nor_hang_nor_take_much_memory() {
    allow_contained_panics();
    for (name, target) in TARGETS {
        run(name, target);
    }
}
