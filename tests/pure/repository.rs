//! What the repository holds: few visible entries at the top, and no large file anywhere.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The visible top-level entries; dotfiles may be added without asking.
const TOP_LEVEL: [&str; 9] = [
    "Cargo.lock",
    "Cargo.toml",
    "LICENSE",
    "README.md",
    "assets",
    "host",
    "plugins",
    "shaders",
    "tests",
];

/// The most bytes of a tracked file. Every clone carries every version for ever, and 4 MiB holds
/// a sample of 120 000 surfels.
const MOST_BYTES: u64 = 4 << 20;

pub(crate) fn root() -> &'static Path {
    let harness = Path::new(env!("CARGO_MANIFEST_DIR"));
    harness.parent().expect("the tests lie in a folder of the root")
}

/// The files of the repository relative to the root: what git tracks, and of a source that came without
/// its history, such as an unpacked archive, all but what Cargo built.
pub(crate) fn files() -> Vec<PathBuf> {
    if !root().join(".git").exists() {
        return files_below(root());
    }
    let output = Command::new("git")
        // A checkout may belong to another user than the one that runs the tests in a container.
        .args(["-c", "safe.directory=*", "ls-files", "-z"])
        .current_dir(root())
        .output()
        .expect("git runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let names = String::from_utf8(output.stdout).expect("tracked names are UTF-8");
    let files: Vec<PathBuf> = names.split_terminator('\0').map(PathBuf::from).collect();
    assert!(files.iter().any(|file| file == Path::new("Cargo.toml")), "files are listed");
    // A file deleted but not yet committed is tracked and absent.
    files.into_iter().filter(|file| root().join(file).exists()).collect()
}

fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in folder.read_dir().expect("folders of a source can be listed") {
        let path = entry.expect("their entries, too").path();
        if path.is_dir() && !path.ends_with("target") {
            found.extend(files_below(&path));
        } else if path.is_file() {
            found.push(path.strip_prefix(root()).expect("it lies below").to_owned());
        }
    }
    found
}

#[test]
fn top_level_shows_only_what_was_agreed() {
    let files = files();
    let entries: BTreeSet<_> = files
        .iter()
        .filter_map(|file| file.iter().next()?.to_str())
        .filter(|entry| !entry.starts_with('.') && !TOP_LEVEL.contains(entry))
        .collect();
    assert!(entries.is_empty(), "unexpected at the top of the repository: {entries:?}");
}

#[test]
fn no_tracked_file_is_large() {
    for file in files() {
        let bytes = root().join(&file).metadata().expect("it is there").len();
        assert!(bytes <= MOST_BYTES, "{} holds {bytes} bytes of {MOST_BYTES}", file.display());
    }
}

/// Most entries of a folder: more are not taken in at a glance.
const MOST_ENTRIES: usize = 20;

/// Invariant: no folder holds more than 20 entries.
#[test]
fn no_folder_holds_more_than_twenty_entries() {
    let mut folders: BTreeMap<PathBuf, BTreeSet<PathBuf>> = BTreeMap::new();
    for file in files() {
        for path in file.ancestors().filter(|path| path.parent().is_some()) {
            let folder = path.parent().expect("it has one").to_owned();
            folders.entry(folder).or_default().insert(path.to_owned());
        }
    }
    let full = folders.iter().filter(|(_, entries)| entries.len() > MOST_ENTRIES);
    let full: Vec<String> =
        full.map(|(folder, entries)| format!("{}: {}", folder.display(), entries.len())).collect();
    assert!(full.is_empty(), "folders with more than {MOST_ENTRIES} entries: {full:?}");
}

/// Invariant: half of the source files have at most 150 lines.
#[test]
fn half_of_the_source_files_have_at_most_150_lines() {
    let is_source = |file: &PathBuf| file.extension().is_some_and(|e| e == "rs" || e == "wgsl");
    let lines =
        |file: PathBuf| std::fs::read_to_string(root().join(file)).expect("text").lines().count();
    let mut lengths: Vec<usize> = files().into_iter().filter(is_source).map(lines).collect();
    lengths.sort_unstable();
    assert!(lengths.len() > 500, "only {} files were read", lengths.len());
    assert!(lengths[lengths.len() / 2] <= 150, "the median is {}", lengths[lengths.len() / 2]);
}
