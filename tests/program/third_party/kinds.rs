//! `surfelshop plugins new`, of every kind.

use crate::third_party::project::{build, cargo, command, project, root, surfelshop};
use std::path::PathBuf;
use std::process::Command;

/// Builds a project of a kind, without a warning, and runs it through every case; its folder and its library.
fn passes(kind: &str) -> (PathBuf, PathBuf) {
    let project = project(&format!("my-{kind}"), kind);
    let library = build(&project, &["--release"], "release");
    let checked = surfelshop(&["check", library.to_str().unwrap(), "--trust"]);
    let told = String::from_utf8_lossy(&checked.stdout);
    let line = told.lines().last().unwrap_or_default();
    assert!(checked.status.success() && line.starts_with("1 unit: "), "{told}");
    // No case is let off by a limit. That of stopping is left out where a tool is done before it is asked.
    assert!(line.contains(", 0 failed, 0 limited, "), "{line}");
    (project, library)
}

/// Invariant: projects of all kinds build, load and pass every case of `check`, without a
/// warning
#[test]
fn a_shading_project_builds_loads_and_passes_every_case() {
    passes("shading");
}

#[test]
fn a_graph_project_builds_loads_and_passes_every_case() {
    passes("graph");
}

#[test]
fn a_splat_project_builds_loads_passes_every_case_and_draws_through_opengl() {
    let (project, library) = passes("splat");
    let sample = root().join("assets/sample.ply");
    // Half a second each.
    let drawn = |backend: &str| {
        let picture = project.join(format!("{backend}.png"));
        let ended = command(&["render"])
            .arg(&sample)
            .arg("--plugin")
            .arg(&library)
            .args(["--trust", "-r", "my-splat", "--backend", backend, "--size", "96", "-o"])
            .arg(&picture)
            .output()
            .unwrap();
        assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
        image::open(picture).unwrap().into_rgba8()
    };
    let (vulkan, opengl) = (drawn("vulkan"), drawn("gl"));
    // The drivers round differently, and 8 bits again.
    let off = vulkan.iter().zip(opengl.iter()).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(off.is_some_and(|off| off <= 2), "off by {off:?} of 255");
    assert!(vulkan.iter().any(|value| *value > 0), "the picture is empty");
}

#[test]
fn a_tool_project_builds_loads_and_passes_every_case() {
    passes("tool");
}

#[test]
fn a_tracer_project_builds_loads_and_passes_every_case() {
    passes("tracer");
}

#[test]
fn a_format_project_builds_loads_passes_every_case_and_its_own_tests() {
    let (project, _) = passes("format");
    let tested = cargo(&project, &["test", "--release"], &[]);
    let told = String::from_utf8_lossy(&tested.stdout);
    assert!(tested.status.success(), "{told}{}", String::from_utf8_lossy(&tested.stderr));
    assert!(told.contains("test result: ok. 4 passed"), "{told}");
}

#[test]
fn projects_are_formatted() {
    for kind in ["shading", "graph", "splat", "tool", "brush", "tracer", "format"] {
        let project = project(&format!("tidy-{kind}"), kind);
        // As its author has it, who has no settings, and not as this checkout has it.
        std::fs::write(project.join("rustfmt.toml"), "").unwrap();
        let formatted = Command::new("rustfmt")
            .args(["--check", "--edition", "2024"])
            .arg(project.join("src/lib.rs"))
            .output()
            .unwrap();
        assert!(formatted.status.success(), "{}", String::from_utf8_lossy(&formatted.stdout));
    }
}
