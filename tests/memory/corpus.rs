//! Every seed and every finding of the fuzzers, once more: no panic, no hang, no allocation beyond the limit.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;
use surfelshop_fuzz::{FORMATS, MOST_BYTES, TARGETS, Target, corpus};

use crate::{MEMORY, resident};

/// Far more than any input takes, on a machine that does other things besides.
const HANGS: Duration = Duration::from_secs(60);

/// Folders of the checkout whose files are good inputs as they are.
const GOOD: [(&str, &[&str]); 3] = [
    ("graph", &["tests/stored/3.0", "tests/stored/3.3", "tests/stored/3.4", "tests/stored/3.5"]),
    ("manifest", &["tests/fixtures/faulty/foreign"]),
    (
        "shader",
        &[
            "host/app/src/plugins/template/graph/src",
            "plugins/ewa-phong/src",
            "shaders/lighting",
            "shaders/noise",
            "shaders/surface",
        ],
    ),
];

fn inputs(target: &str) -> Vec<PathBuf> {
    let crate_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = crate_folder.parent().unwrap();
    let good = GOOD.iter().filter(|(name, _)| *name == target).flat_map(|(_, folders)| *folders);
    let folders = good.map(|folder| root.join(folder));
    let mut inputs = corpus(target).unwrap();
    assert!(!inputs.is_empty(), "{target} has no inputs");
    for folder in folders {
        let listing = folder.read_dir().unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
        let found = listing.map(|entry| entry.unwrap().path()).filter(|path| path.is_file());
        let before = inputs.len();
        inputs.extend(found);
        assert!(inputs.len() > before, "{} has no inputs", folder.display());
    }
    inputs.sort();
    inputs
}

/// Runs a target on a thread of its own; a panic of it fails the test, and so does silence.
fn run(name: &str, target: Target, bytes: Vec<u8>) {
    let (done, ended) = channel();
    let thread = std::thread::spawn(move || {
        target(&bytes);
        done.send(()).unwrap();
    });
    match ended.recv_timeout(HANGS) {
        Ok(()) => thread.join().unwrap(),
        Err(RecvTimeoutError::Disconnected) => panic!("{name}: panicked"),
        Err(RecvTimeoutError::Timeout) => panic!("{name}: hangs"),
    }
}

/// What a target's plugin took besides, since there were so many bytes.
pub(crate) fn of_plugins(name: &str, before: u64) -> usize {
    match FORMATS.contains(&name) {
        true => resident::peak().saturating_sub(before) as usize,
        false => 0,
    }
}

// One test, since memory is counted for the whole process.
/// Invariant: nothing that fuzzers found panics, hangs, or takes much memory
#[test]
fn nothing_that_fuzzers_found_panics_hangs_or_takes_much_memory() {
    for (name, target) in TARGETS {
        for input in inputs(name) {
            let bytes = std::fs::read(&input).unwrap();
            let before = MEMORY.current_usage();
            MEMORY.reset_peak_usage();
            let resident = resident::reset();
            run(&input.display().to_string(), target, bytes);
            let taken = MEMORY.peak_usage().saturating_sub(before).max(of_plugins(name, resident));
            let input = input.display();
            assert!(
                taken < MOST_BYTES,
                "{input}: {taken} bytes, at most {MOST_BYTES} may be taken"
            );
        }
    }
}
