//! `info`, `plugins` and `convert`.

use crate::cli::program::{TestFolder, facing_front};
use surfelshop_tests::stage::build_folder;

#[test]
fn info_counts_points_and_names_columns() {
    let desk = TestFolder::new();
    desk.put_cloud("two.ply", &[facing_front(0.0, 0.0, 0.5), facing_front(3.0, -4.0, 0.25)]);
    let info = desk.run("info two.ply --full --json").json();
    let cloud = &info["clouds"][0];
    assert_eq!(cloud["summary"]["n_surfels"], 2);
    assert_eq!(cloud["summary"]["normals"]["given"], 2);
    assert_eq!(cloud["facts"]["bounds_max"][0], 3.0);
    assert_eq!(cloud["radius_range"][0], 0.25);
    assert_eq!(cloud["columns"][0]["name"], "position");
    assert_eq!(cloud["columns"][0]["type"], "f32");
    assert_eq!(cloud["bytes"], 2 * 7 * 4);
    let text = desk.run("info two.ply two.ply --full").done().stdout;
    assert_eq!(text.matches("two.ply").count(), 2, "{text}");
    for word in ["2 given", "position 3 x f32", "0 -4 0 to 3 0 0", "56 B"] {
        assert!(text.contains(word), "`{word}` is missing in: {text}");
    }
}

/// Nothing is estimated and no cloud is kept: the head, and where it lacks bounds one look at the positions.
#[test]
fn info_tells_points_bounds_and_columns_without_loading() {
    let desk = TestFolder::new();
    desk.put_cloud("two.ply", &[facing_front(0.0, 0.0, 0.5), facing_front(3.0, -4.0, 0.25)]);
    let cloud = desk.run("info two.ply --json").json()["clouds"][0].clone();
    assert_eq!((&cloud["n_points"], &cloud["bounds"][1][0]), (&2.into(), &3.0.into()));
    let names = cloud["header"]["columns"].as_array().unwrap().iter().map(|column| &column["name"]);
    assert_eq!(names.collect::<Vec<_>>(), ["position", "normal", "radius"]);
    assert!(cloud["summary"].is_null(), "{cloud}");
    let text = desk.run("info two.ply").done().stdout;
    for word in ["PLY, ascii", "points    2\n", "0 -4 0 to 3 0 0", "normal 3 x f32", "read in"] {
        assert!(text.contains(word), "`{word}` is missing in: {text}");
    }
    assert!(!text.contains("estimated") && !text.contains("given"), "{text}");
}

#[test]
fn info_says_what_was_dropped_and_estimated() {
    let desk = TestFolder::new();
    let mut text = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n\
                    property float z\nend_header\n"
        .to_owned();
    text += "0 0 0\n1 0 0\n0 1 0\n1 1 0\nnan 0 0\n";
    desk.put("bare.ply", &text);
    let cloud = desk.run("info bare.ply --full --json").json()["clouds"][0].clone();
    assert_eq!(cloud["summary"]["n_dropped"], 1);
    assert_eq!(cloud["summary"]["normals"]["estimated"], 4);
    assert_eq!(cloud["summary"]["radii"]["estimated"], 4);
    let text = desk.run("info bare.ply --full").done().stdout;
    assert!(text.contains("4; 1 of 5 dropped") && text.contains("4 estimated"), "{text}");
}

#[test]
fn info_of_an_empty_cloud_is_no_failure() {
    let desk = TestFolder::new();
    desk.put_cloud("none.ply", &[]);
    let info = |line: &str| desk.run(line).json()["clouds"][0].clone();
    assert_eq!(info("info none.ply --full --json")["summary"]["n_surfels"], 0);
    assert_eq!(info("info none.ply --json")["n_points"], 0);
    for command in ["info none.ply", "info none.ply --full"] {
        assert!(desk.run(command).done().stdout.contains("points    0"), "{command}");
    }
}

#[test]
fn plugins_lists_units_and_the_places_searched() {
    let desk = TestFolder::new();
    let list = desk.run("plugins list --json").json();
    let plugins = list["plugins"].as_array().unwrap();
    for id in ["flat", "ewa-phong"] {
        let plugin = plugins.iter().find(|p| p["manifest"]["units"][0]["id"] == id).unwrap();
        assert_eq!(plugin["state"], "available");
        assert_eq!(plugin["manifest"]["units"][0]["kind"], "renderer");
        assert_eq!(plugin["manifest"]["abi_major"], 3);
    }
    let searched = list["searched"].as_array().unwrap();
    let beside = build_folder().display().to_string();
    assert!(searched.iter().any(|place| place["path"] == beside.as_str()), "{searched:?}");
    let text = desk.run("plugins").done().stdout;
    assert!(text.contains("flat (Flat surfels)") && text.contains("looked in:"), "{text}");
    assert!(text.contains(&beside), "{text}");
}

#[test]
fn refused_plugins_are_listed_with_the_reason_and_are_no_failure() {
    let desk = TestFolder::new();
    desk.put("bad.so", "not a library");
    let list = desk.run("plugins --plugin bad.so --plugin gone.so --json").json();
    let plugins = list["plugins"].as_array().unwrap();
    for (file, reason) in [("bad.so", "not a shared library"), ("gone.so", "does not exist")] {
        let plugin = plugins.iter().find(|plugin| plugin["file"] == file).unwrap();
        assert_eq!(plugin["state"], "refused");
        assert!(plugin["reason"].as_str().unwrap().contains(reason), "{plugin}");
    }
    let text = desk.run("plugins --plugin bad.so").done().stdout;
    assert!(text.contains("refused: bad.so is not a shared library"), "{text}");
}

#[test]
fn convert_keeps_the_cloud() {
    let desk = TestFolder::new();
    desk.put_cloud("two.ply", &[facing_front(0.0, 0.0, 0.5), facing_front(3.0, -4.0, 0.25)]);
    let line = desk.run("convert two.ply binary.ply").done().stdout;
    assert_eq!(line, "binary.ply: 2 points with position, normal, radius\n");
    desk.run("convert binary.ply text.ply --ascii --json").json();
    assert!(std::fs::read_to_string(desk.at("text.ply")).unwrap().contains("format ascii"));
    let facts = |file: &str| {
        desk.run(&format!("info {file} --full --json")).json()["clouds"][0]["facts"].clone()
    };
    assert_eq!(facts("two.ply"), facts("binary.ply"));
    assert_eq!(facts("two.ply"), facts("text.ply"));
    assert_eq!(desk.files(), ["binary.ply", "text.ply", "two.ply"]);
}

#[test]
fn convert_estimates_where_it_is_asked_to() {
    let desk = TestFolder::new();
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float \
                z\nend_header\n0 0 0\n1 0 0\n0 1 0\nnan 1 0\n";
    desk.put("bare.ply", text);
    let columns = |told: serde_json::Value| told["columns"].as_array().unwrap().len();
    assert_eq!(columns(desk.run("convert bare.ply as-it-is.ply --json").json()), 1);
    assert_eq!(columns(desk.run("convert bare.ply whole.ply --estimate --json").json()), 3);
    let given = desk.run("info whole.ply --full --json").json()["clouds"][0]["summary"].clone();
    assert_eq!((&given["n_surfels"], &given["normals"]["given"]), (&3.into(), &3.into()));
    let line = desk.run("convert bare.ply as-it-is.ply").done().stdout;
    let expected = "3 of 4 points with position; 1 without finite coordinates were left out\n";
    assert_eq!(line, format!("as-it-is.ply: {expected}"));
    desk.run("convert bare.ply bare.ply b.ply --estimate")
        .failed(&["--estimate works on one file"]);
    desk.run("convert bare.ply b.ply --estimate --every 2").failed(&["--estimate takes a whole"]);
}
