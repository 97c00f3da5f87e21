//! Pyramids through the program: made, ended and gone on with, described and drawn. Costs 11 s.

use crate::cli::program::{TestFolder, read_png};
use std::process::Stdio;
use std::time::Duration;
use surfelshop_cloud::{Cloud, Column, WriteOptions};
use surfelshop_tests::clouds;

/// A file of bare points that takes several chunks of little memory.
fn put_points(desk: &TestFolder, name: &str, n: usize) {
    let whole = clouds::wavy_sphere(n);
    let columns: Vec<Column> = whole
        .columns()
        .iter()
        .filter(|c| ["position", "color"].contains(&c.name()))
        .cloned()
        .collect();
    let cloud = Cloud::new(whole.origin(), columns).unwrap();
    surfelshop_cloud::write(desk.at(name), &cloud, &WriteOptions::default()).unwrap();
}

/// Runs a command again and again, killed after so many milliseconds each, until it has written a file; then to its end.
pub(super) fn killed_at(desk: &TestFolder, command: &str, file: &str, times: &[u64]) {
    let mut n_killed = 0;
    for &milliseconds in times {
        let mut child = desk.command();
        let mut child = child.args(command.split(' ')).stdout(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(milliseconds));
        if child.try_wait().unwrap().is_none() {
            child.kill().unwrap();
            n_killed += 1;
        }
        child.wait().unwrap();
        if desk.at(file).exists() {
            break;
        }
    }
    assert!(n_killed >= 1, "too quick to be killed");
    desk.run(command).done();
}

#[test]
fn an_index_that_is_killed_goes_on_to_the_same_bytes() {
    let desk = TestFolder::new();
    put_points(&desk, "a.ply", 150_000);
    put_points(&desk, "b.ply", 120_000);
    desk.run("index a.ply b.ply -o whole.surfels --memory 64MB").done();
    let command = "index a.ply b.ply -o parts.surfels --memory 64MB";
    killed_at(&desk, command, "parts.surfels", &[60, 250, 500, 900, 1500]);
    let bytes = |name: &str| std::fs::read(desk.at(name)).unwrap();
    assert!(bytes("whole.surfels") == bytes("parts.surfels"));
    let left: Vec<String> = desk.files();
    assert!(!left.iter().any(|name| name.contains(".index") || name.contains(".part")), "{left:?}");
}

/// A second.
#[test]
fn an_index_that_the_disk_does_not_hold_is_a_line_and_goes_on_to_the_same_bytes() {
    let desk = TestFolder::new();
    put_points(&desk, "a.ply", 150_000);
    desk.run("index a.ply -o whole.surfels --memory 64MB").done();
    let command = "index a.ply -o out.surfels --memory 64MB";
    // A megabyte for each file, which is less than the points take. The signal that would end the program is turned into
    // an error, as a full disk is.
    let arguments: Vec<&str> = command.split(' ').collect();
    let ended = desk.run_within("trap '' XFSZ; ulimit -f 2048", &arguments);
    let said = ended.stderr;
    assert_eq!(ended.code, 1, "{said}");
    let lines: Vec<&str> = said.lines().collect();
    assert!(
        lines.len() == 2 && lines[0].ends_with("the same command goes on from there"),
        "{said}"
    );
    assert!(lines[1].contains("out.surfels.index/points") && lines[1].contains(": "), "{said}");
    assert!(!desk.at("out.surfels").exists());
    desk.run(command).done();
    let bytes = |name: &str| std::fs::read(desk.at(name)).unwrap();
    assert!(bytes("whole.surfels") == bytes("out.surfels"));
}

#[test]
fn a_pyramid_is_described_and_drawn() {
    let desk = TestFolder::new();
    put_points(&desk, "a.ply", 150_000);
    let line = desk.run("index a.ply -o a.surfels --memory 64MB").done().stdout;
    assert!(line.starts_with("a.surfels: 150000 surfels in "), "{line}");
    let told = desk.run("info a.surfels").done().stdout;
    assert!(told.contains("surfels   150000 in ") && told.contains("color 3 x u8"), "{told}");
    let object = desk.run("info a.surfels --json").json();
    assert_eq!(object["clouds"][0]["pyramid"]["n_surfels"], 150_000);
    // From afar the parts are merged, and where nothing is merged all are drawn.
    let n_drawn = |detail: &str| {
        let told = desk
            .run(&format!("render a.surfels -o {detail}.png --size 96 --detail {detail} --json"));
        told.json()["counters"]["drawn_surfels"].as_u64().unwrap()
    };
    let (all, few) = (n_drawn("0"), n_drawn("4"));
    assert!(all >= 150_000 && few * 3 < all, "{all} and {few}");
    let (a, b) = (read_png(&desk.at("0.png")), read_png(&desk.at("4.png")));
    let covered =
        |picture: &image::RgbaImage| picture.pixels().filter(|pixel| pixel[3] > 0).count();
    let (a, b) = (covered(&a) as f64, covered(&b) as f64);
    assert!(a > 1000.0 && (b / a - 1.0).abs() < 0.1, "{a} and {b} pixels");
    // Few enough to be traced as they are.
    let traced =
        desk.run("render a.surfels -r reference -o t.png --size 16 --set samples=1").done();
    assert!(traced.stderr.is_empty(), "{}", traced.stderr);
}

#[test]
fn what_cannot_be_indexed_or_opened_is_one_line() {
    let desk = TestFolder::new();
    put_points(&desk, "a.ply", 100);
    desk.run("index nothing.ply -o a.surfels").failed(&["nothing.ply"]);
    desk.run("index a.ply -o a.ply").misused(&[".surfels"]);
    desk.run("index a.ply -o a.surfels --memory 3").misused(&["500MB", "3"]);
    desk.run("index a.ply -o a.surfels").done();
    let whole = std::fs::read(desk.at("a.surfels")).unwrap();
    std::fs::write(desk.at("cut.surfels"), &whole[..whole.len() / 2]).unwrap();
    let mut changed = whole.clone();
    changed[70] ^= 1;
    std::fs::write(desk.at("changed.surfels"), changed).unwrap();
    for name in ["cut.surfels", "changed.surfels"] {
        desk.run(&format!("render {name} -o x.png --size 16")).failed(&[name, "damaged", "index"]);
    }
    desk.put("empty.surfels", "");
    desk.run("info empty.surfels").failed(&["empty.surfels"]);
}
