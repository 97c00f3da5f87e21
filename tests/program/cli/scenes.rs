//! Scenes: what `render` and `info` make of them.

use crate::cli::program::{TestFolder, facing_front, read_png};
use std::path::Path;

/// Two discs and a scene in which nothing is as usual.
fn desk() -> TestFolder {
    let desk = TestFolder::new();
    desk.put_cloud("left.ply", &[facing_front(-2.0, 0.0, 1.0)]);
    desk.put_cloud("right.ply", &[facing_front(2.0, 0.0, 1.0)]);
    desk.put("a.scene.toml", SCENE);
    desk
}

const SCENE: &str = r##"format = 1
exposure = 0.5
tone_map = "neutral"
background = "#dfe3e4"

[[lights]]
towards = [-0.6, 1.0, 0.7]
radiance = [1.0, 0.95, 0.85]

[[lights]]
towards = [1.0, 0.3, 0.6]
radiance = [0.3, 0.35, 0.5]

[surface]
two_sided = false
radius_scale = 1.25
low_pass = 0.5
depth_tolerance = 0.75

[camera]
eye = [0.9, 1.95, 5.9]
target = [-0.02, 0.1, 0.0]
fov = 45.3

[[clouds]]
path = "left.ply"

[[clouds]]
path = "right.ply"

[[views]]
renderer = "ewa-phong"
[views.values]
shininess = 16
specular = 0.25

[[views]]
renderer = "flat"
output = "normal"
[views.camera]
eye = [0.0, 0.0, 9.0]
target = [0.0, 0.0, 0.0]
height = 5.0
"##;

/// The first view of that scene as options.
const OPTIONS: [&str; 23] = [
    "--exposure",
    "0.5",
    "--tone-map",
    "neutral",
    "--background",
    "#dfe3e4",
    "--light",
    "-0.6,1,0.7:1,0.95,0.85",
    "--light",
    "1,0.3,0.6:0.3,0.35,0.5",
    "--one-sided",
    "--radius-scale",
    "1.25",
    "--low-pass",
    "0.5",
    "--depth-tolerance",
    "0.75",
    "--camera",
    "0.9,1.95,5.9; -0.02,0.1,0; 0,1,0; 45.3",
    "--set",
    "shininess=16",
    "--set",
    "specular=0.25",
];

fn pixels(desk: &TestFolder, arguments: &[&str]) -> Vec<u8> {
    let common = ["render", "--size", "96x64", "-o", "a.png"];
    desk.run_with(&[&common[..], arguments].concat()).done();
    read_png(&desk.at("a.png")).into_raw()
}

fn same_pixels(desk: &TestFolder, one: &[&str], other: &[&str]) {
    let (one, other) = (pixels(desk, one), pixels(desk, other));
    assert!(one.chunks(4).any(|pixel| pixel != &one[..4]), "something is to be seen");
    assert!(one == other, "the pictures differ");
}

/// Invariant: a scene and the same options give the same pixels
#[test]
fn a_scene_and_the_same_options_give_the_same_pixels() {
    let desk = desk();
    let options = [&["left.ply", "right.ply"], &OPTIONS[..]].concat();
    same_pixels(&desk, &["a.scene.toml"], &options);
    // What is typed about the lens applies to the scene's camera.
    let lens = ["--zoom", "1.5", "--orthographic"];
    same_pixels(&desk, &[&["a.scene.toml"], &lens[..]].concat(), &[&options[..], &lens].concat());
    let lens = ["--zoom", "1.5", "--fov", "30"];
    same_pixels(&desk, &[&["a.scene.toml"], &lens[..]].concat(), &[&options[..], &lens].concat());
}

#[test]
fn typed_options_count_instead_of_the_scene_s() {
    let desk = desk();
    let typed = [
        "--exposure",
        "0",
        "--tone-map",
        "clamp",
        "--background",
        "transparent",
        "--light",
        "0,0,1",
        "--one-sided=false",
        "--radius-scale",
        "1",
        "--low-pass",
        "1",
        "--depth-tolerance",
        "1",
        "--camera",
        "front",
        "--set",
        "specular=0.5",
        "--set",
        "shininess=64",
        "-r",
        "ewa-phong",
    ];
    let plain = [&["left.ply", "right.ply"], &typed[..]].concat();
    same_pixels(&desk, &[&["a.scene.toml"], &typed[..]].concat(), &plain);
    let report = desk.run("render a.scene.toml -o a.png --size 8 --set specular=0.5 --json").json();
    let parameters = &report["renderer"]["parameters"];
    assert_eq!(
        (parameters["specular"].as_f64(), parameters["shininess"].as_f64()),
        (Some(0.5), Some(16.0))
    );
    assert_eq!(report["scene_file"], "a.scene.toml");
    assert_eq!(report["scene"]["exposure_stops"], 0.5);
    assert_eq!(report["tone_map"], "neutral");
}

#[test]
fn a_typed_renderer_finds_its_own_view() {
    let desk = desk();
    let report = desk.run("render a.scene.toml -r flat -o a.png --size 8 --json").json();
    assert_eq!(report["renderer"]["id"], "flat");
    assert_eq!(report["files"][0]["outputs"][0], "normal");
    let camera = &report["frame"]["view"]["camera"];
    assert_eq!(camera["projection"]["Orthographic"]["height"], 5.0);
    // Without a view of the renderer, the scene's camera counts.
    desk.put("b.scene.toml", &SCENE.replace("\"flat\"", "\"none-such\""));
    let report = desk.run("render b.scene.toml -r flat -o a.png --size 8 --json").json();
    assert_eq!(report["files"][0]["outputs"][0], "color");
    assert_eq!(report["frame"]["view"]["camera"]["eye"][2], 5.9);
}

#[test]
fn clouds_stand_where_the_scene_puts_them() {
    let desk = desk();
    desk.put_cloud("moved.ply", &[[0.0, 3.0, 0.0, 0.0, 0.0, 1.0, 2.0]]);
    desk.put(
        "b.scene.toml",
        "format = 1
[[clouds]]
path = 'right.ply'
transform = { rotation = [0, 0, 90], translation = [0, -1, 0], scale = 2 }
[[clouds]]
path = 'missing.ply'
visible = false
",
    );
    let light = ["--light", "0,0,1", "--camera", "0,0,20; 0,0,0", "--low-pass", "0"];
    let [placed, moved] = ["b.scene.toml", "moved.ply"].map(|file| [&[file], &light[..]].concat());
    same_pixels(&desk, &placed, &moved);
    let report = desk.run("render b.scene.toml left.ply -o a.png --size 8 --json").json();
    assert_eq!(report["facts"]["n_surfels"], 2, "a scene and clouds are shown together");
    assert_eq!(report["facts"]["bounds_max"][1], 3.0);
}

#[test]
fn one_file_may_stand_in_several_places() {
    let desk = desk();
    let cloud =
        |x: f64| format!("[[clouds]]\npath = 'left.ply'\ntransform.translation = [{x}, 0, 0]\n");
    desk.put("b.scene.toml", &format!("format = 1\n{}{}", cloud(0.0), cloud(4.0)));
    let light = ["--light", "0,0,1", "--camera", "0,0,20; 0,0,0"];
    let [twice, two] = [&["b.scene.toml"][..], &["left.ply", "right.ply"]]
        .map(|files| [files, &light[..]].concat());
    same_pixels(&desk, &twice, &two);
}

#[test]
fn scenes_far_away_look_as_at_the_origin() {
    let desk = desk();
    let scene = |at: f64| {
        format!(
            "format = 1\n[camera]\neye = [{at}, {at}, {}]\ntarget = [{at}, {at}, {at}]\n
             [[clouds]]\npath = 'left.ply'\ntransform.translation = [{at}, {at}, {at}]\n",
            at + 9.0
        )
    };
    desk.put("near.scene.toml", &scene(0.0));
    desk.put("far.scene.toml", &scene(5e6));
    same_pixels(&desk, &["near.scene.toml"], &["far.scene.toml"]);
}

#[test]
fn a_scene_without_clouds_is_an_empty_picture() {
    let desk = TestFolder::new();
    desk.put("a.scene.toml", "format = 1\n");
    desk.run("render a.scene.toml -o a.png --size 8").done();
    assert!(read_png(&desk.at("a.png")).pixels().all(|pixel| pixel[3] == 0));
    let info = desk.run("info a.scene.toml").done().stdout;
    assert!(info.contains("camera    none"), "{info}");
}

/// Two discs beside each other, the second by a renderer of its own.
const OWN_RENDERER: &str = "format = 1
[camera]
eye = [0.0, 0.0, 9.0]
target = [0.0, 0.0, 0.0]
[[clouds]]
path = 'left.ply'
[[clouds]]
path = 'right.ply'
renderer = 'flat'
values = { ambient = 0.5 }
[[views]]
renderer = 'ewa-phong'
";

#[test]
fn each_cloud_is_drawn_by_the_renderer_that_it_names() {
    let desk = desk();
    desk.put("own.scene.toml", OWN_RENDERER);
    desk.put(
        "plain.scene.toml",
        &OWN_RENDERER.replace("renderer = 'flat'\nvalues = { ambient = 0.5 }\n", ""),
    );
    let both = pixels(&desk, &["own.scene.toml"]);
    let phong = pixels(&desk, &["plain.scene.toml"]);
    let flat = pixels(&desk, &["plain.scene.toml", "-r", "flat", "--set", "ambient=0.5"]);
    assert!(phong != flat);
    // The discs lie left and right of the middle.
    let halves = |shown: &[u8], left: &[u8], right: &[u8]| {
        for (i, shown) in shown.chunks(4).enumerate() {
            let expected = if i % 96 < 48 { left } else { right };
            assert_eq!(shown, &expected[4 * i..4 * i + 4], "pixel {i}");
        }
    };
    halves(&both, &phong, &flat);
    // What is typed for the renderer of a cloud reaches it.
    let typed = pixels(&desk, &["own.scene.toml", "--set", "flat:ambient=0.1"]);
    let other = pixels(&desk, &["plain.scene.toml", "-r", "flat", "--set", "ambient=0.1"]);
    assert!(typed != both);
    halves(&typed, &phong, &other);
    // As one renderer's where all say the same, whoever has the others.
    let all = pixels(&desk, &["own.scene.toml", "-r", "flat", "--set", "ambient=0.5"]);
    assert!(all == flat);
    let json = desk.run("render own.scene.toml -o a.png --size 16 --json").json();
    let renderers: Vec<_> = json["renderers"].as_array().unwrap().iter().collect();
    assert_eq!(renderers.len(), 2);
    assert_eq!((&renderers[0]["id"], &renderers[0]["clouds"][0]), (&"ewa-phong".into(), &0.into()));
    assert_eq!((&renderers[1]["id"], &renderers[1]["clouds"][0]), (&"flat".into(), &1.into()));
    let explained = desk.run("explain own.scene.toml --size 16").done().stdout;
    assert!(
        explained.contains("`flat` draws right.ply as surfels; its graph takes "),
        "{explained}"
    );
    assert!(explained.contains("ran     flat: "), "{explained}");
}

#[test]
fn renderers_that_cannot_draw_their_cloud_are_refused_by_name() {
    let desk = desk();
    let refused = |renderer: &str, words: &[&str]| {
        desk.put(
            "b.scene.toml",
            &OWN_RENDERER.replace("'flat'\nvalues = { ambient = 0.5 }", renderer),
        );
        desk.run("render b.scene.toml -o b.png --size 8").failed(words);
        assert!(!desk.at("b.png").exists());
    };
    refused(
        "'flot'",
        &["b.scene.toml:8 (right.ply): there is no renderer `flot`", "did you mean `flat`"],
    );
    refused(
        "'reference'",
        &["b.scene.toml:8 (right.ply): expected a renderer for the cloud, found the tracer"],
    );
    refused(
        "'flat'\nvalues = { ambient = 7 }",
        &["b.scene.toml:8 (right.ply): renderer `flat`: parameter `ambient` takes a number"],
    );
}

#[test]
fn mistakes_name_the_scene_and_the_line() {
    let desk = desk();
    let refused = |text: &str, words: &[&str]| {
        desk.put("b.scene.toml", text);
        desk.run("render b.scene.toml -o b.png --size 8").failed(words);
        assert!(!desk.at("b.png").exists());
    };
    refused("format = 1\nexposure = 99\n", &["b.scene.toml:2:12: `exposure`", "found `99`"]);
    refused(
        "format = 1\n[[clouds]]\npath = 'x/none.ply'\n",
        &["b.scene.toml:3: expected the cloud x/none.ply, found no such file", "visible = false"],
    );
    desk.put("bad.ply", "nonsense");
    refused(
        "format = 1\n[[clouds]]\npath = 'bad.ply'\n",
        &["b.scene.toml:3: bad.ply: expected a PLY, OBJ, OFF, "],
    );
    refused(
        "format = 1\n[[clouds]]\npath = 'left.ply'\ntransform.scale = 1e-60\n",
        &["b.scene.toml:3: transform: expected a scale", "found 1e-60"],
    );
    refused(
        "format = 1\n[[views]]\nrenderer = 'flot'\n",
        &["b.scene.toml:3: there is no renderer `flot`", "did you mean `flat`"],
    );
    refused(
        "format = 1\n[[views]]\nrenderer = 'ewa-phong'\nvalues.shininess = 5000\n",
        &[
            "b.scene.toml:3: renderer `ewa-phong`: parameter `shininess` takes a number from 1 to 1024, found `5000`",
        ],
    );
    refused("format = 2\n", &["b.scene.toml:1:10: ", "format 2 of a newer Surfelshop"]);
    desk.run("render a.scene.toml a.scene.toml -o b.png").failed(&["at most one scene"]);
    desk.run("render none.scene.toml -o b.png").failed(&["none.scene.toml: cannot be read"]);
}

#[test]
fn unknown_keys_are_noticed_and_harm_nothing() {
    let desk = desk();
    desk.put(
        "b.scene.toml",
        "format = 1\nexposre = 1\n[[views]]\nrenderer = 'ewa-phong'\nvalues.sparkle = 1\n",
    );
    let ended = desk.run("render b.scene.toml left.ply -o a.png --size 8").done();
    let lines: Vec<&str> = ended.stderr.lines().collect();
    let expected =
        "surfelshop: warning: b.scene.toml:2:1: unknown key `exposre`, did you mean `exposure`?";
    assert_eq!((lines.len(), lines[0]), (2, expected));
    assert!(lines[1].contains("b.scene.toml:4: renderer `ewa-phong` has no parameter `sparkle`"));
}

#[test]
fn the_scene_in_the_readme_is_true() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(1).unwrap();
    let readme = std::fs::read_to_string(root.join("host/manual/reference/scenes.md")).unwrap();
    let (_, rest) = readme.split_once("```toml\nformat = 1\n").unwrap();
    let (scene, _) = rest.split_once("```").unwrap();
    let desk = TestFolder::new();
    desk.put("snails.scene.toml", &format!("format = 1\n{scene}"));
    std::fs::create_dir(desk.at("assets")).unwrap();
    std::fs::copy(root.join("assets/sample.ply"), desk.at("assets/sample.ply")).unwrap();
    let ended = desk.run("render snails.scene.toml -o a.png --size 64 --json");
    assert_eq!(ended.stderr, "", "no warnings");
    assert_eq!(ended.json()["facts"]["n_surfels"], 2 * 119_051);
}

#[test]
fn info_lists_clouds_and_views() {
    let desk = desk();
    let more = "[[clouds]]\npath = 'none.ply'\nname = \"\\u0001old\"\nvisible = false\ntransform = { \
                rotation = [0, 45.3, 0], translation = [0.5, 0, 5e6], scale = 2 }\n";
    desk.put(
        "a.scene.toml",
        &format!("{SCENE}\n{more}").replace("format = 1", "format = 1\nodd = 1"),
    );
    let text = desk.run("info a.scene.toml").done().stdout;
    let expected = "a.scene.toml
  format    scene, version 1
  clouds    left.ply
            right.ply
            none.ply (?old), scaled by 2, turned by 0 45.3 0 degrees, moved by 0.5 0 5000000, hidden, not found
  views     ewa-phong: color, shininess = 16, specular = 0.25
            flat: normal, a camera of its own
  camera    at 0.9 1.95 5.9, towards -0.02 0.1 0, 45.3 degrees
  light     2 directional, exposure 0.5 stops, tone map neutral
  surface   one-sided, radii x 1.25, depth tolerance 0.75 radii, low-pass 0.5 px
  warning   a.scene.toml:2:1: unknown key `odd` is kept and has no effect
";
    assert_eq!(text, expected);
    let report = desk.run("info a.scene.toml left.ply --json").json();
    assert_eq!(report["clouds"].as_array().unwrap().len(), 1);
    let scene = &report["scenes"][0];
    assert_eq!(scene["clouds"][2]["found"], false);
    assert_eq!(scene["clouds"][2]["transform"]["translation"][2], 5e6);
    assert_eq!(scene["views"][0]["parameters"]["shininess"], 16);
    assert_eq!(scene["views"][1]["camera"]["eye"][2], 9.0);
    assert_eq!(scene["scene"]["surface"]["two_sided"], false);
    desk.put("b.scene.toml", "format = 3");
    desk.run("info b.scene.toml").failed(&["b.scene.toml:1:10", "format 3 of a newer Surfelshop"]);
}
