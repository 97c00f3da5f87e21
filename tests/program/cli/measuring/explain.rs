//! `surfelshop explain`: what a frame is made of, and what was left out of it.

use crate::cli::program::{TestFolder, facing_front};
use serde_json::Value;

fn desk() -> TestFolder {
    let desk = TestFolder::new();
    desk.put_cloud("two.ply", &[facing_front(-0.5, 0.0, 1.0), facing_front(0.7, 0.2, 0.6)]);
    desk
}

fn explained(desk: &TestFolder, more: &str) -> Value {
    let line = format!("explain two.ply --size 64 --json {more}");
    desk.run(&line).json()["explained"].clone()
}

/// A part of a list by the name of its entries.
fn of<'a>(list: &'a Value, key: &str, name: &str) -> &'a Value {
    let found = list.as_array().unwrap().iter().find(|one| one[key] == name);
    found.unwrap_or_else(|| panic!("no {name} in {list}"))
}

#[test]
fn columns_that_are_read_and_lacking_are_told_with_their_bytes() {
    let desk = desk();
    let told = explained(&desk, "-r flat");
    let column = |name: &str| of(&told["columns"], "name", name).clone();
    assert_eq!(
        (&column("position")["read"], &column("position")["bytes"]),
        (&true.into(), &24.into())
    );
    for (lacking, saved) in [("color", 8), ("ao", 8), ("material", 0), ("tangent_u", 40)] {
        let column = column(lacking);
        assert_eq!(
            (&column["read"], &column["bytes"]),
            (&false.into(), &saved.into()),
            "{lacking}"
        );
        assert!(column["why"].as_str().unwrap().contains(lacking), "{column}");
    }
}

/// What nothing that was asked for depends on does not run, and that is said.
///
/// Invariant: what a frame is made of, and what is left out of it, is told with reasons
#[test]
fn passes_are_told_with_what_they_feed() {
    let desk = desk();
    let told = explained(&desk, "-r ewa-phong --output depth");
    let passes = told["passes"].as_array().unwrap();
    let culled: Vec<&Value> = passes.iter().filter(|pass| pass["state"] == "culled").collect();
    assert!(!culled.is_empty(), "{told}");
    for pass in culled {
        let why = pass["why"].as_str().unwrap();
        assert!(why.contains("`color`") && why.contains("not asked for"), "{why}");
    }
    let whole = explained(&desk, "-r ewa-phong --output color");
    assert!(whole["passes"].as_array().unwrap().iter().all(|pass| pass["state"] != "culled"));
    assert_eq!(of(&whole["outputs"], "name", "color")["wanted"], true);
    let made = whole["resources"].as_array().unwrap();
    assert!(made.iter().any(|one| one["made"] == true && one["bytes"].as_u64().unwrap() > 0));
}

/// What a graph has of its own besides passes is told by its name.
#[test]
fn cameras_surfels_as_data_and_what_is_kept_are_told() {
    let desk = desk();
    let little = "--set vpls=32 --set ism-size=128 --set bounces=1 --set light-map=64";
    for (surfels, first) in [("cpu", "surfels: processor"), ("quads", "surfels: visibility")] {
        let told =
            explained(&desk, &format!("-r global-illumination {little} --surfels {surfels}"));
        for name in [first.to_owned(), format!("{first} (light 1)")] {
            let pass = of(&told["passes"], "name", &name);
            assert_eq!(pass["why"], "draws surfels for what follows", "{pass}");
        }
        let what = |what: &str| {
            let all = told["resources"].as_array().unwrap();
            all.iter().filter(|one| one["what"] == what && one["made"] == true).count()
        };
        assert_eq!(what("buffer of the scene's surfels"), 1, "{told}");
        assert!(what("buffer, kept from frame to frame") > 0, "{told}");
        assert!(what("buffer") > 0);
    }
}

#[test]
fn how_surfels_were_drawn_is_told() {
    let desk = desk();
    let lines = |more: &str| explained(&desk, more)["surfels"].to_string();
    assert!(lines("--surfels quads").contains("as quads"));
    assert!(lines("--surfels compute").contains("by compute"));
    assert!(lines("--surfels cpu").contains("by the processor"));
    assert!(lines("").contains("no detail was asked for"));
    assert!(lines("-r flat --detail 1").contains("take no merged surfels"));
    assert!(lines("--detail 1").contains("merged where one of at most 1 px"));
    let told = desk.run("explain two.ply --size 64");
    assert_eq!(told.code, 0);
    for section in ["columns:", "passes:", "adapter:", "plugins not loaded"] {
        assert!(told.stdout.contains(section), "{}", told.stdout);
    }
    desk.run("explain two.ply -r reference").failed(&["expected a renderer"]);
}

/// A column that nothing reads stays where it is, and what is left out changes nothing where it is put back.
#[test]
fn what_leaving_out_saves_is_measured_and_changes_nothing() {
    let desk = desk();
    let depth = explained(&desk, "-r ewa-phong --output depth");
    assert!(of(&depth["columns"], "name", "radius")["read"] == true, "{depth}");
    let line = "explain two.ply --size 32 --json -r ewa-phong --set specular=0 --measure 3";
    let told = desk.run(line).json();
    let savings = told["savings"].as_array().unwrap();
    let what: Vec<&str> = savings.iter().map(|saving| saving["what"].as_str().unwrap()).collect();
    for expected in [
        "column color",
        "feature surfelshop::occlusion::COUNTS",
        "feature surfelshop::phong::HIGHLIGHTS",
        "output depth",
    ] {
        assert!(what.contains(&expected), "{what:?}");
    }
    for saving in savings {
        assert_eq!(saving["differing"], 0, "{saving}");
        assert!(saving["saved_ms"].is_number() && saving["without_ms"].is_number(), "{saving}");
    }
    let normal = of(&told["savings"], "what", "output normal");
    assert_eq!((&normal["saved_passes"], &normal["saved_pipelines"]), (&1.into(), &1.into()));
    // Distances that the CPU knows pass through no shader.
    for (surfels, of_depth) in [("quads", 1), ("compute", 1), ("cpu", 0)] {
        let line = format!("explain two.ply --size 32 --json --measure 1 --surfels {surfels}");
        let told = desk.run(&line).json();
        let column = of(&told["savings"], "what", "column ao");
        assert_eq!(column["saved_passes"], 0, "{surfels}: {column}");
        let depth = of(&told["savings"], "what", "output depth");
        assert_eq!(depth["saved_passes"], of_depth, "{surfels}: {depth}");
    }
    let lines = desk.run("explain two.ply --size 32 -r flat --measure 1").stdout;
    assert!(lines.contains("what leaving out saves, frames with each in turns: 1"), "{lines}");
    assert!(lines.contains("the same picture, bit by bit"), "{lines}");
}
