//! Light probes: what `render` and `info` make of them.

use crate::cli::program::{TestFolder, facing_front, read_png};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn desk() -> TestFolder {
    let desk = TestFolder::new();
    desk.put_cloud("one.ply", &[facing_front(0.0, 0.0, 1.0)]);
    let sky = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/sky.hdr");
    fs::copy(sky, desk.at("sky.hdr")).unwrap();
    desk
}

const RENDER: &str = "render one.ply -r environment --size 32 --camera front";

/// States of the passes that filter the environment.
fn filters(report: &Value) -> Vec<String> {
    let passes = report["frame"]["passes"].as_array().unwrap();
    let own = passes.iter().filter(|pass| pass["name"].as_str().unwrap().starts_with("prefilter"));
    own.map(|pass| pass["state"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn a_second_start_finds_what_the_first_made_of_a_probe() {
    let desk = desk();
    let start = || desk.run(&format!("{RENDER} --env sky.hdr -o a.png --json")).json();
    let (first, before) = (start(), read_png(&desk.at("a.png")));
    let (second, after) = (start(), read_png(&desk.at("a.png")));
    assert!(filters(&first).len() > 3);
    assert!(filters(&first).iter().all(|state| state == "ran"), "{:?}", filters(&first));
    assert!(filters(&second).iter().all(|state| state == "reused"), "{:?}", filters(&second));
    assert_eq!(before, after);
    assert_eq!(first["environment"], second["environment"]);
    assert_eq!(first["environment"]["mapping"], "lat-long");
    // What is stored is worth nothing once the file is another one.
    let mut bytes = fs::read(desk.at("sky.hdr")).unwrap();
    let last = bytes.len() - 1;
    bytes[last] ^= 3;
    fs::write(desk.at("sky.hdr"), bytes).unwrap();
    assert!(filters(&start()).iter().all(|state| state == "ran"));
}

#[test]
fn options_turn_and_scale_the_light() {
    let desk = desk();
    let picture = |options: &str| {
        desk.run(&format!("{RENDER} --exposure -3 --set ks=0 --env sky.hdr {options} -o a.png"))
            .done();
        *read_png(&desk.at("a.png")).get_pixel(16, 16)
    };
    let plain = picture("");
    assert_eq!(picture("--env-rotation 360"), plain);
    assert_eq!(picture("--env-forward -z --env-up y --env-mapping lat-long"), plain);
    assert_ne!(picture("--env-rotation 90"), plain);
    assert_ne!(picture("--env-up z --env-forward y"), plain);
    // A world whose z points upwards looks along y, unless it is said otherwise.
    assert_eq!(picture("--env-up z"), picture("--env-up z --env-forward y"));
    let (dark, bright) = (picture("--env-exposure -3"), picture("--env-exposure -1"));
    assert!(dark[1] < bright[1] && bright[1] < plain[1], "{dark:?} {bright:?} {plain:?}");
    desk.run(&format!("{RENDER} --env none -o b.png")).done();
    desk.run(&format!("{RENDER} -o c.png")).done();
    assert_eq!(read_png(&desk.at("b.png")), read_png(&desk.at("c.png")));
    for built_in in ["studio", "sky"] {
        desk.run(&format!("{RENDER} --env {built_in} --set background=sharp -o d.png")).done();
        assert_eq!(read_png(&desk.at("d.png")).get_pixel(0, 0)[3], 255, "{built_in}");
    }
}

#[test]
fn scenes_have_an_environment_of_their_own() {
    let desk = desk();
    let scene = "format = 1\n[environment]\nprobe = \"sky.hdr\"\nrotation = 30.0\n\
                 exposure = 0.5\n[[clouds]]\npath = \"one.ply\"\n[[views]]\n\
                 renderer = \"environment\"\n";
    desk.put("s.scene.toml", scene);
    desk.run("render s.scene.toml --size 32 --camera front -o a.png").done();
    desk.run(&format!("{RENDER} --env sky.hdr --env-rotation 30 --env-exposure 0.5 -o b.png"))
        .done();
    assert_eq!(read_png(&desk.at("a.png")), read_png(&desk.at("b.png")));
    desk.run("render s.scene.toml --size 32 --camera front --env none -o a.png").done();
    assert_ne!(read_png(&desk.at("a.png")), read_png(&desk.at("b.png")));
}

#[test]
fn files_that_are_no_probes_are_refused_in_one_line() {
    let desk = desk();
    image::RgbImage::new(64, 32).save(desk.at("ldr.png")).unwrap();
    fs::copy(desk.at("ldr.png"), desk.at("lies.hdr")).unwrap();
    let sky = fs::read(desk.at("sky.hdr")).unwrap();
    fs::write(desk.at("cut.hdr"), &sky[..sky.len() / 2]).unwrap();
    fs::write(desk.at("empty.exr"), "").unwrap();
    for (file, words) in [
        ("ldr.png", &["ldr.png", "Radiance HDR or OpenEXR", "PNG"][..]),
        ("lies.hdr", &["lies.hdr", "Radiance HDR or OpenEXR", "PNG"]),
        ("cut.hdr", &["cut.hdr", "expected"]),
        ("empty.exr", &["empty.exr", "empty"]),
        ("missing.hdr", &["missing.hdr"]),
        (".", &["folder"]),
    ] {
        desk.run(&format!("{RENDER} --env {file} -o a.png")).failed(words);
        assert!(!desk.at("a.png").exists());
    }
    desk.run(&format!("{RENDER} --env sky.hdr --env-mapping angular -o a.png"))
        .failed(&["sky.hdr", "angular"]);
    desk.run(&format!("{RENDER} --env-rotation 3 -o a.png")).failed(&["--env PROBE"]);
    desk.run(&format!("{RENDER} --env sky --env-up z --env-forward -z -o a.png"))
        .failed(&["across"]);
    desk.run(&format!("{RENDER} --env sky --env-mapping cube -o a.png")).misused(&["lat-long"]);
}

#[test]
fn info_says_what_a_probe_is() {
    let desk = desk();
    let text = desk.run("info sky.hdr").done().stdout;
    for words in ["512 x 256", "lat-long", "detected", "sun", "mean radiance"] {
        assert!(text.contains(words), "`{words}` is missing in: {text}");
    }
    let built_in = desk.run("info studio").done().stdout;
    assert!(built_in.contains("512 x 256") && built_in.contains("none that dominates"));
    let report = desk.run("info sky.hdr --json").json();
    assert!(report["probes"][0]["sun"]["angular_radius"].as_f64().unwrap() < 0.1);
}
