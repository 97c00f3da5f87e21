//! Files that announce or take more memory than there is: success or one line, never an abort. Costs 5 s.

#![cfg(unix)]

use crate::cli::program::TestFolder;
use std::fs::{self, File};
use std::process::Command;

/// A binary cloud of so many points in no order; with normals and radii where it is `whole`.
fn put_points(desk: &TestFolder, name: &str, n_points: u32, whole: bool) {
    let mut bytes =
        format!("ply\nformat binary_little_endian 1.0\nelement vertex {n_points}\n").into_bytes();
    let properties = if whole { "x y z nx ny nz radius" } else { "x y z" };
    properties.split(' ').for_each(|p| bytes.extend(format!("property float {p}\n").bytes()));
    bytes.extend(b"end_header\n");
    let mut state = 1u32;
    let mut next = || {
        // Numerical Recipes' generator: any disorder will do.
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    for _ in 0..n_points {
        [next(), next(), next()].iter().for_each(|c| bytes.extend(c.to_le_bytes()));
        if whole {
            [0.0f32, 0.0, 1.0, 0.01].iter().for_each(|c| bytes.extend(c.to_le_bytes()));
        }
    }
    fs::write(desk.at(name), bytes).unwrap();
}

#[test]
fn loads_that_run_out_of_memory_are_one_line() {
    let desk = TestFolder::new();
    put_points(&desk, "bare.ply", 60_000, false);
    put_points(&desk, "whole.ply", 2_000_000, true);
    // The program alone takes 63 MiB of addresses: with fewer it does not begin.
    for (command, least, most) in [
        ("info bare.ply --full", 70, 500),
        ("info whole.ply --full", 70, 500),
        ("convert whole.ply out.ply --estimate", 70, 500),
    ] {
        let mut outcomes = Vec::new();
        for mib in (least..=most).step_by(55) {
            let limit = format!("ulimit -v {}", mib * 1024);
            let arguments: Vec<&str> = command.split(' ').collect();
            let ended = desk.run_within(&limit, &arguments);
            if ended.code != 0 {
                ended.failed(&[]);
            }
            outcomes.push(ended.code);
        }
        // The limits were chosen so that both happen.
        assert!(outcomes.contains(&0) && outcomes.contains(&1), "{command}: {outcomes:?}");
    }
}

/// Invariant: what a file announces is asked for before it is taken: success or one line at any
/// limit on memory
#[test]
fn what_a_file_announces_is_asked_for_before_it_is_taken() {
    let desk = TestFolder::new();
    // None of these bytes are on the disk.
    let sparse = |name: &str, start: &str, length: u64| {
        desk.put(name, start);
        File::options().append(true).open(desk.at(name)).unwrap().set_len(length).unwrap();
    };
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 8000000000\nproperty float \
                  x\nproperty float y\nproperty float z\nend_header\n";
    sparse("points.ply", header, 100 << 30);
    sparse("line.obj", "v 0 0 0\n", 4 << 30);
    let mut probe = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16384 +X 16384\n".to_vec();
    let run: Vec<u8> = (0..129).flat_map(|_| [128 + 127, 128]).chain([128 + 1, 128]).collect();
    probe.extend((0..16384).flat_map(|_| [vec![2, 2, 64, 0], run.repeat(4)].concat()));
    fs::write(desk.at("probe.hdr"), probe).unwrap();
    desk.put(
        "many.scene.toml",
        &format!("format = 1\n{}", "[[clouds]]\npath = 'a'\n".repeat(5000)),
    );
    for (command, words) in [
        ("info points.ply --full", ["8000000000 points are too many", "of memory are needed"]),
        ("convert points.ply out.ply --estimate", ["8000000000 points are too many", "are needed"]),
        ("info points.ply", ["8000000000 points are more than", "2^32"]),
        ("convert points.ply out.ply", ["8000000000 points are more than", "2^32"]),
        ("info line.obj", ["expected at most 16777216 bytes in a line", "line 2"]),
        ("info probe.hdr", ["expected at most 134217728 pixels", "16384 x 16384"]),
        ("render many.scene.toml -o y.png", ["expected at most 4096 clouds", "found 5000"]),
    ] {
        desk.run(command).failed(&words);
    }
}

/// A pattern file whose functions each call the one before twice.
fn doubling(n: u8) -> String {
    let name = |i: u8| char::from(b'a' + i);
    let mut text = "#import surfelshop::noise::Place\n#import procedural::pattern::{Look}\n\
                    fn f_a(x: f32) -> f32 { return sin(x) * x; }\n"
        .to_owned();
    for i in 1..n {
        let (own, before) = (name(i), name(i - 1));
        text += &format!("fn f_{own}(x: f32) -> f32 {{ return f_{before}(f_{before}(x)); }}\n");
    }
    text + &look(&format!("f_{}(albedo.x)", name(n - 1)))
}

fn look(value: &str) -> String {
    format!(
        "fn look(at: Place, albedo: vec3<f32>) -> Look {{ return Look(albedo * {value}, 0.0, 0.5, \
         0.0); }}\n"
    )
}

/// Invariant: shaders that would explode in a driver are refused with pass and function
#[test]
fn shaders_that_would_explode_are_refused_with_pass_and_function() {
    let desk = TestFolder::new();
    put_points(&desk, "whole.ply", 10, true);
    desk.put("calls.wgsl", &doubling(19));
    let sum = vec!["x"; 12_000].join(" + ");
    let head = "#import surfelshop::noise::Place\n#import procedural::pattern::{Look}\n";
    let sum = format!("{head}fn sum_of(x: f32) -> f32 {{ return {sum}; }}\n");
    desk.put("sum.wgsl", &(sum + &look("sum_of(albedo.x)")));
    desk.put("few.wgsl", &doubling(5));
    let copies = "fn g(q: f32) -> f32 { var s = array<f32, 16384>(); var t = s; t[u32(q)] = q; s = t; return \
                  s[u32(q)]; }\n";
    desk.put("copies.wgsl", &format!("{head}{copies}{}", look("g(albedo.x)")));
    let one = "for (var i = 0; i < i32(x); i++) { x = x * 0.5 + 1.0; }\n";
    let loops = format!("fn g(q: f32) -> f32 {{ var x = q; {} return x; }}\n", one.repeat(20));
    desk.put("loops.wgsl", &format!("{head}{loops}{}", look("g(albedo.x)")));
    let twice = |i: u8| format!("const a_{} = array(a_{i}, a_{i});\n", i + 1);
    let constants: String = (0..24).map(twice).collect();
    desk.put("constants.wgsl", &format!("{head}const a_0 = 1.0;\n{constants}{}", look("albedo.x")));
    let render = "render whole.ply -r procedural -o y.png --size 16 --set file=";
    for (file, words) in [
        ("calls.wgsl", ["pass `procedural`: function `", "with those of all functions it calls"]),
        (
            "sum.wgsl",
            ["pass `procedural`: ", "sum.wgsl, line 3: a statement has more than 8192 words"],
        ),
        ("copies.wgsl", ["pass `procedural`: function `", "put long arrays into buffers"]),
        ("loops.wgsl", ["pass `procedural`: function `", "20 loops one after another"]),
        ("constants.wgsl", ["pass `procedural`: constant `a_", "written out"]),
    ] {
        desk.run(&format!("{render}{file}")).failed(&words);
    }
    desk.run(&format!("{render}few.wgsl")).done();
    // A scene that came from a third party.
    desk.put(
        "a.scene.toml",
        "format = 1\n[[clouds]]\npath = 'whole.ply'\n[[views]]\nrenderer = \
         'procedural'\nvalues = { file = 'calls.wgsl' }\n",
    );
    desk.run("render a.scene.toml -o y.png --size 16").failed(&["function `", "call fewer"]);
    // A pipe is not waited for.
    assert!(Command::new("mkfifo").arg(desk.at("pipe.wgsl")).status().unwrap().success());
    desk.run(&format!("{render}pipe.wgsl")).failed(&["pipe.wgsl", "found something else"]);
}

#[test]
fn shaders_of_this_project_are_far_below_what_is_refused() {
    let desk = TestFolder::new().with("SURFELSHOP_LOG", "surfelshop_render::shader=debug");
    put_points(&desk, "whole.ply", 10, true);
    let mut most = 0u64;
    for renderer in ["environment", "procedural", "global-illumination"] {
        let light = if renderer == "global-illumination" { "" } else { " --env sky" };
        let ended = desk.run(&format!("render whole.ply -r {renderer} -o y.png --size 16{light}"));
        assert_eq!(ended.code, 0, "{ended:?}");
        for line in ended.stderr.lines().filter(|line| line.contains("operations of a shader")) {
            // Whatever colours the log has.
            let digits = line.rsplit(|c: char| !c.is_ascii_digit()).find(|word| !word.is_empty());
            most = most.max(digits.unwrap().parse().unwrap());
        }
    }
    // 9,412 when this was written; three times as many must still be compiled.
    assert!(most > 1000 && 3 * most <= 32_768, "{most}");
}
