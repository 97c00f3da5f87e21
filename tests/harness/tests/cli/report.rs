//! `surfelshop report`: what is swept, what is kept, and what it says.

use crate::bake::faulty;
use crate::program::{Desk, facing_front};
use serde_json::Value;

fn desk() -> Desk {
    let desk = Desk::new();
    desk.put_cloud("two.ply", &[facing_front(-0.5, 0.0, 1.0), facing_front(0.7, 0.2, 0.6)]);
    desk
}

const SMALL: &str = "--size 40 --camera front --repeats 3";

fn cells(told: &Value) -> Vec<Value> {
    told["knobs"]
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|knob| knob["cells"].as_array().unwrap().clone())
        .collect()
}

#[test]
fn a_stranger_s_knob_is_swept_over_its_range() {
    let (desk, plugin) = (desk(), faulty());
    let line = format!("report two.ply -r fine --reference flat -o out {SMALL} --plugin {plugin}");
    let told = desk.run(&format!("{line} --json")).json();
    assert_eq!(told["knobs"][0]["id"], "steps", "the one that trades time for quality");
    let cells = cells(&told);
    let values: Vec<&str> = cells.iter().map(|cell| cell["value"].as_str().unwrap()).collect();
    assert_eq!((values[0], values.last()), ("1", Some(&"64")));
    assert!(cells.iter().all(|cell| cell["frames_ms"].as_array().unwrap().len() == 3));
    for file in ["index.html", "report.csv", "report.json", "steps.svg", "cells.json"] {
        assert!(desk.at("out").join(file).is_file(), "{file}");
    }
    let csv = std::fs::read_to_string(desk.at("out/report.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + cells.len());
    let page = std::fs::read_to_string(desk.at("out/index.html")).unwrap();
    assert!(
        !page.replace("http://www.w3.org/2000/svg", "").contains("http"),
        "no address but a name"
    );
}

/// Errors fall as the knob says; what was measured stays, to the last bit of its times, until something
/// that it depends on is another.
#[test]
fn what_was_measured_is_kept_until_something_is_another() {
    let (desk, plugin) = (desk(), faulty());
    let run = |knob: &str, more: &str| {
        let line = format!("report two.ply -r fine -o out {SMALL} --plugin {plugin} {more}");
        cells(&desk.run(&format!("{line} --knob gain={knob} --json")).json())
    };
    let first = run("0.25,0.5", "");
    let rmse = |cell: &Value| cell["errors"][0][1].as_f64().unwrap();
    assert_eq!(first[0]["errors"][0][0], "rmse");
    assert!(rmse(&first[0]) > rmse(&first[1]), "nearer to the default, which is the reference");
    let more = run("0.25,0.5,1", "");
    assert_eq!(more[..2], first[..]);
    assert!(rmse(&more[2]).abs() < 1e-7);
    // Another light, other numbers.
    let other = run("0.25,0.5,1", "--background white --exposure 1");
    assert_ne!(other[0]["frames_ms"], more[0]["frames_ms"]);
    assert_eq!(run("1", "--background white --exposure 1")[0], other[2]);
}

#[test]
fn what_cannot_be_reported_is_one_line() {
    let (desk, plugin) = (desk(), faulty());
    let line = format!("report two.ply -o out {SMALL} --plugin {plugin}");
    let flat = format!("{line} -r flat");
    desk.run(&flat).failed(&["declares no parameter that trades time for quality", "ambient"]);
    desk.run(&format!("{flat} --knob shine=1,2")).failed(&["no parameter `shine`"]);
    desk.run(&format!("{flat} --knob ambient=1,two")).failed(&["found `two`"]);
    desk.run(&format!("{flat} --knob ambient=0.5 --reference none")).failed(&["none"]);
    let nan = format!("{line} -r fine --knob gain=1 --reference not-finite");
    assert_eq!(desk.run(&nan).code, 1);
    desk.put("out/cells.json", "nonsense");
    desk.run(&format!("{flat} --knob ambient=0.5")).failed(&["cells.json: it is no list of cells"]);
}
