//! File formats through the program: which plugins are loaded, what is kept, and what is said of it. Costs 6 s.

use crate::cli::program::{TestFolder, facing_front, read_png};
use serde_json::Value;

/// A cloud of 400 surfels in a plane.
fn desk() -> TestFolder {
    let desk = TestFolder::new();
    let surfels: Vec<_> =
        (0..400).map(|i| facing_front((i % 20) as f32, (i / 20) as f32, 0.75)).collect();
    desk.put_cloud("in.ply", &surfels);
    desk
}

/// Endings of files that are written.
const WRITTEN: [&str; 14] = [
    "las",
    "laz",
    "e57",
    "pcd",
    "xyz",
    "csv",
    "pts",
    "ptx",
    "sfl",
    "ply",
    "spz",
    "splat",
    "sog",
    "compressed.ply",
];

fn formats_loaded(told: &Value) -> u64 {
    told["formats_loaded"].as_u64().unwrap_or_else(|| panic!("{told}"))
}

/// Invariant: a command whose files need no plugin's format loads none, and else those that it needs
#[test]
fn only_formats_that_files_need_are_loaded() {
    let desk = desk();
    desk.put("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    desk.put("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    for output in ["x.las", "y.laz", "z.e57"] {
        desk.run(&format!("convert in.ply {output}")).done();
    }
    for (files, n_loaded) in [
        ("in.ply", 0),
        ("in.ply a.obj a.off", 0),
        ("x.las", 1),
        ("x.las y.laz in.ply", 1),
        ("x.las z.e57", 2),
    ] {
        for how in ["", " --full"] {
            let told = desk.run(&format!("info {files}{how} --json")).json();
            assert_eq!(formats_loaded(&told), n_loaded, "{files}{how}");
        }
    }
}

#[test]
fn every_format_that_is_written_is_read_and_drawn() {
    let desk = desk();
    for ending in WRITTEN {
        let ended = desk.run(&format!("convert in.ply out.{ending}")).done();
        // What a format does not hold is in lines of its own.
        let columns = if ended.stderr.is_empty() { " with position" } else { "" };
        let line = ended.stdout;
        assert!(line.starts_with(&format!("out.{ending}: 400 points{columns}")), "{line}");
        let cloud = desk.run(&format!("info out.{ending} --json")).json()["clouds"][0].clone();
        // One stands at zero, which is no return in PTX: it stays, a little beside.
        assert_eq!(cloud["n_points"], 400, "{ending}");
        let ends: Vec<f64> = cloud["bounds"]
            .as_array()
            .unwrap()
            .iter()
            .map(|end| end[0].as_f64().unwrap())
            .collect();
        assert!(ends[0].abs() < 1e-3 && (ends[1] - 19.0).abs() < 1e-3, "{ending}: {ends:?}");
    }
    for ending in ["las", "e57", "ptx"] {
        let picture = format!("{ending}.png");
        desk.run(&format!("render out.{ending} -r flat --camera front --size 16 -o {picture}"))
            .done();
        assert_eq!(read_png(&desk.at(&picture)).get_pixel(8, 8)[3], 255, "{ending}");
    }
}

/// The longest ending that a format has says which one writes: `.compressed.ply` is no plain PLY.
#[test]
fn the_longest_ending_says_what_is_written() {
    let desk = desk();
    for (name, format, n_loaded) in
        [("a.compressed.ply", "compressed PLY", 1), ("a.b.ply", "PLY, binary", 0)]
    {
        desk.run(&format!("convert in.ply {name}")).done();
        let told = desk.run(&format!("info {name} --json")).json();
        assert_eq!(formats_loaded(&told), n_loaded, "{name}");
        let found = told["clouds"][0]["header"]["format"].as_str().unwrap();
        assert!(found.starts_with(format), "{name}: {found}");
    }
}

#[test]
fn losses_are_said_in_lines_and_in_json() {
    let desk = desk();
    let ended = desk.run("convert in.ply out.pts").done();
    for column in ["normal", "radius"] {
        let says = |line: &str| line.starts_with("surfelshop: warning: ") && line.contains(column);
        assert!(ended.stderr.lines().any(says), "{column}: {}", ended.stderr);
    }
    let told = desk.run("convert in.ply out.pts --json").json();
    assert_eq!(told["lost"].as_array().unwrap().len(), ended.stderr.lines().count(), "{told}");
    // What holds everything loses nothing.
    assert_eq!(desk.run("convert in.ply out.pcd").done().stderr, "");
}

#[test]
fn parameters_of_the_format_that_is_written_are_set() {
    let desk = desk();
    let format = |line: &str, file: &str| {
        desk.run(&format!("convert in.ply {file} {line}")).done();
        let cloud = desk.run(&format!("info {file} --json")).json()["clouds"][0].clone();
        cloud["header"]["format"].as_str().unwrap().to_owned()
    };
    assert_eq!(format("", "a.pcd"), "PCD 0.7, binary");
    assert_eq!(format("--write-set encoding=ascii", "b.pcd"), "PCD 0.7, ascii");
    assert_eq!(format("--write-set encoding=ascii --estimate", "c.pcd"), "PCD 0.7, ascii");
    assert!(format("", "a.las").starts_with("LAS 1.2"));
    assert!(format("--write-set version=1.4", "b.las").starts_with("LAS 1.4"));
    desk.run("convert in.ply d.las --write-set version=1.3").failed(&["version", "1.2"]);
    desk.run("convert in.ply d.pcd --write-set colour=1").failed(&["no parameter `colour`"]);
    desk.run("convert in.ply d.ply --write-set a=1").failed(&["--write-set", "PLY"]);
    assert!(!desk.at("d.las").exists() && !desk.at("d.ply").exists());
}

#[test]
fn points_and_columns_are_chosen_on_the_command_line() {
    let desk = desk();
    let written = |options: &str| {
        let told = desk.run(&format!("convert in.ply out.las {options} --json")).json();
        (told["written"].as_u64().unwrap(), told["columns"].as_array().unwrap().len())
    };
    assert_eq!(written(""), (400, 3));
    assert_eq!(written("--every 3"), (134, 3));
    assert_eq!(written("--crop -1,-1,-1:4,4,1"), (25, 3));
    assert_eq!(written("--crop -1,-1,-1:4,4,1 --every 2 --columns radius"), (15, 2));
    desk.run("convert in.ply out.las --crop 1,1:2,2").misused(&["X,Y,Z:X,Y,Z"]);
    desk.run("convert in.ply out.las --every 0").misused(&["--every"]);
    desk.run("convert in.ply in.ply two.ply --json").json();
    let told = desk.run("info two.ply --json").json();
    assert_eq!(told["clouds"][0]["n_points"], 800);
    let columns = told["clouds"][0]["header"]["columns"].as_array().unwrap().clone();
    assert!(columns.iter().any(|column| column["name"] == "scan"), "{columns:?}");
}

#[test]
fn columns_of_text_files_are_named_on_the_command_line() {
    let desk = TestFolder::new();
    let lines: Vec<String> =
        (0..50).map(|i| format!("{} {} {} {} {}", i, i % 7, i % 3, i * 3, 1000 - i)).collect();
    desk.put("scan.dat", &lines.join("\n"));
    desk.put("scan.xyz", &lines.join("\n"));
    desk.run("info scan.dat").failed(&["scan.dat", "expected a PLY, OBJ, OFF, "]);
    let names = |line: &str| {
        let told = desk.run(line).json()["clouds"][0]["header"]["columns"].clone();
        let columns = told.as_array().unwrap().clone();
        columns.iter().map(|column| column["name"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let line = "info scan.dat --format xyz --text-columns x,y,z,intensity,- --json";
    assert_eq!(names(line), ["position", "intensity"]);
    let line = "info scan.xyz --text-columns x,y,z,-,depth --json";
    assert_eq!(names(line), ["position", "depth"]);
    let line = "info scan.xyz --format-set columns=x,y,z,-,depth --json";
    assert_eq!(names(line), ["position", "depth"]);
    desk.run("info scan.xyz --format-set nonsense=1")
        .failed(&["no parameter `nonsense`", "columns"]);
    desk.run("info scan.xyz --format nonsense").failed(&["`nonsense`"]);
    desk.run("info scan.xyz --text-columns x,y").failed(&["scan.xyz"]);
}

#[test]
fn a_file_of_another_format_than_its_name_is_read_by_its_content() {
    let desk = desk();
    desk.run("convert in.ply out.las").done();
    std::fs::rename(desk.at("out.las"), desk.at("out.xyz")).unwrap();
    let cloud = desk.run("info out.xyz --json").json()["clouds"][0].clone();
    assert!(cloud["header"]["format"].as_str().unwrap().contains("LAS"), "{cloud}");
    desk.run("info out.xyz --format e57").failed(&["out.xyz"]);
}

/// A wall on a map stands upright, though its file does not say which axis points up. Costs 1 s.
#[test]
fn coordinates_of_a_map_have_z_pointing_up() {
    let desk = TestFolder::new();
    let rows = |[east, north]: [f64; 2]| -> String {
        (0..400)
            .map(|i| {
                let (along, up) = (f64::from(i % 40) * 0.5, f64::from(i / 40) * 0.5);
                format!("{} {} {}\n", east + along, north + 0.3 * along, 73.5 + up)
            })
            .collect()
    };
    let head = "ply\nformat ascii 1.0\nelement vertex 400\nproperty double x\nproperty double y\n\
                property double z\nend_header\n";
    desk.put("map.ply", &format!("{head}{}", rows([596_648.0, 243_620.0])));
    desk.put("model.ply", &format!("{head}{}", rows([5.0, 3.0])));
    let told = |name: &str| desk.run(&format!("info {name} --full")).done().stdout;
    assert!(told("map.ply").contains("z, by coordinates that are places on a map"));
    assert!(!told("model.ply").contains("places on a map"));
    let picture = |name: &str, up: &str| {
        desk.run(&format!("render {name} -o out.png --size 96x64 {up}")).done();
        read_png(&desk.at("out.png"))
    };
    assert!(picture("map.ply", "") == picture("map.ply", "--up z"), "it stands");
    assert!(picture("map.ply", "") != picture("map.ply", "--up y"));
    assert!(picture("model.ply", "") == picture("model.ply", "--up y"));
    desk.run("bake map.ply -t normals -o baked.sfl").done();
    assert!(picture("baked.sfl", "") == picture("baked.sfl", "--up z"), "what is written says it");
}
