//! The boundary does not depend on how either side was compiled.

use crate::third_party::project::{build, cargo, folder, graph, project, renderer, root};
use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use surfelshop_api::manifest::{ABI_MAJOR, ABI_MINOR};
use surfelshop_api::params::{Value, Values};

/// Adds lines to a project's manifest, behind one that is there.
fn edit(project: &Path, behind: &str, lines: &str) {
    let path = project.join("Cargo.toml");
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(behind), "{text}");
    fs::write(&path, text.replacen(behind, &format!("{behind}\n{lines}"), 1)).unwrap();
}

/// Invariant: a plugin describes the same graph however it was compiled, and a renderer in C the
/// very graph of its twin in Rust
#[test]
fn other_optimisation_debugging_and_features_describe_the_same_graph() {
    let usual = project("rim", "shading");
    let usual = build(&usual, &["--release"], "release");
    // Another crate of the same code, so that the libraries lie side by side.
    let plain = project("rim-plain", "shading");
    let plain = build(&plain, &[], "debug");
    let other = project("rim-other", "shading");
    edit(
        &other,
        "[dependencies]",
        "glam = { version = \"0.34\", features = [\"scalar-math\"] }\n\
         serde = { version = \"1\", features = [\"rc\"] }",
    );
    edit(&other, "[profile.release]", "opt-level = \"s\"\noverflow-checks = true\ndebug = 1");
    let other = build(&other, &["--release"], "release");

    let units = [usual, plain, other].map(|library| renderer(&library));
    let values: Values = [
        ("sharpness".to_owned(), Value::Float(7.25)),
        ("rim".to_owned(), Value::Color([0.5, 0.25, 2.0])),
    ]
    .into();
    for values in [Values::new(), values] {
        let [usual, plain, other] = units.each_ref().map(|unit| graph(unit, &values).unwrap());
        assert!(usual == plain && usual == other);
        assert!(!usual.structure.is_empty() && usual.data.len() == 16);
    }
    assert_eq!(units[0].description, units[1].description);
    assert_eq!(units[0].description, units[2].description);
}

/// A plugin that another compiler built, and the same built here, from the same source.
#[test]
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
fn another_compiler_describes_the_same_graph() {
    let stored = root().join("tests/stored");
    let other = folder("of_another_compiler.so");
    // Of the newest revision that has one: the revisions since added nothing that this plugin writes. Later ones were
    // built by the compiler that builds here.
    let stored_of =
        |minor: u16| stored.join(format!("{ABI_MAJOR}.{minor}/plugin-x86_64-linux.so.gz"));
    let unzipped = |path: PathBuf| {
        let mut bytes = Vec::new();
        flate2::read::GzDecoder::new(fs::File::open(path).ok()?).read_to_end(&mut bytes).unwrap();
        Some(bytes)
    };
    let of_debian = |bytes: &Vec<u8>| bytes.windows(12).any(|window| window == b"rustc-1.85.0");
    let mut all = (0..=ABI_MINOR).rev().map(stored_of).filter_map(unzipped);
    let bytes = all.find(of_debian).expect("one is stored that Debian's rustc 1.85.0 built");
    fs::write(&other, bytes).unwrap();

    let here = project("stored-here", "shading");
    fs::copy(stored.join("plugin.rs"), here.join("src/lib.rs")).unwrap();
    let here = build(&here, &["--release"], "release");
    let units = [other, here].map(|library| renderer(&library));
    for gain in [1.0, 1.0 / 3.0] {
        let values: Values = [("gain".to_owned(), Value::Float(gain))].into();
        let [other, here] = units.each_ref().map(|unit| graph(unit, &values).unwrap());
        assert!(other == here && !here.structure.is_empty());
    }
}

/// Invariant: plugins that abort on panic do not compile, and say why
#[test]
fn aborting_panics_are_refused_when_it_is_compiled_and_the_reason_is_said() {
    let project = project("aborts", "shading");
    // Its own crate alone: what it depends on is built already.
    let options = ["rustc", "--release"];
    let checked = cargo(&project, &options, &["--", "-C", "panic=abort"]);
    let told = String::from_utf8_lossy(&checked.stderr);
    assert!(!checked.status.success(), "{told}");
    let reason = "a Surfelshop plugin needs panic = \"unwind\"";
    assert!(told.contains(reason) && told.contains("would end the whole program"), "{told}");
}
