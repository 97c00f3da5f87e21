//! What `render` and `demo` write.

use crate::cli::program::{TestFolder, facing_front, read_png};
use exr::prelude::read_all_flat_layers_from_file;
use std::collections::BTreeMap;
use std::path::Path;

/// A disc that fills about half of a picture taken from the front.
fn disc() -> TestFolder {
    let desk = TestFolder::new();
    desk.put_cloud("disc.ply", &[facing_front(0.0, 0.0, 1.0)]);
    desk
}

fn covered(picture: &image::RgbaImage) -> usize {
    picture.pixels().filter(|pixel| pixel[3] > 0).count()
}

/// The channels of an EXR file and its size.
pub(crate) fn read_exr(path: &Path) -> ((usize, usize), BTreeMap<String, Vec<f32>>) {
    let image = read_all_flat_layers_from_file(path).unwrap();
    let layer = &image.layer_data[0];
    let channels = layer.channel_data.list.iter();
    let named = channels
        .map(|channel| {
            (channel.name.to_string(), channel.sample_data.values_as_f32().collect::<Vec<_>>())
        })
        .collect();
    ((layer.size.0, layer.size.1), named)
}

#[test]
fn png_shows_the_disc_on_a_transparent_background() {
    let desk = disc();
    let line = desk.run("render disc.ply -o a.png --size 64x48 --camera front").done().stdout;
    assert!(line.starts_with("a.png: color 64 x 48, 8 bit, ewa-phong in "), "{line}");
    let picture = read_png(&desk.at("a.png"));
    assert_eq!(picture.dimensions(), (64, 48));
    assert_eq!(picture.get_pixel(0, 0).0, [0; 4]);
    let middle = picture.get_pixel(32, 24).0;
    assert_eq!(middle[3], 255);
    assert!(middle[0] > 60, "lit by the headlight: {middle:?}");
    // The disc is framed with a margin of four per cent in the smaller side.
    let expected = std::f64::consts::PI * (24.0f64 / 1.04).powi(2);
    let found = covered(&picture) as f64;
    assert!((found / expected - 1.0).abs() < 0.15, "{found} of {expected} pixels");
    assert_eq!(desk.files(), ["a.png", "disc.ply"]);
}

#[test]
fn bits_background_and_exposure_reach_the_png() {
    let desk = disc();
    desk.run("render disc.ply -o deep.png --size 16 --bits 16").done();
    let deep = image::open(desk.at("deep.png")).unwrap();
    assert_eq!(deep.color(), image::ColorType::Rgba16);

    desk.run("render disc.ply -o gray.png --size 16 --background #336699").done();
    let gray = read_png(&desk.at("gray.png"));
    assert_eq!(gray.get_pixel(0, 0).0, [0x33, 0x66, 0x99, 255]);

    desk.run("render disc.ply -o dark.png --size 16 --camera front --exposure -20").done();
    assert!(read_png(&desk.at("dark.png")).get_pixel(8, 8)[0] < 8);
    desk.run("render disc.ply -o bright.png --size 16 --camera front --exposure 20").done();
    assert_eq!(read_png(&desk.at("bright.png")).get_pixel(8, 8).0, [255; 4]);
}

#[test]
fn lights_shine_from_where_they_are() {
    let desk = disc();
    let middle = |light: &str| {
        let arguments =
            format!("render disc.ply -r flat -o a.png --size 16 --camera front --light {light}");
        desk.run(&arguments).done();
        read_png(&desk.at("a.png")).get_pixel(8, 8).0
    };
    let behind = middle("0,0,-1");
    let before = middle("0,0,1");
    let red = middle("0,0,1:1,0,0");
    assert!(before[0] > behind[0] + 50, "{before:?} {behind:?}");
    assert!(red[0] > red[1] + 50, "{red:?}");
}

#[test]
fn exr_has_all_layers_and_they_agree() {
    let desk = disc();
    desk.run("render disc.ply -o a.exr --size 40x32 --camera front").done();
    let (size, channels) = read_exr(&desk.at("a.exr"));
    assert_eq!(size, (40, 32));
    let names: Vec<&str> = channels.keys().map(String::as_str).collect();
    let expected = [
        "A", "B", "G", "R", "albedo.B", "albedo.G", "albedo.R", "depth.Z", "normal.X", "normal.Y",
        "normal.Z",
    ];
    assert_eq!(names, expected);
    for (name, values) in &channels {
        assert_eq!(values.len(), 40 * 32, "{name}");
        assert!(values.iter().all(|value| value.is_finite()), "{name}");
    }
    let middle = 16 * 40 + 20;
    assert!((channels["normal.Z"][middle] - 1.0).abs() < 1e-2);
    assert!(channels["depth.Z"][middle] > 0.0);
    assert_eq!(channels["depth.Z"][0].to_bits(), 0);
    let mut pixels = channels["A"].iter().zip(&channels["depth.Z"]);
    assert!(pixels.all(|(alpha, depth)| (*alpha > 0.0) == (*depth > 0.0)));
}

#[test]
fn single_outputs_are_written_alone() {
    let desk = disc();
    for (output, channels) in [
        ("depth", &["depth.Z"] as &[&str]),
        ("normal", &["normal.X", "normal.Y", "normal.Z"]),
        ("ao", &["ao.Y"]),
    ] {
        let arguments =
            format!("render disc.ply -o a.exr -o a.png --size 32 --camera front --output {output}");
        desk.run(&arguments).done();
        let (_, found) = read_exr(&desk.at("a.exr"));
        assert_eq!(found.keys().map(String::as_str).collect::<Vec<_>>(), channels);
        let picture = read_png(&desk.at("a.png"));
        assert_eq!(picture.get_pixel(0, 0).0, [0; 4], "{output}");
        assert_eq!(picture.get_pixel(16, 16)[3], 255, "{output}");
        if output == "normal" {
            let [x, y, z, _] = picture.get_pixel(16, 16).0;
            // Packed normals are good to a level or two.
            assert!(x.abs_diff(128) < 3 && y.abs_diff(128) < 3 && z > 252, "{x} {y} {z}");
        }
    }
}

#[test]
fn clouds_without_extent_render() {
    let desk = TestFolder::new();
    desk.put_cloud("none.ply", &[]);
    desk.put_cloud("one.ply", &[facing_front(5.0, 6.0, 0.25)]);
    desk.put_cloud("same.ply", &[facing_front(1e6, 0.0, 0.5); 30]);
    desk.put("bare.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n7 8 9\n");
    for renderer in ["flat", "ewa-phong"] {
        for (cloud, is_there) in [("none", false), ("one", true), ("same", true), ("bare", true)] {
            let arguments = format!(
                "render {cloud}.ply -r {renderer} -o a.png -o a.exr --size 32 --camera front --json"
            );
            let report = desk.run(&arguments).json();
            assert_eq!(report["pixels_not_finite"], 0, "{cloud}");
            let picture = read_png(&desk.at("a.png"));
            let n_covered = covered(&picture);
            assert_eq!(n_covered > 0, is_there, "{renderer} {cloud}: {n_covered}");
            let (_, channels) = read_exr(&desk.at("a.exr"));
            assert!(channels.values().flatten().all(|value| value.is_finite()), "{cloud}");
        }
    }
}

#[test]
fn several_clouds_share_a_picture() {
    let desk = TestFolder::new();
    desk.put_cloud("left.ply", &[facing_front(-2.0, 0.0, 1.0)]);
    desk.put_cloud("right.ply", &[facing_front(2.0, 0.0, 1.0)]);
    let report =
        desk.run("render left.ply right.ply -o a.png --size 64 --camera front --json").json();
    assert_eq!(report["facts"]["n_surfels"], 2);
    let picture = read_png(&desk.at("a.png"));
    assert_eq!(picture.get_pixel(32, 32)[3], 0);
    let (left, right) = (picture.get_pixel(11, 32)[3], picture.get_pixel(52, 32)[3]);
    assert_eq!((left, right), (255, 255));
}

#[test]
fn cameras_look_from_where_they_are() {
    let desk = disc();
    let n_covered = |options: &str| {
        desk.run(&format!("render disc.ply -o a.png --size 64 {options}")).done();
        covered(&read_png(&desk.at("a.png")))
    };
    let front = n_covered("--camera front");
    let parallel = n_covered("--camera front --orthographic");
    // The perspective camera stands at the sine, not the tangent: cos^2 of 17.5 degrees is 0.91.
    assert!(front.abs_diff(parallel) * 7 < front, "{front} {parallel}");
    assert!(n_covered("--camera front --zoom 0.5") * 3 < front);
    assert!(n_covered("--camera left") * 10 < front, "the disc is seen from its edge");
    assert!(n_covered("--camera back") * 10 > front * 9, "both sides are drawn");
    assert_eq!(n_covered("--camera back --one-sided"), 0);
    assert!(n_covered("--camera front --radius-scale 0.1") * 10 > front * 9, "framed by radius");
    let placed = ["render", "disc.ply", "-o", "a.png", "--size", "64", "--camera"];
    desk.run_with(&[&placed[..], &["0,0,4; 0,0,0; 0,1,0; 36"]].concat()).done();
    let picture = read_png(&desk.at("a.png"));
    assert_eq!((picture.get_pixel(0, 0)[3], covered(&picture) > front / 2), (0, true));
}

#[test]
fn json_reports_everything_and_nothing_else() {
    let report = disc().run("render disc.ply -o a.png --size 16 --set shininess=64 --json").json();
    assert_eq!(report["files"][0]["path"], "a.png");
    assert_eq!(report["files"][0]["width"], 16);
    assert_eq!(report["renderer"]["id"], "ewa-phong");
    assert_eq!(report["renderer"]["parameters"]["shininess"], 64.0);
    assert_eq!(report["clouds"][0]["n_surfels"], 1);
    assert!(report["adapter"]["name"].is_string());
    let passes = report["frame"]["passes"].as_array().unwrap();
    assert!(passes.iter().any(|pass| pass["state"] == "ran"), "{passes:?}");
    assert!(report["counters"]["compiled"]["pipelines"].as_u64().unwrap() > 0);
    assert!(report["timings"]["render_ms"].as_f64().unwrap() > 0.0);
}

#[test]
fn demo_renders_the_sample_with_every_renderer() {
    let desk = TestFolder::new();
    let text = desk.run("demo --out pictures --size 48").done().stdout;
    assert!(text.contains("Try next"), "{text}");
    for file in [
        "flat-three-quarter.png",
        "flat-close.png",
        "ewa-phong-three-quarter.png",
        "ewa-phong-close.png",
        "environment-three-quarter.png",
        "environment-close.png",
        "procedural-three-quarter.png",
        "procedural-close.png",
        "phong-splatting-three-quarter.png",
        "phong-splatting-close.png",
        "global-illumination-three-quarter.png",
        "global-illumination-close.png",
    ] {
        let picture = read_png(&desk.at("pictures").join(file));
        assert_eq!(picture.dimensions(), (48, 48));
        let reds = picture.pixels().filter(|p| p[0] > 120 && p[1] < p[0] / 2).count();
        assert!(reds > 50, "{file} shows the cap: {reds} red pixels");
    }
    let (size, _) = read_exr(&desk.at("pictures").join("ewa-phong-three-quarter.exr"));
    assert_eq!(size, (48, 48));
    assert_eq!(text.matches("48 x 48").count(), 13, "a line per file: {text}");
}

#[test]
fn antialiased_edges_are_smooth_and_other_outputs_those_of_one_frame() {
    let desk = disc();
    let bytes = |name: &str| std::fs::read(desk.at(name)).unwrap();
    let line = "render disc.ply --size 32 --camera front --low-pass 0 --json";
    desk.run(&format!("{line} -o sharp.exr")).json();
    let off = desk.run(&format!("{line} -o off.exr --antialias 1")).json();
    assert_eq!(
        (&off["frame"]["samples"], bytes("off.exr") == bytes("sharp.exr")),
        (&1.into(), true)
    );
    let told = desk.run(&format!("{line} -o smooth.exr --antialias 16")).json();
    assert_eq!((&told["frame"]["samples"], &told["frame"]["frames"]), (&16.into(), &16.into()));
    let [(_, sharp), (_, smooth)] =
        ["sharp.exr", "smooth.exr"].map(|name| read_exr(&desk.at(name)));
    let n_partly = |all: &[f32]| all.iter().filter(|a| **a > 0.0 && **a < 1.0).count();
    assert_eq!((n_partly(&sharp["A"]), n_partly(&smooth["A"]) > 40), (0, true));
    for (name, channel) in &sharp {
        let is_of_color = ["R", "G", "B", "A"].contains(&name.as_str());
        assert_eq!(*channel != smooth[name], is_of_color, "{name}");
    }
    // The same from a scene, unless something else is typed.
    desk.put("a.scene.toml", "format = 1\nantialias = 16\n[[clouds]]\npath = \"disc.ply\"\n");
    let line = line.replace("disc.ply", "a.scene.toml");
    desk.run(&format!("{line} -o scene.exr")).json();
    assert!(bytes("scene.exr") == bytes("smooth.exr"));
    desk.run(&format!("{line} -o typed.exr --antialias 1")).json();
    assert!(bytes("typed.exr") == bytes("sharp.exr"));
    assert!(desk.run("info a.scene.toml").done().stdout.contains("antialiased, 16 samples"));
}

#[test]
fn what_antialiasing_leaves_alone_and_refuses_is_said() {
    let desk = disc();
    let line = "render disc.ply -o a.png --size 8";
    for wrong in ["0", "1.5", "1025", "many"] {
        let words = ["a whole number of frames from 1 to 1024", wrong];
        desk.run(&format!("{line} --antialias {wrong}")).misused(&words);
    }
    let depth = desk.run(&format!("{line} --antialias 4 --output depth")).done();
    assert!(depth.stderr.contains("depth is that of one frame"), "{}", depth.stderr);
    let traced = desk.run(&format!("{line} --antialias 4 -r reference --set samples=2")).done();
    assert!(traced.stderr.contains("takes samples of its own"), "{}", traced.stderr);
    let told = desk.run("explain disc.ply -r flat --size 8 --antialias 4").done().stdout;
    assert!(told.contains("all of this 4 times"), "{told}");
    // All are seen at the same places of each pixel, so that equal renderers make equal pictures.
    let line =
        "compare disc.ply -r one=flat -r other=flat --size 16 --repeats 1 --antialias 4 -o out";
    let told = desk.run(&format!("{line} --json")).json();
    assert_eq!(
        (&told["antialias"], &told["renderers"][1]["errors"]["rmse"]),
        (&4.into(), &0.0.into())
    );
}
