//! Plugins that misbehave: the command fails with one line, and nothing else is harmed.

use crate::cli::program::{TestFolder, facing_front};
use std::time::{Duration, Instant};
use surfelshop_tests::stage::build_folder;

/// A library of the fixture package.
fn fixture(name: &str) -> String {
    let library = format!("{}{name}{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let path = build_folder().join("examples").join(library);
    assert!(path.is_file(), "{} is not built; `cargo verify` builds it", path.display());
    path.to_string_lossy().into_owned()
}

/// Renders with a unit of the faulty plugin and one that is in order, into `a.png`.
#[track_caller]
fn assert_fails_alone(unit: &str, words: &[&str]) {
    let desk = TestFolder::new();
    desk.put_cloud("one.ply", &[facing_front(0.0, 0.0, 1.0)]);
    let plugin = fixture("faulty");
    let render = |unit: &str| {
        let arguments = ["render", "one.ply", "-o", "a.png", "--size", "16", "-r", unit];
        desk.run_with(
            &[&arguments[..], &["--trust", "--plugin", &plugin, "--patience", "2"]].concat(),
        )
    };
    let started = Instant::now();
    render(unit).failed(words);
    assert!(started.elapsed() < Duration::from_secs(60), "nothing waits for a plugin for ever");
    assert_eq!(desk.files(), ["one.ply"]);
    render("flat").done();
    render("fine").done();
}

#[test]
fn panics_are_one_line() {
    assert_fails_alone("panics-in-describe", &["panics-in-describe", "declare goes wrong"]);
    assert_fails_alone("panics-in-new", &["could not start", "new goes wrong"]);
    assert_fails_alone("panics-in-frame", &["faulty/panics-in-frame", "frame goes wrong"]);
    assert_fails_alone("panics-twice", &["not text"]);
}

/// Invariant: a plugin that hangs is given up in time, and the program ends without it
#[test]
fn plugins_that_hang_are_given_up() {
    let late = "did not answer within 2 s";
    assert_fails_alone("hangs-in-describe", &["hangs-in-describe", "while it was loaded", late]);
    assert_fails_alone("hangs-in-new", &["faulty/hangs-in-new", "could not start", late]);
    assert_fails_alone("hangs-in-frame", &["faulty/hangs-in-frame", late]);
}

#[test]
fn a_plugin_that_never_ends_does_not_keep_the_program() {
    let desk = TestFolder::new();
    desk.put_cloud("one.ply", &[facing_front(0.0, 0.0, 1.0)]);
    let arguments = ["render", "one.ply", "-o", "a.exr", "--output", "depth", "--size", "16"];
    let plugin = ["-r", "hangs-in-drop", "--trust", "--plugin", &fixture("faulty")];
    desk.run_with(&[&arguments[..], &plugin].concat()).done();
}

#[cfg(target_os = "linux")]
#[test]
fn a_library_that_is_never_done_loading_is_given_up() {
    let desk = TestFolder::new();
    desk.put_cloud("one.ply", &[facing_front(0.0, 0.0, 1.0)]);
    let arguments = ["render", "one.ply", "-o", "a.png", "--size", "16", "-r", "fine"];
    let plugin = ["--trust", "--plugin", &fixture("sleeper"), "--patience", "2"];
    let ended = desk.run_with(&[&arguments[..], &plugin].concat());
    ended.failed(&["test.sleeper/fine", "while it was loaded", "did not answer within 2 s"]);
}

#[test]
fn errors_of_a_plugin_are_shown() {
    assert_fails_alone("returns-error", &["faulty/returns-error", "the moon is not full"]);
}

#[test]
fn faulty_graphs_name_pass_and_variable() {
    assert_fails_alone("invalid-wgsl", &["pass `broken`", "expected `)`"]);
    assert_fails_alone("wrong-uniform-size", &["pass `tint`", "`settings`", "32 bytes", "4 given"]);
    assert_fails_alone("unbound-variable", &["pass `shade`", "`settings`", "not bound"]);
    assert_fails_alone("unknown-binding", &["pass `shade`", "`nonsense`"]);
    assert_fails_alone("no-output", &["no output `color`"]);
    assert_fails_alone("huge-texture", &["`huge`", "1000000 x 1000000"]);
}

#[test]
fn units_of_another_kind_are_named_as_such() {
    assert_fails_alone("stages-ao", &["`stages-ao` is a tool"]);
}

#[test]
fn a_named_plugin_that_is_no_good_is_not_passed_over() {
    // Another plugin has a renderer of that name; drawing with it would compare the wrong code.
    let desk = TestFolder::new();
    desk.put_cloud("one.ply", &[facing_front(0.0, 0.0, 1.0)]);
    let arguments = ["render", "one.ply", "-o", "a.png", "--size", "16", "-r", "flat"];
    for file in ["nowhere.so", "one.ply"] {
        desk.run_with(&[&arguments[..], &["--trust", "--plugin", file]].concat()).failed(&[file]);
        assert_eq!(desk.files(), ["one.ply"]);
    }
}
