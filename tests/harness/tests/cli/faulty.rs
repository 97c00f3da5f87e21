//! Plugins that misbehave: the command fails with one line, and nothing else is harmed.

use crate::program::{Desk, facing_front};
use surfelshop_tests::stage::build_folder;

/// Renders with a unit of the faulty plugin and one that is in order, into `a.png`.
#[track_caller]
fn assert_fails_alone(unit: &str, words: &[&str]) {
    let desk = Desk::new();
    desk.put_cloud("one.ply", &[facing_front(0.0, 0.0, 1.0)]);
    let library = format!("{}faulty{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let path = build_folder().join("examples").join(library);
    assert!(path.is_file(), "{} is not built; `cargo verify` builds it", path.display());
    let plugin = path.to_string_lossy();
    let render = |unit: &str| {
        let arguments = ["render", "one.ply", "-o", "a.png", "--size", "16", "-r", unit];
        desk.run_with(&[&arguments[..], &["--plugin", &plugin]].concat())
    };
    render(unit).failed(words);
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
    assert_fails_alone("gradient", &["`gradient` is a tracer", "flat"]);
    assert_fails_alone("stages-ao", &["`stages-ao` is a tool"]);
}

#[test]
fn a_named_plugin_that_is_no_good_is_not_passed_over() {
    // Another plugin has a renderer of that name; drawing with it would compare the wrong code.
    let desk = Desk::new();
    desk.put_cloud("one.ply", &[facing_front(0.0, 0.0, 1.0)]);
    let arguments = ["render", "one.ply", "-o", "a.png", "--size", "16", "-r", "flat"];
    for file in ["nowhere.so", "one.ply"] {
        desk.run_with(&[&arguments[..], &["--plugin", file]].concat()).failed(&[file]);
        assert_eq!(desk.files(), ["one.ply"]);
    }
}
