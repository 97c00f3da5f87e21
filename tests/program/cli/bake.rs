//! `surfelshop bake`: what it writes and says, and that a failure writes nothing.

use crate::cli::program::{Ended, TestFolder, facing_front, read_png};
use serde_json::json;
use surfelshop_tests::stage::build_folder;

/// The library of tools that misbehave, and of a few that do not.
pub(crate) fn faulty() -> String {
    example("faulty")
}

/// A library of the fixtures.
pub(crate) fn example(name: &str) -> String {
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let path = build_folder().join("examples").join(format!("{prefix}{name}{suffix}"));
    assert!(path.is_file(), "{} is not built; `cargo verify` builds it", path.display());
    path.to_string_lossy().into_owned()
}

/// A folder with `in.ply`, a row of surfels with a column of 16-bit numbers, and `out.ply`, which
/// is to be replaced or left alone.
pub(crate) fn desk(n_surfels: usize) -> TestFolder {
    let desk = TestFolder::new();
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {n_surfels}\n");
    for property in ["x", "y", "z", "nx", "ny", "nz", "radius"] {
        text += &format!("property float {property}\n");
    }
    text += "property ushort class\nend_header\n";
    for i in 0..n_surfels {
        text += &format!("{i} 0 0 0 0 1 0.5 {}\n", i % 1000);
    }
    desk.put("in.ply", &text);
    desk.put("out.ply", OLD);
    desk
}

/// What stands where the result is to be written.
pub(crate) const OLD: &str = "what stood there before\n";

/// Bakes `in.ply` to `out.ply` with the faulty plugin.
fn bake(desk: &TestFolder, arguments: &str) -> Ended {
    let plugin = faulty();
    let line = ["bake", "in.ply", "-o", "out.ply", "--trust", "--plugin", &plugin];
    desk.run_with(&line.into_iter().chain(arguments.split_whitespace()).collect::<Vec<_>>())
}

/// Expects that nothing was written.
#[track_caller]
pub(crate) fn assert_untouched(desk: &TestFolder) {
    assert_eq!(desk.files(), ["in.ply", "out.ply"]);
    assert_eq!(std::fs::read_to_string(desk.at("out.ply")).unwrap(), OLD);
}

#[test]
fn tools_run_one_after_the_other_and_all_is_told() {
    let desk = desk(10);
    let told = bake(&desk, "-t scatters -t keeps-half --set scatters:seed=7 --json").json();
    assert_eq!(told["surfels"], 5);
    assert_eq!(told["columns"], json!(["position", "normal", "radius", "class", "noise"]));
    let [scatters, half] = &told["steps"].as_array().unwrap()[..] else { panic!("{told}") };
    assert_eq!(scatters["tool"]["parameters"], json!({ "seed": 7 }));
    assert_eq!(scatters["tool"]["id"], "scatters");
    assert_eq!((&scatters["surfels_in"], &scatters["surfels_out"]), (&json!(10), &json!(10)));
    let noise = &scatters["columns"][0];
    assert_eq!((&noise["name"], &noise["type"]), (&json!("noise"), &json!("f32")));
    let number = |key: &str| noise[key].as_f64().unwrap();
    assert!(0.0 <= number("min") && number("min") < number("mean"), "{noise}");
    assert!(number("mean") < number("max") && number("max") < 1.0, "{noise}");
    assert_eq!((&half["whole_cloud"], &half["surfels_out"]), (&json!("kept"), &json!(5)));
    assert!(half["wall_seconds"].as_f64().unwrap() >= 0.0);
    let info = desk.run("info out.ply --full --json").json();
    let columns = info["clouds"][0]["columns"].as_array().unwrap();
    let class = columns.iter().find(|column| column["name"] == "class").unwrap();
    assert_eq!((&class["type"], &class["made"]), (&json!("u16"), &json!(null)));
    let noise = columns.iter().find(|column| column["name"] == "noise").unwrap();
    assert_eq!(noise["made"]["tool"], "org.surfelshop.test.faulty/scatters");
    assert_eq!((&noise["made"]["seed"], &noise["type"]), (&json!(7), &json!("f32")));
    let kept = &info["clouds"][0]["history"][0];
    assert_eq!((&kept["surfels"], &kept["surfels_before"]), (&json!(5), &json!(10)));
    let text = desk.run("info out.ply --full").done().stdout;
    assert!(text.contains("noise by org.surfelshop.test.faulty/scatters"), "{text}");
    assert!(
        text.contains("5 of 10 surfels kept by org.surfelshop.test.faulty/keeps-half"),
        "{text}"
    );
}

#[test]
fn the_result_is_in_words_too() {
    let desk = desk(10);
    let told = bake(&desk, "-t stages-ao").done().stdout;
    let [tool, file] = told.lines().collect::<Vec<_>>()[..] else { panic!("{told}") };
    let range = "; ao from 0.500000 to 0.500000, mean 0.500000; ";
    assert!(tool.starts_with("stages-ao: ") && tool.contains(range), "{tool}");
    assert_eq!(file, "out.ply: 10 surfels with position, normal, radius, class, ao");
    assert_eq!(desk.files(), ["in.ply", "out.ply"]);
}

#[test]
fn a_scene_with_one_cloud_is_baked_where_it_stands() {
    let desk = desk(10);
    let cloud = "[[clouds]]\npath = \"in.ply\"\n[clouds.transform]\nscale = 2.0\n";
    desk.put("a.scene.toml", &format!("format = 1\n{cloud}"));
    desk.put("b.scene.toml", &format!("format = 1\n{cloud}{cloud}"));
    let plugin = faulty();
    let bake = |scene| {
        desk.run_with(&[
            "bake",
            scene,
            "-t",
            "stages-ao",
            "-o",
            "new.ply",
            "--trust",
            "--plugin",
            &plugin,
        ])
    };
    bake("b.scene.toml").failed(&["b.scene.toml", "shows one cloud, found 2"]);
    bake("a.scene.toml").done();
    let info = desk.run("info new.ply --full --json").json();
    assert_eq!(info["clouds"][0]["radius_range"], json!([1.0, 1.0]));
}

#[test]
fn mistakes_are_found_before_anything_runs() {
    let desk = desk(3);
    bake(&desk, "-t stage-ao").failed(&["there is no tool `stage-ao`", "`stages-ao`?"]);
    bake(&desk, "-t ewa-phong").failed(&["there is no tool", "`ewa-phong` is a renderer"]);
    bake(&desk, "-t scatters --set sed=1").failed(&["tool `scatters`", "it has: seed"]);
    bake(&desk, "-t scatters --set seed=-1").failed(&["`seed` takes a whole number from 0 to"]);
    bake(&desk, "-t scatters --set ao:seed=1").failed(&["meant for `ao`", "used: scatters"]);
    bake(&desk, "-t scatters -t stages-ao --set seed=1").failed(&["say scatters:seed=1"]);
    bake(&desk, "").misused(&["--tool"]);
    assert_untouched(&desk);
    let line = ["bake", "in.ply", "-t", "stages-ao", "--trust", "--plugin", &faulty(), "-o"];
    let to = |out: &str| desk.run_with(&[&line[..], &[out]].concat());
    to("out.foo").failed(&["a name that ends in .ply", ".laz", "found `.foo`"]);
    to("out").misused(&["found no ending"]);
    to("no/out.ply").failed(&["no such folder"]);
    assert_untouched(&desk);
}

#[test]
fn a_tool_that_fails_writes_nothing() {
    let desk = desk(3);
    for (tool, words) in [
        ("stages-and-fails", "the tide is out"),
        ("panics-in-run", "run goes wrong"),
        ("wrong-length-edit", "column `ao`: expected 3 values, found 4"),
        // What ran before it is not written either.
        ("stages-ao -t panics-in-run", "run goes wrong"),
    ] {
        bake(&desk, &format!("-t {tool}")).failed(&["tool `org.surfelshop.test.faulty/", words]);
        assert_untouched(&desk);
    }
}

#[test]
fn the_input_may_be_the_output() {
    let desk = TestFolder::new();
    desk.put_cloud("one.ply", &[facing_front(0.0, 0.0, 1.0)]);
    let plugin = faulty();
    let line =
        ["bake", "one.ply", "-t", "stages-ao", "-o", "one.ply", "--trust", "--plugin", &plugin];
    desk.run_with(&line).done();
    desk.run_with(&line).done();
    assert_eq!(desk.files(), ["one.ply"]);
    let text = desk.run("info one.ply --full").done().stdout;
    assert_eq!(text.matches("ao by org.surfelshop.test.faulty/stages-ao").count(), 1, "{text}");
}

/// A pattern is written as linear floats, and one that is not there is named.
#[test]
fn patterns_are_baked_into_colours() {
    let desk = desk(8);
    let line = ["bake", "in.ply", "-o", "out.ply", "-t", "procedural"];
    let told = desk.run_with(
        &[&line[..], &["--set", "pattern=checker", "--set", "frequency=7"], &["--json"]].concat(),
    );
    let told = told.json();
    assert_eq!(told["columns"], json!(["position", "normal", "radius", "class", "color"]));
    assert_eq!(told["steps"][0]["columns"][0]["type"], json!("f32"));
    desk.run_with(&[&line[..], &["--set", "file=none.wgsl"]].concat())
        .failed(&["none.wgsl: No such file"]);
}

#[test]
fn columns_that_a_scene_cannot_scale_or_turn_are_named() {
    let desk = TestFolder::new();
    desk.put(
        "in.ply",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float \
         z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty float radius\nproperty \
         float scale_0\nproperty float rot_0\nproperty int label\nend_header\n0 0 0 0 0 1 1 2 1 7\n",
    );
    for (transform, done) in [
        ("scale = 2.5", Some("scaled by 2.5")),
        ("rotation = [0, 90, 0]", Some("turned")),
        ("scale = 2.5, rotation = [0, 90, 0]", Some("scaled by 2.5 and turned")),
        ("translation = [1, 2, 3]", None),
    ] {
        desk.put(
            "a.scene.toml",
            &format!("format = 1\n[[clouds]]\npath = 'in.ply'\ntransform = {{ {transform} }}\n"),
        );
        let told = desk.run("bake a.scene.toml -t radii -o out.ply").done().stdout;
        let warning = told.lines().find(|line| line.contains("stayed as they were"));
        match done {
            Some(done) => {
                let warning = warning.unwrap_or_else(|| panic!("{transform}: {told}"));
                assert!(
                    warning.contains(&format!("{done}; `scale_0`, `rot_0` stayed")),
                    "{warning}"
                );
            }
            None => assert_eq!(warning, None, "{transform}"),
        }
        let object = desk.run("bake a.scene.toml -t radii -o out.ply --json").json();
        let warnings = object["cloud"]["warnings"].as_array().unwrap();
        assert_eq!(warnings.len(), usize::from(done.is_some()), "{warnings:?}");
    }
}

/// Discs that overlap on a lattice, as splats of the usual size: little shines through where four of them meet, and as
/// ellipses for other renderers they leave no hole. Costs 2 s.
#[test]
fn gaussians_of_surfels_that_close_a_plane_close_it() {
    let folder = TestFolder::new();
    let surfels: Vec<_> =
        (0..400).map(|i| facing_front((i % 20) as f32, (i / 20) as f32, 0.9)).collect();
    folder.put_cloud("plane.ply", &surfels);
    folder.run("bake plane.ply -t gaussians -o splats.ply").done();
    for renderer in ["gaussians", "gaussians-2d", "ewa-phong"] {
        let camera = "--camera 9.5,9.5,10;9.5,9.5,0 --orthographic --size 64 -o a.png";
        folder.run(&format!("render splats.ply -r {renderer} {camera}")).done();
        let picture = read_png(&folder.at("a.png"));
        let thinnest = picture.pixels().map(|pixel| pixel[3]).min().unwrap();
        assert!(thinnest > 230, "{renderer}: {thinnest} of 255");
    }
}

/// Costs 1 s.
///
/// Invariant: what suits a cloud draws it where nobody says a renderer, with what is typed for that
#[test]
fn settings_choose_no_renderer_that_does_not_know_them() {
    let folder = TestFolder::new();
    folder.put_cloud("one.ply", &[facing_front(0.0, 0.0, 1.0)]);
    folder.run("bake one.ply -t gaussians -o splats.ply").done();
    let drawn = |options: &str| {
        let ended = folder.run(&format!("render splats.ply -o a.png --size 16 {options}"));
        ended.done().stdout
    };
    assert!(drawn("").contains(", gaussians in "), "{}", drawn(""));
    assert!(drawn("--set blend=additive").contains(", gaussians in "));
    // It is meant where it knows what is typed.
    assert!(drawn("--set specular=0").contains(", ewa-phong in "));
    let refused = folder.run("render splats.ply -o a.png --set wings=2");
    refused.failed(&["renderer `gaussians` has no parameter `wings`"]);
    let explained = folder.run("explain splats.ply --size 16 --set order=0").done().stdout;
    assert!(explained.contains("gaussians"), "{explained}");
}

/// A file of one stroke over all of a row of surfels, which told of `n` surfels, and of these `among` them; and one that is
/// far away, of another cloud.
fn strokes(n: usize, among: &str) -> String {
    let stroke = |x: f64, n: usize, among: &str| {
        json!({
            "tool": "brush", "values": { "color": [1.0, 0.0, 0.0] }, "n_surfels": n, "among": among,
            "stroke": { "radius": 30.0, "samples": [{ "place": [x, 0, 0], "normal": [0, 0, 1] }] },
        })
    };
    let all = [stroke(5.0, n, among), stroke(1e4, 77, "TQIC")];
    json!({ "format": "surfelshop strokes", "version": 1, "strokes": all }).to_string()
}

/// Invariant: a stroke that left surfels out does so again, over the cloud that it was led over and no other; nothing is
/// written where nothing would be left
#[test]
fn strokes_over_some_surfels_concern_the_same_ones_again() {
    let desk = desk(10);
    desk.put("some.json", &strokes(10, "CgIC"));
    let told = desk.run("bake in.ply -t brush --strokes some.json -o out.ply --json").json();
    assert_eq!(told["steps"][0]["surfels_concerned"], 2, "{told}");
    for (text, words) in [
        (strokes(11, "CwIC"), "in a cloud of 11, and this one has 10"),
        (strokes(10, "FQoL"), "expected one of 10 surfels, found one of 21"),
        (strokes(10, "?"), "expected surfels by number, in base64"),
        (strokes(10, "CgIC").replace("brush", "eraser"), "no parameter `color`"),
        ("\u{1}\u{2}".to_owned(), "expected a file of strokes"),
    ] {
        desk.put("other.json", &text);
        let baked = desk.run("bake in.ply -t brush -t eraser --strokes other.json -o new.ply");
        baked.failed(&[words]);
    }
    let erased = desk.run("bake in.ply -t eraser -o new.ply");
    erased.failed(&["eraser", "takes all 10 surfels away"]);
    assert!(!desk.files().iter().any(|file| file == "new.ply"));
}
