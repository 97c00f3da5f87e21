//! Files that announce or take more memory than there is: success or one line, never an abort. Costs 5 s.

#![cfg(unix)]

use crate::program::{Desk, Ended};
use std::fs::{self, File};
use std::process::Command;

/// Runs the program with at most so many MiB of addresses.
fn run_within(desk: &Desk, mib: u64, arguments: &str) -> Ended {
    let command = desk.command();
    let mut shell = Command::new("sh");
    shell.args(["-c", &format!("ulimit -v {}; exec \"$@\"", mib * 1024), "sh"]);
    shell.arg(command.get_program()).args(arguments.split(' ')).current_dir(desk.at(""));
    shell.envs(command.get_envs().filter_map(|(name, value)| Some((name, value?))));
    let output = shell.output().unwrap();
    Ended {
        code: output.status.code().unwrap_or(-1),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

/// A binary cloud of so many points in no order; with normals and radii where it is `whole`.
fn put_points(desk: &Desk, name: &str, n_points: u32, whole: bool) {
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
    let desk = Desk::new();
    put_points(&desk, "bare.ply", 60_000, false);
    put_points(&desk, "whole.ply", 2_000_000, true);
    for (command, least, most) in [
        ("info bare.ply", 60, 500),
        ("info whole.ply", 60, 500),
        ("convert whole.ply out.ply", 60, 500),
    ] {
        let mut outcomes = Vec::new();
        for mib in (least..=most).step_by(55) {
            let ended = run_within(&desk, mib, command);
            if ended.code != 0 {
                ended.failed(&[]);
            }
            outcomes.push(ended.code);
        }
        // The limits were chosen so that both happen.
        assert!(outcomes.contains(&0) && outcomes.contains(&1), "{command}: {outcomes:?}");
    }
}

#[test]
fn what_a_file_announces_is_asked_for_before_it_is_taken() {
    let desk = Desk::new();
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
        ("info points.ply", ["8000000000 points are too many", "of memory are needed"]),
        ("convert points.ply out.ply", ["8000000000 points are too many", "are needed"]),
        ("info line.obj", ["expected at most 16777216 bytes in a line", "line 2"]),
        ("info probe.hdr", ["expected at most 134217728 pixels", "16384 x 16384"]),
        ("render many.scene.toml -o y.png", ["expected at most 4096 clouds", "found 5000"]),
    ] {
        desk.run(command).failed(&words);
    }
}
