//! Cases of a plugin's own: scenes with the pictures that are expected of them.

use crate::cli::program::TestFolder;
use serde_json::Value;

const SAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/sample.ply");

/// A folder with the scene of a ball, and cases of it.
fn desk(cases: &str) -> TestFolder {
    let desk = TestFolder::new();
    desk.run(&format!("bake {SAMPLE} -t thin --set count=2000 -o ball.ply")).done();
    let view = "[[views]]\nrenderer = \"flat\"\nvalues.ambient = 0.2\n";
    desk.put("ball.scene.toml", &format!("format = 1\n[[clouds]]\npath = \"ball.ply\"\n{view}"));
    desk.put("own.toml", cases);
    desk
}

/// The verdicts of a run by case, with what is said.
fn verdicts(told: &str) -> Vec<(String, String, String)> {
    let told: Value = serde_json::from_str(told).unwrap();
    let cases = told["units"][0]["cases"].as_array().unwrap().clone();
    let text = |case: &Value, key: &str| case[key].as_str().unwrap().to_owned();
    cases
        .iter()
        .map(|case| (text(case, "case"), text(case, "verdict"), text(case, "said")))
        .collect()
}

#[test]
fn pictures_are_accepted_once_and_held_against_what_is_drawn() {
    let desk = desk(
        "[[case]]\nscene = \"ball.scene.toml\"\nexpect = \"ball.exr\"\nsize = [96, 64]\n\
         [[case]]\nname = \"shown\"\nscene = \"ball.scene.toml\"\nexpect = \"shown.png\"\nsize = [96, 64]\n",
    );
    let run = |more: &str| desk.run(&format!("check flat --cases own.toml --json {more}"));
    // Without pictures there is nothing to pass.
    let ended = run("--case ball");
    let found = verdicts(&ended.stdout);
    assert_eq!((ended.code, found[0].1.as_str()), (1, "failed"));
    assert!(found[0].2.contains("--accept writes it"), "{found:?}");

    let found = verdicts(&run("--accept").done().stdout);
    assert_eq!(found.iter().map(|one| one.0.as_str()).collect::<Vec<_>>(), ["ball", "shown"]);
    let found = verdicts(&run("--case ball --case shown").done().stdout);
    assert!(found.iter().all(|one| one.1 == "passed"), "{found:?}");
    // With the cases that all renderers have.
    let found = verdicts(&run("--case shown --case limits").done().stdout);
    assert_eq!(found.len(), 2, "{found:?}");

    // Another look is found, with its figures and pictures.
    let scene = std::fs::read_to_string(desk.at("ball.scene.toml")).unwrap();
    desk.put("ball.scene.toml", &scene.replace("ambient = 0.2", "ambient = 0.4"));
    let ended = run("--case ball --case shown");
    let found = verdicts(&ended.stdout);
    assert_eq!(ended.code, 1);
    for (name, verdict, said) in &found {
        assert!(
            verdict == "failed" && said.contains("PSNR") && said.contains("below 40 dB"),
            "{name}: {said}"
        );
    }
    let files = desk.files();
    for name in ["ball.found.exr", "ball.difference.png", "shown.found.png", "shown.difference.png"]
    {
        assert!(files.iter().any(|file| file == name), "{name} is not among {files:?}");
    }
    let ended = run("--case ball -o told");
    assert_eq!(ended.code, 1);
    for name in ["found", "expected", "difference"] {
        let file = desk.at(&format!("told/org-surfelshop-flat-renderer-flat-ball-{name}.png"));
        assert!(file.is_file(), "{}", file.display());
    }
    // What is accepted says how far it was.
    let found = verdicts(&run("--accept --case ball").done().stdout);
    assert!(found[0].2.contains("from the one before: PSNR"), "{found:?}");
    assert!(verdicts(&run("--case ball").done().stdout)[0].1 == "passed");
}

#[test]
fn a_scene_is_checked_without_a_file_of_cases() {
    let desk = desk("");
    let line = "check flat --scene ball.scene.toml --expect a.exr --size 48";
    desk.run(&format!("{line} --accept")).done();
    let ended = desk.run(line).done();
    assert!(ended.stdout.contains("1 passed"), "{}", ended.stdout);
    // The size is that of the picture.
    desk.run("check flat --scene ball.scene.toml --expect a.exr --psnr 90").done();
    // A tracer is held to a renderer's picture, which it does not draw.
    let ended = desk.run("check reference --scene ball.ply --expect a.exr --psnr 200");
    assert_eq!(ended.code, 1);
    assert!(ended.stdout.contains("below 200 dB"), "{}", ended.stdout);
    desk.run("check flat --scene ball.scene.toml --expect a.exr --size 32").failed(&["1 failure"]);
    desk.run("check flat --accept").failed(&["no cases of their own", "check.toml"]);
    desk.run("check thin --scene ball.ply --expect a.exr").failed(&["renderer or tracer"]);
    desk.run("check flat ewa-phong --scene ball.ply --expect a.exr")
        .failed(&["can be drawn by ewa-phong, flat"]);
    desk.run("check flat --scene ball.ply").misused(&["--expect"]);
    desk.run("check flat --case nothing").failed(&["there is no such case"]);
}
