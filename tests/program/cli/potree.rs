//! Octrees of Potree through the program: three files that are read as one, whole and in place. Costs 6 s.

use crate::cli::program::{TestFolder, read_png};
use glam::DVec3;
use serde_json::Value;
use std::fs;
use surfelshop_cloud::ReadOptions;
use surfelshop_tests::octree::write_octree;

/// Points of a ball, in coordinates of a map.
fn ball() -> Vec<DVec3> {
    let turn = std::f64::consts::TAU / 1.618_033_988_749_895;
    let point = |i: u32| {
        let z = 1.0 - (f64::from(i) + 0.5) / 4000.0;
        let (sine, cosine) = (f64::from(i) * turn).sin_cos();
        let across = (1.0 - z * z).sqrt();
        DVec3::new(600_000.0, 4_900_000.0, 100.0)
            + 20.0 * DVec3::new(across * cosine, across * sine, z)
    };
    (0..8000).map(point).collect()
}

fn desk() -> TestFolder {
    let desk = TestFolder::new();
    drop(write_octree(&desk.at("town"), &ball()));
    desk
}

/// Invariant: the files of an octree are read as one, by the name of the first or of their folder
#[test]
fn an_octree_is_read_by_its_index_and_by_its_folder() {
    let desk = desk();
    for name in ["town/metadata.json", "town"] {
        let told: Value =
            serde_json::from_str(&desk.run(&format!("info {name} --json")).done().stdout).unwrap();
        assert_eq!(told["clouds"][0]["n_points"], 8000, "{told}");
        desk.run(&format!("convert {name} back.ply")).done();
        let back =
            surfelshop_cloud::read(desk.at("back.ply"), &ReadOptions::default()).unwrap().cloud;
        assert_eq!(back.len(), 8000);
        // Whole steps of a cube of 40 units.
        let mut expected = ball();
        let mut found: Vec<DVec3> =
            back.positions().iter().map(|place| back.origin() + place.as_dvec3()).collect();
        for points in [&mut expected, &mut found] {
            points.sort_by(|a, b| a.z.total_cmp(&b.z));
        }
        let furthest = expected.iter().zip(&found).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        assert!(furthest < 40.0 / 65536.0, "{furthest}");
    }
    for (file, line) in [
        ("octree.bin", "expected the file `octree.bin` beside it, found none"),
        ("hierarchy.bin", "expected the file `hierarchy.bin` beside it, found none"),
    ] {
        let (path, kept) = (desk.at("town").join(file), desk.at("kept"));
        fs::rename(&path, &kept).unwrap();
        desk.run("info town/metadata.json --full").failed(&["metadata.json", line]);
        fs::rename(&kept, &path).unwrap();
    }
    let listed = desk.run("plugins").done().stdout;
    assert!(
        listed.contains("metadata.json; read; opens hierarchy.bin, octree.bin beside it"),
        "{listed}"
    );
}

/// Invariant: of an octree in place the same points are drawn as of the whole file
#[test]
fn an_octree_is_drawn_in_place() {
    let desk = desk();
    let view =
        "-r ewa-phong --size 128 --up z --camera 600000,4899940,110;600000,4900000,100;0,0,1";
    desk.run(&format!("render town {view} --in-place --detail 0 -o in-place.png")).done();
    desk.run(&format!("render town {view} -o whole.png")).done();
    let [in_place, whole] = ["in-place.png", "whole.png"].map(|name| read_png(&desk.at(name)));
    // Of 8 bits in 16, which no cell alone tells; radii of cells are estimated by their own points.
    let far = |(a, b): &(&image::Rgba<u8>, &image::Rgba<u8>)| {
        a.0.iter().zip(&b.0).any(|(a, b)| a.abs_diff(*b) > 24)
    };
    let n_far = in_place.pixels().zip(whole.pixels()).filter(far).count();
    assert!(n_far < 128 * 128 / 25, "{n_far}");
    let greys = whole.pixels().filter(|pixel| pixel.0[0] > 40 && pixel.0[3] == 255).count();
    assert!(greys > 128 * 128 / 8, "{greys}");
    // As 16 bits, which they are by their type, they are nearly black.
    desk.run(&format!("render town {view} --in-place --detail 0 --color-bits 16 -o dark.png"))
        .done();
    let dark = read_png(&desk.at("dark.png"));
    let sum = |picture: &image::RgbaImage| -> u64 {
        let of_ball = picture.pixels().zip(whole.pixels()).filter(|(_, w)| w.0[0] > 40);
        of_ball.map(|(pixel, _)| u64::from(pixel.0[1])).sum()
    };
    let sums = [sum(&dark), sum(&in_place)];
    assert!(2 * sums[0] < sums[1], "{sums:?}");
    desk.run("index town -o town.surfels").done();
}
