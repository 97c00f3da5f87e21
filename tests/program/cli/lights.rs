//! Lights as they are typed and as scenes give them, and the lines that refuse them.

use crate::cli::pictures::read_exr;
use crate::cli::program::{TestFolder, facing_front};

/// A disc that fills the picture's middle, at the origin, facing the camera.
fn desk() -> TestFolder {
    let desk = TestFolder::new();
    desk.put_cloud("one.ply", &[facing_front(0.0, 0.0, 1.0)]);
    desk
}

const CAMERA: &str = "--camera 0,0,4;0,0,0 --size 9";

/// Linear radiance of the picture's middle, which `flat` draws without ambient light.
#[track_caller]
fn middle(desk: &TestFolder, options: &str) -> f32 {
    let set = "-r flat --set ambient=0";
    desk.run(&format!("render {options} {CAMERA} {set} -o a.exr")).done();
    read_exr(&desk.at("a.exr")).1["G"][4 * 9 + 4]
}

#[test]
fn typed_points_and_spots_shine() {
    let desk = desk();
    let sun = middle(&desk, "one.ply --light 0,0,1");
    assert!(sun > 0.1, "{sun}");
    // The square of the distance, the intensity, and what lies within a cone: f32 of a few terms.
    for (light, share) in [
        ("point:0,0,1", 1.0),
        ("point:0,0,2", 0.25),
        ("point:0,0,2:3,3,3", 0.75),
        ("point:0,0,-2", 0.0),
        ("spot:0,0,2:0,0,0", 0.25),
        ("spot:0,0,2:0,0,0:10,0:8,8,8", 2.0),
        ("spot:0,0,2:0,0,4", 0.0),
        ("spot:0,0,2:2,0,2:91,0", 0.25),
        ("spot:0,0,2:2,0,2:89,0", 0.0),
        ("spot:0,0,2:0,0,0:0", 0.0),
    ] {
        let found = middle(&desk, &format!("one.ply --light {light}")) / sun;
        assert!((found - share).abs() < 1e-5, "{light}: {found} for {share}");
    }
    // Many add up, and the scene's are the same.
    let both = middle(&desk, "one.ply --light point:0,0,1 --light spot:0,0,2:0,0,0");
    assert!((both / sun - 1.25).abs() < 1e-5, "{both}");
    desk.put(
        "a.scene.toml",
        "format = 1\n[[clouds]]\npath = 'one.ply'\n[[lights]]\nposition = [0, 0, 1]\n[[lights]]\n\
         position = [0, 0, 2]\ntarget = [0, 0, 0]\n",
    );
    assert_eq!(middle(&desk, "a.scene.toml"), both);
}

#[test]
fn typed_lights_that_are_none_are_refused_with_what_was_expected() {
    let desk = desk();
    let point = "expected `point:x,y,z` with the place of the light, and `:r,g,b` behind it for \
                 another intensity than 1,1,1";
    let spot = "expected `spot:x,y,z:x,y,z` with the place of the light and a point that it is \
                turned to, behind them `:angle` or `:angle,softness`, and last `:r,g,b` for another \
                intensity than 1,1,1";
    let kinds = "expected `camera`, a direction x,y,z towards the light, `point:x,y,z` or \
                 `spot:x,y,z:x,y,z`, with `:r,g,b` behind it for another radiance or intensity than \
                 1,1,1";
    for (light, expected) in [
        ("lamp:1,2,3", kinds),
        ("point:1,2", point),
        ("point:1,nan,3", point),
        ("point:1,2,3:1,1,-1", "expected an intensity of 0 or more"),
        ("spot:1,2,3", spot),
        ("spot:1,2,3:inf,0,0", spot),
        ("spot:1,2,3:1,2,3", "expected a spot turned to another point than its place"),
        (
            "spot:1,2,3:0,0,0:200",
            "expected an angle from 0 to 180 degrees between a spot's axis and its edge",
        ),
        ("spot:1,2,3:0,0,0:20,2", "expected a spot's softness from 0 to 1"),
    ] {
        let line = format!("invalid value '{light}' for '--light <LIGHT>': {expected}\n");
        desk.run(&format!("render one.ply -o a.png --light {light}")).misused(&[&line]);
    }
    let nine = " --light point:0,0,1".repeat(9);
    let most = "expected at most 8 lights, found 9 --light";
    desk.run(&format!("render one.ply -o a.png{nine}")).failed(&[most]);
    assert_eq!(desk.files(), ["one.ply"]);
}

#[test]
fn lights_of_scenes_that_are_no_numbers_are_refused_at_their_line() {
    let desk = desk();
    for (light, expected) in [
        (
            "position = [0, nan, 0]",
            "a.scene.toml:3:12: `lights[1].position`: expected three numbers from -1e37 to 1e37, \
             found `[0, nan, 0]`",
        ),
        (
            "position = [0, 1, 0]\nintensity = [1, inf, 1]",
            "a.scene.toml:4:13: `lights[1].intensity`: expected three numbers of 0 or more, found \
             `[1, inf, 1]`",
        ),
        (
            "position = [0, 1, 0]\ntarget = [0, 0, -inf]",
            "a.scene.toml:4:10: `lights[1].target`: expected three numbers from -1e37 to 1e37, \
             found `[0, 0, -inf]`",
        ),
        (
            "position = [0, 1, 0]\ntarget = [0, 0, 0]\nangle = nan",
            "a.scene.toml:5:9: `lights[1].angle`: expected an angle in degrees from 0 to 180, \
             between the axis and the edge, found `nan`",
        ),
    ] {
        desk.put("a.scene.toml", &format!("format = 1\n[[lights]]\n{light}\n"));
        desk.run("info a.scene.toml").failed(&[expected]);
    }
    let nine = "[[lights]]\nposition = [0, 0, 1]\n".repeat(9);
    desk.put("a.scene.toml", &format!("format = 1\n{nine}"));
    desk.run("info a.scene.toml").failed(&["`lights`", "at most 8 lights"]);
}

#[test]
fn info_counts_the_kinds_and_knows_all_of_each() {
    let desk = desk();
    desk.put(
        "a.scene.toml",
        "format = 1\n[[lights]]\ntowards = [0, 1, 0]\n[[lights]]\nposition = [0, 1, 0]\n\
         [[lights]]\nposition = [0, 1, 0]\n[[lights]]\nposition = [0, 2, 0]\ntarget = [0, 0, 0]\n\
         angle = 90\nintensity = [3, 4, 5]\nsoftness = 0.5\n",
    );
    let text = desk.run("info a.scene.toml").done().stdout;
    assert!(
        text.contains("  light     1 directional, 2 point, 1 spot, exposure 0 stops"),
        "{text}"
    );
    let report = desk.run("info a.scene.toml --json").json();
    let spot = &report["scenes"][0]["scene"]["lights"][3]["Spot"];
    assert_eq!(spot["position"][1], 2.0);
    assert_eq!(spot["intensity"][2], 5.0);
    assert_eq!(spot["angle"], std::f64::consts::FRAC_PI_2);
    assert_eq!(spot["softness"], 0.5);
    // The picture's report has them as well, so that it can be made again.
    let ended = desk.run(&format!("render one.ply {CAMERA} -o a.png --light point:0,0,2 --json"));
    assert_eq!(ended.json()["scene"]["lights"][0]["Point"]["position"][2], 2.0);
    desk.put("a.scene.toml", "format = 1\nlights = []\n");
    let text = desk.run("info a.scene.toml").done().stdout;
    assert!(text.contains("  light     none, exposure 0 stops"), "{text}");
}
