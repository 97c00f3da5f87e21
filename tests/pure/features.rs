//! `cargo test` shares what `cargo build` compiled: crates that both use have the same features in both. Where tests turn
//! one on, every crate above it is compiled once more, which was half of what `cargo test` compiled.

use std::collections::HashMap;
use std::process::Command;

use crate::repository::root;

/// The features of the crates that are linked, by name and version. A second or less.
fn features(kinds: &str) -> HashMap<String, String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .current_dir(root())
        .args(["tree", "--workspace", "--locked", "--offline", "--prefix", "none"])
        .args(["--edges", kinds, "--format", "{p} [{f}]"])
        .output()
        .expect("cargo runs");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "cargo tree failed: {errors}");
    let printed = String::from_utf8_lossy(&output.stdout);
    let lines = printed.lines().filter_map(|line| {
        let (package, features) = line.trim_end_matches(" (*)").rsplit_once(" [")?;
        Some((package.to_owned(), features.to_owned()))
    });
    lines.collect()
}

#[test]
fn tests_turn_on_no_feature_of_what_the_build_compiled() {
    let built = features("normal,no-proc-macro");
    let tested = features("normal,dev,no-proc-macro");
    assert!(built.len() > 100, "{} crates", built.len());
    let differs = |(package, features): (&String, &String)| {
        let other = tested.get(package).filter(|other| *other != features)?;
        Some(format!("{package}: [{features}] in the build, [{other}] in tests"))
    };
    let differing: Vec<String> = built.iter().filter_map(differs).collect();
    assert!(
        differing.is_empty(),
        "turn these features on in [dependencies] of tests/Cargo.toml, too:\n{}",
        differing.join("\n")
    );
}
