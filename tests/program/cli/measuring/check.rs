//! `surfelshop check`: what it finds, what it does not, and how it says so.

use crate::cli::bake::example;
use crate::cli::program::TestFolder;
use serde_json::Value;

/// Tools that see a cloud as a whole: their case `parts` is left out.
const WHOLE: [&str; 16] = [
    "sample",
    "splats",
    "brush",
    "value",
    "eraser",
    "inflate",
    "carve",
    "smooth",
    "boolean",
    "register",
    "fill-holes",
    "transform",
    "deform",
    "texture",
    "image-brush",
    "emboss",
];

/// Case and verdict of all that was run.
fn verdicts(told: &Value) -> Vec<(String, String, String)> {
    let units = told["units"].as_array().unwrap();
    let of_unit = |unit: &Value| -> Vec<(String, String, String)> {
        let id = unit["unit"]["id"].as_str().unwrap().to_owned();
        assert!(unit["error"].is_null(), "{unit}");
        let case = |case: &Value| {
            let text = |key: &str| case[key].as_str().unwrap().to_owned();
            assert!(!text("said").is_empty() && !text("said").contains('\n'), "{case}");
            (id.clone(), text("case"), text("verdict"))
        };
        unit["cases"].as_array().unwrap().iter().map(case).collect()
    };
    units.iter().flat_map(of_unit).collect()
}

/// Invariant: every unit of ours passes all cases of `check`, and of units that are wrong in one
/// way each is found by the case made for it
#[test]
fn built_in_plugins_pass() {
    let desk = TestFolder::new();
    let ended = desk.run("check --json");
    let told: Value = serde_json::from_str(&ended.stdout).unwrap();
    let verdicts = verdicts(&told);
    for (unit, case, verdict) in &verdicts {
        // Limits are declared, with their reason; nothing of ours is left out but for want of parameters.
        let is_known = match verdict.as_str() {
            "passed" | "limited" => true,
            // One that is done in a moment cannot be stopped.
            // A format that only reads has no files of its own to read back.
            "left_out" if ["gltf", "potree", "stl"].contains(&unit.as_str()) => true,
            // What sees a cloud as a whole, and what makes one of its own, is not held to parts.
            "left_out" if case == "parts" => WHOLE.contains(&unit.as_str()),
            "left_out" => case == "parameters" || case == "cancel",
            _ => false,
        };
        assert!(is_known, "{unit}, {case}: {verdict}; `surfelshop check {unit}` says why");
    }
    assert_eq!(ended.code, 0);
    // What ours cannot do, and nothing else.
    let limited: Vec<(&str, &str)> = verdicts
        .iter()
        .filter(|(_, _, verdict)| verdict == "limited")
        .map(|(unit, case, _)| (unit.as_str(), case.as_str()))
        .collect();
    let known = [
        ("procedural", "neutral-columns"),
        ("procedural", "turned"),
        // No case has a second cloud.
        ("boolean", "outputs"),
        ("boolean", "threads"),
        ("boolean", "again"),
        ("boolean", "reordered"),
        ("register", "outputs"),
        ("register", "threads"),
        ("register", "again"),
        ("register", "reordered"),
        // Nor a picture.
        ("texture", "outputs"),
        ("texture", "threads"),
        ("texture", "again"),
        ("texture", "reordered"),
        ("image-brush", "outputs"),
        ("image-brush", "threads"),
        ("image-brush", "again"),
        ("image-brush", "reordered"),
        ("emboss", "outputs"),
        ("emboss", "threads"),
        ("emboss", "again"),
        ("emboss", "reordered"),
        ("thin", "reordered"),
        ("thin", "parts"),
        ("spz", "moved"),
        ("splat", "moved"),
        ("sog", "moved"),
        ("compressed-ply", "round-trip"),
        ("compressed-ply", "moved"),
    ];
    assert_eq!(limited, known);
    for unit in [
        "flat",
        "ewa-phong",
        "environment",
        "gaussians",
        "gaussians-2d",
        "procedural",
        "reference",
        "ambient-occlusion",
    ] {
        let n = verdicts.iter().filter(|(id, ..)| id == unit).count();
        assert!(n >= 8, "{unit}: {n} cases");
    }
}

/// Each unit that is wrong in one way is found, by the case that is made for it.
#[test]
fn what_is_wrong_is_found_by_its_case() {
    let desk = TestFolder::new();
    let plugin = example("wrong");
    let failed = |unit: &str, more: &str| -> Vec<String> {
        let line = format!("check {unit} --trust --plugin {plugin} --json {more}");
        let ended = desk.run(&line);
        let verdicts = verdicts(&serde_json::from_str(&ended.stdout).unwrap());
        let failed: Vec<String> = verdicts
            .into_iter()
            .filter(|(_, _, verdict)| verdict == "failed")
            .map(|(_, case, _)| case)
            .collect();
        assert_eq!(ended.code, i32::from(!failed.is_empty()), "{unit}: {failed:?}");
        failed
    };
    assert_eq!(failed("right", ""), [""; 0]);
    for (unit, case) in [
        ("holes-at-a-slant", "grazing"),
        ("deeper", "depth"),
        ("no-number", "outputs"),
        ("restless", "outputs"),
        ("always-central", "orthographic"),
        ("swaps-axes", "normal"),
        ("swaps-axes", "turned"),
        ("leaves-out-light", "left-out"),
        ("by-order", "reordered"),
        ("by-part", "parts"),
    ] {
        assert_eq!(failed(unit, &format!("--case {case}")), [case], "{unit}");
    }
    assert_eq!(failed("by-order", ""), ["reordered"]);
    // A limit lets pass no more than it says, and it must be one of a case.
    assert_eq!(
        failed("belittles", "--case normal --case turned --case limits"),
        ["limits", "normal"]
    );
    assert_eq!(failed("no-number", "--case left-out"), ["left-out"]);
    assert_eq!(failed("hangs", "--case left-out --patience 1"), ["left-out"]);
    assert_eq!(failed("leaks", "--case growth --case outputs"), ["growth"]);
    // One that does not answer is asked once.
    assert_eq!(failed("hangs", "--patience 1"), ["outputs"]);
    // A tracer that does not answer, and a tool that panics.
    let faulty = example("faulty");
    let of_faulty = |unit: &str| {
        let line =
            format!("check {unit} --trust --plugin {faulty} --json --patience 1 --case outputs");
        let ended = desk.run(&line);
        assert_eq!(ended.code, 1, "{unit}");
        verdicts(&serde_json::from_str(&ended.stdout).unwrap())
    };
    for unit in ["hangs-in-tile", "panics-in-tile", "panics-in-run", "panics-in-frame"] {
        assert_eq!(of_faulty(unit)[0].2, "failed", "{unit}");
    }
    // What it says of itself is no failure.
    assert_eq!(failed("confesses", "--case normal --case turned"), [""; 0]);
}

#[test]
fn failures_come_with_pictures_and_the_command_to_see_them_again() {
    let desk = TestFolder::new();
    let plugin = example("wrong");
    let line = format!("check deeper right --trust --plugin {plugin} --case depth -o out");
    let ended = desk.run(&line);
    assert_eq!(ended.code, 1);
    assert!(ended.stdout.contains("failed   depth"), "{}", ended.stdout);
    assert!(ended.stdout.contains("2 units: 1 passed, 1 failed"), "{}", ended.stdout);
    for file in [
        "check.json",
        "check.xml",
        "org-surfelshop-test-wrong-renderer-deeper-depth-depth.png",
        "org-surfelshop-test-wrong-renderer-deeper-depth-depth.exr",
    ] {
        assert!(desk.at("out").join(file).is_file(), "{file}");
    }
    let xml = std::fs::read_to_string(desk.at("out/check.xml")).unwrap();
    assert!(xml.contains("failures=\"1\"") && xml.contains("<failure message="), "{xml}");
    let told: Value =
        serde_json::from_str(&std::fs::read_to_string(desk.at("out/check.json")).unwrap()).unwrap();
    let units = told["units"].as_array().unwrap();
    let wrong = units.iter().find(|unit| unit["unit"]["id"] == "deeper").unwrap();
    let again = wrong["cases"][0]["again"].as_str().unwrap();
    let again = again.strip_prefix("surfelshop ").unwrap();
    assert_eq!(desk.run(again).code, 1, "{again}");
}

#[test]
fn what_cannot_be_checked_is_one_line() {
    let desk = TestFolder::new();
    desk.run("check nobody").failed(&["nobody", "found none"]);
    let none = desk.run("check flat --case cancel");
    assert!(none.code == 1 && none.stderr.contains("nothing was checked"), "{}", none.stderr);
    desk.run("check flat --case nothing").failed(&["no such case", "silhouette"]);
    desk.run("check ./no/such/file.so").failed(&["no/such/file.so"]);
    let list = desk.run("check --list");
    assert_eq!(list.code, 0);
    assert!(
        list.stdout.contains("silhouette") && list.stdout.contains("tools:"),
        "{}",
        list.stdout
    );
}
