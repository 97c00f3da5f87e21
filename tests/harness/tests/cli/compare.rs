//! `surfelshop compare`: its page, its numbers, and what it makes of renderers that go wrong.

use crate::bake::faulty;
use crate::program::{Desk, facing_front};
use serde_json::json;

fn desk() -> Desk {
    let desk = Desk::new();
    desk.put_cloud("two.ply", &[facing_front(-0.5, 0.0, 1.0), facing_front(0.7, 0.2, 0.6)]);
    desk
}

const SMALL: &str = "--size 48 --camera front --repeats 2";

#[test]
fn a_comparison_is_a_page_tables_and_pictures() {
    let desk = desk();
    let told =
        desk.run(&format!("compare two.ply -r flat -r ewa-phong -o out {SMALL} --json")).json();
    assert_eq!(told["reference"], "flat");
    let [flat, phong] = &told["renderers"].as_array().unwrap()[..] else { panic!("{told}") };
    assert_eq!(flat["comparison"]["errors"]["rmse"], json!(0.0), "itself");
    assert!(phong["comparison"]["errors"]["rmse"].as_f64().unwrap() > 1e-3);
    assert_eq!(phong["frames_ms"].as_array().unwrap().len(), 2);
    for file in [
        "index.html",
        "metrics.csv",
        "metrics.json",
        "flat.png",
        "ewa-phong.exr",
        "ewa-phong-FLIP.png",
    ] {
        assert!(desk.at("out").join(file).is_file(), "{file}");
    }
    let page = std::fs::read_to_string(desk.at("out/index.html")).unwrap();
    assert!(!page.contains("http://") && !page.contains("https://"));
    assert!(page.contains("data:image/png;base64,"));
    let csv = std::fs::read_to_string(desk.at("out/metrics.csv")).unwrap();
    assert_eq!(csv.lines().count(), 3);
}

#[test]
fn a_picture_serves_as_reference_and_limits_decide_the_exit() {
    let desk = desk();
    desk.run("render two.ply -r flat -o flat.exr --size 48 --camera front").done();
    let line = format!("compare two.ply -r flat --reference flat.exr -o out {SMALL}");
    let same = desk.run(&format!("{line} --fail-above rmse=0.000001")).done();
    assert!(same.stdout.contains("flat: RMSE 0.00000"), "{}", same.stdout);
    let line = line.replace("-r flat", "-r ewa-phong");
    desk.run(&format!("{line} --fail-above rmse=0.000001"))
        .failed(&["rmse of `ewa-phong` is 0.", "above"]);
    assert!(desk.at("out/index.html").is_file(), "the page is there all the same");
    desk.run(&format!("{line} --fail-above beauty=1")).failed(&["has no beauty", "rmse, rel_mse"]);
    desk.run(&format!("{line} --fail-above rmse")).misused(&["METRIC=VALUE"]);
    desk.run(&format!("{line} --set shine=1")).failed(&["shine=1", "none of the renderers"]);
    let none = line.replace("flat.exr", "none.exr");
    desk.run(&none).failed(&["none.exr: it has no colours to read"]);
}

#[test]
fn tracers_are_compared_and_their_noise_is_told() {
    let desk = desk();
    let line = "compare two.ply -r flat --reference reference --set reference:samples=4";
    let told = desk.run(&format!("{line} --light 0,0,1 -o out {SMALL} --json")).json();
    assert_eq!(told["reference"], "reference");
    let flat = &told["renderers"][0]["comparison"];
    assert!(flat["errors"]["reference_noise"]["mse"].as_f64().unwrap() >= 0.0, "{flat}");
    // A white square of light that both see alike, but for the ambient light of `flat`.
    assert!(flat["errors"]["rmse"].as_f64().unwrap() < 0.2, "{flat}");
}

#[test]
fn what_goes_wrong_is_marked_and_not_averaged_in() {
    let desk = desk();
    let plugin = faulty();
    let line = format!("compare two.ply -r flat -r not-finite -r panics-in-frame -o out {SMALL}");
    let ended = desk.run(&format!("{line} --plugin {plugin}"));
    assert_eq!(ended.code, 1, "{}", ended.stderr);
    assert!(ended.stderr.contains("pixels of `not-finite` are not finite"), "{}", ended.stderr);
    let json = std::fs::read_to_string(desk.at("out/metrics.json")).unwrap();
    let told: serde_json::Value = serde_json::from_str(&json).unwrap();
    let [flat, nan, panics] = &told["renderers"].as_array().unwrap()[..] else { panic!("{told}") };
    assert_eq!(flat["comparison"]["errors"]["rmse"], json!(0.0));
    assert!(nan["comparison"]["errors"].is_null());
    assert!(nan["comparison"]["n_not_finite"].as_u64().unwrap() > 0);
    assert!(panics["error"].as_str().unwrap().contains("panic"), "{panics}");
    let csv = std::fs::read_to_string(desk.at("out/metrics.csv")).unwrap();
    assert!(csv.contains("pixels are not finite"), "{csv}");
}
