//! What the repository holds: few visible entries at the top, and no large file anywhere.

use std::collections::BTreeSet;
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

fn root() -> &'static Path {
    let harness = Path::new(env!("CARGO_MANIFEST_DIR"));
    harness.ancestors().nth(2).expect("the harness lies in tests/harness")
}

/// The tracked files relative to the root, or `None` where the source came without its history,
/// such as an unpacked archive.
fn tracked_files() -> Option<Vec<PathBuf>> {
    if !root().join(".git").exists() {
        return None;
    }
    let output = Command::new("git")
        // A checkout may belong to another user than the one that runs the tests in a container.
        .args(["-c", "safe.directory=*", "ls-files", "-z"])
        .current_dir(root())
        .output()
        .expect("git runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let names = String::from_utf8(output.stdout).expect("tracked names are UTF-8");
    Some(names.split_terminator('\0').map(PathBuf::from).collect())
}

#[test]
fn top_level_shows_only_what_was_agreed() {
    let Some(files) = tracked_files() else { return };
    let entries: BTreeSet<_> = files
        .iter()
        .filter_map(|file| file.iter().next()?.to_str())
        .filter(|entry| !entry.starts_with('.') && !TOP_LEVEL.contains(entry))
        .collect();
    assert!(entries.is_empty(), "unexpected at the top of the repository: {entries:?}");
}

#[test]
fn no_tracked_file_is_large() {
    let Some(files) = tracked_files() else { return };
    assert!(files.iter().any(|file| file == Path::new("Cargo.toml")), "files are listed");
    for file in files {
        // A file deleted but not yet committed is tracked and absent.
        let Ok(facts) = root().join(&file).metadata() else { continue };
        let bytes = facts.len();
        assert!(bytes <= MOST_BYTES, "{} holds {bytes} bytes of {MOST_BYTES}", file.display());
    }
}
