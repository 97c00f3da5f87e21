//! `surfelshop compare`: its page, its numbers, and what it makes of renderers that go wrong.

use crate::cli::bake::faulty;
use crate::cli::program::{TestFolder, facing_front};
use serde_json::json;

fn desk() -> TestFolder {
    let desk = TestFolder::new();
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
    assert_eq!(flat["errors"]["rmse"], json!(0.0), "itself");
    assert!(phong["errors"]["rmse"].as_f64().unwrap() > 1e-3);
    let frame = &phong["frames"][0];
    assert_eq!(frame["runs"].as_array().unwrap().len(), 2);
    assert_eq!(frame["comparison"]["errors"], phong["errors"], "the only one");
    // A texture of four floats a pixel, and the uniforms.
    assert!(frame["graph_bytes"].as_u64().unwrap() >= 48 * 48 * 16, "{frame}");
    assert!(frame["n_passes"].as_u64().unwrap() >= 1, "{frame}");
    for file in [
        "index.html",
        "metrics.csv",
        "metrics.json",
        "flat.png",
        "ewa-phong.exr",
        "maps/ewa-phong-FLIP.png",
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
    desk.run(&format!("{line} --fail-above beauty=1"))
        .failed(&["no metric `beauty`", "rmse, rel_mse"]);
    desk.run(&format!("{line} --fail-above rmse")).misused(&["METRIC=VALUE"]);
    desk.run(&format!("{line} --fail-above psnr=30")).failed(&["--fail-below psnr=30"]);
    desk.run(&format!("{line} --fail-below psnr=90"))
        .failed(&["psnr of `ewa-phong` is", "below 90"]);
    desk.run(&format!("{line} --fail-below ssim=0.01")).done();
    // The reference is never the one that fails.
    desk.run(&format!("compare two.ply -r flat -o out {SMALL} --fail-below psnr=90")).done();
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
    let flat = &told["renderers"][0];
    // Samples of a pixel at an edge differ, so there is noise, and it is what was taken off.
    let mse = |of: &str| flat["errors"][of]["mse"].as_f64().unwrap();
    assert!(mse("reference_noise") > 0.0, "{flat}");
    let taken_off = mse("measured") - mse("estimate");
    assert!((taken_off - mse("reference_noise")).abs() < 1e-12, "{flat}");
    // A white square of light that both see alike, but for the ambient light of `flat`.
    assert!(flat["errors"]["rmse"].as_f64().unwrap() < 0.2, "{flat}");
}

/// Invariant: what goes wrong in a comparison is marked and not averaged in
#[test]
fn what_goes_wrong_is_marked_and_not_averaged_in() {
    let desk = desk();
    let plugin = faulty();
    let bad = ["not-finite", "panics-in-frame", "wrong-target-size", "no-output", "panics-in-new"];
    let line = format!("compare two.ply -r flat -r {} -o out {SMALL}", bad.join(" -r "));
    let ended = desk.run(&format!("{line} --trust --plugin {plugin}"));
    assert_eq!(ended.code, 1, "{}", ended.stderr);
    for name in bad {
        assert!(ended.stderr.contains(&format!("`{name}`: ")), "{name}: {}", ended.stderr);
    }
    let json = std::fs::read_to_string(desk.at("out/metrics.json")).unwrap();
    let told: serde_json::Value = serde_json::from_str(&json).unwrap();
    let all = told["renderers"].as_array().unwrap();
    assert_eq!(all[0]["errors"]["rmse"], json!(0.0));
    for (found, line) in all[1..].iter().zip([
        "pixels are not finite",
        "panic",
        "`small` is 7 x 5; a shading pass draws into the view's size",
        "offers no output `color`",
        "could not start",
    ]) {
        assert!(found["errors"].is_null(), "{found}");
        assert!(found["error"].as_str().unwrap().contains(line), "{found}");
    }
    assert!(all[1]["frames"][0]["comparison"]["n_not_finite"].as_u64().unwrap() > 0);
    let csv = std::fs::read_to_string(desk.at("out/metrics.csv")).unwrap();
    assert!(csv.contains("pixels are not finite"), "{csv}");
}

#[test]
fn one_renderer_is_compared_with_itself_under_names_of_the_user_s() {
    let desk = desk();
    let line = format!("compare two.ply -r dim=flat -r bright=flat -o out {SMALL}");
    let told = desk.run(&format!("{line} --set dim:ambient=0.1 --set ambient=0.4 --json")).json();
    let [dim, bright] = &told["renderers"].as_array().unwrap()[..] else { panic!("{told}") };
    assert_eq!((&dim["name"], &bright["name"]), (&json!("dim"), &json!("bright")));
    assert_eq!(told["reference"], "dim");
    // What is meant for all comes after what is meant for one, and counts.
    assert_eq!(
        dim["renderer"]["parameters"]["ambient"],
        bright["renderer"]["parameters"]["ambient"]
    );
    let told =
        desk.run(&format!("{line} --set bright:ambient=0.5 --reference bright --json")).json();
    let [dim, bright] = &told["renderers"].as_array().unwrap()[..] else { panic!("{told}") };
    assert_eq!((&told["reference"], &bright["errors"]["rmse"]), (&json!("bright"), &json!(0.0)));
    assert!(dim["errors"]["rmse"].as_f64().unwrap() > 0.01, "{dim}");
    assert!(desk.at("out/dim.png").is_file() && desk.at("out/bright.exr").is_file());
    // A picture that has a name and the renderer's own beside it: the setting is for the latter.
    let line = format!("compare two.ply -r flat -r other=flat -o out {SMALL} --json");
    let told = desk.run(&format!("{line} --set flat:ambient=0.4")).json();
    let ambient = |i: usize| told["renderers"][i]["renderer"]["parameters"]["ambient"].clone();
    assert_ne!(ambient(0), ambient(1));
    desk.run(&format!("compare two.ply -r flat -r flat -o out {SMALL}"))
        .failed(&["-r flat: there is another `flat`", "-r first=flat -r second=flat"]);
    desk.run(&format!("compare two.ply -r a/b=flat -o out {SMALL}"))
        .failed(&["expected a name of letters, digits, -, _ and . before the ="]);
}

/// Every frame of a path is measured, and the pooled numbers are those of all pixels.
#[test]
fn a_path_has_numbers_of_each_frame_and_of_all() {
    let desk = desk();
    let line = format!("compare two.ply -r flat -r ewa-phong --path orbit:3 -o out {SMALL}");
    let told = desk.run(&format!("{line} --json")).json();
    let phong = &told["renderers"][1];
    let frames = phong["frames"].as_array().unwrap();
    assert_eq!((frames.len(), told["frames"].as_array().unwrap().len()), (3, 3));
    let mse = |frame: &serde_json::Value| {
        frame["comparison"]["errors"]["estimate"]["mse"].as_f64().unwrap()
    };
    let mean = frames.iter().map(mse).sum::<f64>() / 3.0;
    assert!(mse(&frames[0]) != mse(&frames[1]), "the camera moves");
    let rmse = phong["errors"]["rmse"].as_f64().unwrap();
    assert!((rmse - mean.sqrt()).abs() < 1e-12, "{rmse} {mean}");
    for file in ["frame-1/flat.png", "frame-3/ewa-phong.exr", "frames.csv", "metrics.csv"] {
        assert!(desk.at("out").join(file).is_file(), "{file}");
    }
    let csv = std::fs::read_to_string(desk.at("out/frames.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 2 * 3);
    let page = std::fs::read_to_string(desk.at("out/index.html")).unwrap();
    assert!(page.contains("Frame by frame") && page.contains("1: ewa-phong"));
    let none = line.replace("orbit:3", "views");
    desk.run(&none).failed(&["--path views", "expected a scene whose views have cameras"]);
    desk.run(&line.replace("orbit:3", "circle")).misused(&["expected orbit:N"]);
    desk.run(&format!("{line} --reference a.exr")).failed(&["a.exr", "leave --path out"]);
}

#[test]
fn the_cameras_of_a_scene_s_views_are_a_path() {
    let desk = desk();
    let view = |x: f64| {
        format!(
            "[[views]]\nrenderer = \"flat\"\n[views.camera]\neye = [{x}, 0, 4]\n\
             target = [0, 0, 0]\nfov = 40\n"
        )
    };
    let clouds = "format = 1\n[[clouds]]\npath = \"two.ply\"\n";
    desk.put("two.scene.toml", &[clouds, &view(0.0), &view(1.0), &view(0.0)].concat());
    let line = "compare two.scene.toml -r flat --path views --size 32 --repeats 0 -o out";
    let told = desk.run(&format!("{line} --json")).json();
    let eyes: Vec<_> = told["frames"]
        .as_array()
        .unwrap()
        .iter()
        .map(|frame| &frame["view"]["camera"]["eye"])
        .collect();
    assert_eq!(eyes, [&json!([0.0, 0.0, 4.0]), &json!([1.0, 0.0, 4.0])]);
}

#[test]
fn a_comparison_does_not_write_over_its_reference() {
    let desk = desk();
    desk.run("render two.ply -r flat -o truth.exr --size 48 --camera front").done();
    std::fs::create_dir(desk.at("out")).unwrap();
    std::fs::copy(desk.at("truth.exr"), desk.at("out/ewa-phong.exr")).unwrap();
    let line = format!("compare two.ply -r ewa-phong --reference out/ewa-phong.exr -o out {SMALL}");
    desk.run(&line).failed(&["would be overwritten", "name another --out"]);
    let kept = std::fs::read(desk.at("out/ewa-phong.exr")).unwrap();
    assert_eq!(kept, std::fs::read(desk.at("truth.exr")).unwrap());
}

/// A scene's view says how its renderer draws, in a comparison as in a picture.
#[test]
fn the_values_of_a_scene_s_view_count() {
    let desk = desk();
    let scene = "format = 1\n[[clouds]]\npath = \"two.ply\"\n[[views]]\nrenderer = \"flat\"\n\
                 [views.values]\nambient = 0.9\n";
    desk.put("a.scene.toml", scene);
    let seen = "--size 48 --camera front";
    desk.run(&format!("render a.scene.toml -r flat -o a.exr {seen}")).done();
    let line = format!("compare a.scene.toml -r flat --reference a.exr -o out {seen} --repeats 0");
    let told = desk.run(&format!("{line} --json")).json();
    // Of half floats in the file.
    let rmse = told["renderers"][0]["errors"]["rmse"].as_f64().unwrap();
    assert!(rmse < 1e-3, "{told}");
    assert_eq!(told["renderers"][0]["renderer"]["parameters"]["ambient"], json!(0.9));
}

#[test]
fn pictures_too_large_for_a_tracer_are_refused_in_one_line() {
    let desk = desk();
    for size in ["4294967295x4294967295", "100000x100000", "16384x16384"] {
        let line = format!("render two.ply -r reference -o a.exr --size {size}");
        desk.run(&line).failed(&["each side must be 1 to 16384"]);
    }
}

/// A file of a few kilobytes that promises a thousand million columns.
#[test]
fn a_picture_that_promises_too_much_is_refused_before_there_is_memory_for_it() {
    let desk = desk();
    desk.run("render two.ply -r flat -o small.exr --size 48 --camera front").done();
    let mut bytes = std::fs::read(desk.at("small.exr")).unwrap();
    for name in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
        let at = bytes.windows(name.len()).position(|window| window == name).unwrap();
        // Behind the name stand the length of the value, then left, top, right and bottom.
        let right = at + name.len() + 4 + 8;
        bytes[right..right + 4].copy_from_slice(&999_999_999i32.to_le_bytes());
    }
    std::fs::write(desk.at("huge.exr"), bytes).unwrap();
    let line = format!("compare two.ply -r flat --reference huge.exr -o out {SMALL}");
    desk.run(&line).failed(&["huge.exr", "expected at most 268435456 pixels", "48000000000"]);
}

#[test]
fn a_limit_on_what_is_no_metric_is_refused_before_anything_is_drawn() {
    let desk = TestFolder::new();
    desk.put_cloud("one.ply", &[facing_front(0.0, 0.0, 0.5)]);
    for option in ["--fail-above x=1", "--fail-below x=1"] {
        desk.run(&format!("compare one.ply -r flat -r ewa-phong --size 16 -o out {option}"))
            .failed(&["there is no metric `x`", "flip.mean"]);
        assert_eq!(desk.files(), ["one.ply"]);
    }
}
