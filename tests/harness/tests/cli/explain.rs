//! `surfelshop explain`: what a frame is made of, and what was left out of it.

use crate::program::{Desk, facing_front};
use serde_json::Value;

fn desk() -> Desk {
    let desk = Desk::new();
    desk.put_cloud("two.ply", &[facing_front(-0.5, 0.0, 1.0), facing_front(0.7, 0.2, 0.6)]);
    desk
}

fn explained(desk: &Desk, more: &str) -> Value {
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
    for (lacking, saved) in [("color", 8), ("ao", 8), ("material", 8), ("tangent_u", 40)] {
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
