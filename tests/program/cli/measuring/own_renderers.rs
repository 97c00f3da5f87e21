//! Clouds that name their renderer, where others are measured: what is measured is the picture that `render` shows.

use crate::cli::program::{TestFolder, read_png};

const SAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/sample.ply");
const SPLATS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/stored/3.9/splats.ply");

/// A folder with a scene of surfels and Gaussians in each other, and one of the surfels alone.
fn desk() -> TestFolder {
    let desk = TestFolder::new();
    desk.run(&format!("bake {SAMPLE} -t thin --set count=1000 -o ball.ply")).done();
    let ball = "format = 1\n[[clouds]]\npath = \"ball.ply\"\n";
    let splats = format!("[[clouds]]\npath = \"{SPLATS}\"\nrenderer = \"gaussians\"\n");
    let view = "[[views]]\nrenderer = \"flat\"\n";
    desk.put("mixed.scene.toml", &format!("{ball}{splats}{view}"));
    desk.put("ball.scene.toml", &format!("{ball}{view}"));
    desk
}

/// Cost: 12 frames of 64 x 64 and a report of 2 cells, some 10 CPU s.
#[test]
fn what_is_measured_is_the_picture_with_all_clouds() {
    let desk = desk();
    for (renderer, file) in [("flat", "flat"), ("ewa-phong", "phong")] {
        for ending in ["png", "exr"] {
            desk.run(&format!(
                "render mixed.scene.toml -r {renderer} --size 64 -o {file}.{ending}"
            ))
            .done();
        }
    }
    desk.run("render ball.scene.toml --size 64 -o alone.png").done();
    let picture = |name: &str| read_png(&desk.at(name));
    assert_ne!(picture("flat.png"), picture("alone.png"), "the Gaussians are to be seen");

    let line = "compare mixed.scene.toml -r flat -r ewa-phong --size 64 --repeats 1 -o compared";
    desk.run(line).done();
    assert_eq!(picture("compared/flat.png"), picture("flat.png"));
    assert_eq!(picture("compared/ewa-phong.png"), picture("phong.png"));

    let line = "report mixed.scene.toml -r flat --knob ambient=0.2,0.5 --reference ewa-phong \
                --size 64 --repeats 1 -o reported";
    desk.run(line).done();
    let same = "compare mixed.scene.toml -r ewa-phong --reference reported/reference.exr --size 64 \
                --repeats 1 -o again --json";
    let told = desk.run(same).json();
    // Files hold colours times coverage; to divide by it rounds.
    assert!(told["renderers"][0]["errors"]["rmse"].as_f64().unwrap() < 1e-6, "{told}");

    let case = "check flat --scene mixed.scene.toml --expect flat.exr --psnr 120";
    desk.run(case).done();
    let alone = case.replace("mixed.scene", "ball.scene");
    desk.run(&alone).failed(&["1 failure"]);
}

/// Cost: 6 frames of 64 x 64, some 3 CPU s.
#[test]
fn a_bench_counts_the_passes_of_clouds_own_renderers() {
    let desk = desk();
    let stages = |scene: &str| {
        let line = format!("bench {scene} -r flat --sizes 64 --frames 1 --strategies cpu --split");
        desk.run(&line).done().stdout
    };
    assert!(stages("mixed.scene.toml").contains("pass splats"));
    assert!(!stages("ball.scene.toml").contains("pass splats"));
}
