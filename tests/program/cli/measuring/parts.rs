//! Work in parts: the same errors, pixels and bytes as in one piece, and no merging of what is incomplete. Costs 20 s.

use crate::cli::program::{TestFolder, facing_front};
use serde_json::Value;
use surfelshop_cloud::{Cloud, Column, WriteOptions};
use surfelshop_tests::clouds;

const SMALL: &str = "--size 40 --camera front";

fn two() -> TestFolder {
    let folder = TestFolder::new();
    folder.put_cloud("two.ply", &[facing_front(-0.5, 0.0, 1.0), facing_front(0.7, 0.2, 0.6)]);
    folder
}

fn json(folder: &TestFolder, name: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(folder.at(name)).unwrap()).unwrap()
}

/// Names and contents of the files in a folder that end so.
fn pictures(folder: &TestFolder, name: &str, ending: &str) -> Vec<(String, Vec<u8>)> {
    let entries = folder.at(name).read_dir().unwrap().map(|entry| entry.unwrap().path());
    let mut all: Vec<(String, Vec<u8>)> = entries
        .filter(|path| path.extension().is_some_and(|e| e == ending))
        .map(|path| {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            (name, std::fs::read(&path).unwrap())
        })
        .collect();
    all.sort();
    all
}

/// Invariant: parts that are merged have the errors and the pixels of the whole
#[test]
fn a_report_in_parts_has_the_errors_of_the_whole() {
    let folder = two();
    let line = format!(
        "report two.ply -r ewa-phong --reference ewa-phong --reference-set ambient=1 {SMALL} --repeats 1 \
         --knob ambient=0,0.25,0.5,0.75,0.9 --knob detail=0,1,2"
    );
    // Of a knob of the host with the reference's own settings.
    let line = line.replace(" --knob detail=0,1,2", " --knob specular=0,0.5,1");
    folder.run(&format!("{line} -o whole")).done();
    let made = folder.run(&format!("{line} -o parts --part 0/3")).done();
    assert!(made.stdout.contains("the reference"), "{made:?}");
    for number in [3, 1] {
        let part = folder.run(&format!("{line} -o parts --part {number}/3")).done();
        assert!(part.stderr.is_empty(), "the reference is there: {}", part.stderr);
    }
    folder.run("merge parts -o merged").failed(&["part 2 of 3 is missing", "--part 2/3"]);
    assert!(!folder.at("merged").exists(), "nothing is written");
    folder.run(&format!("{line} -o parts --part 2/3")).done();
    // A part that is run again does nothing twice.
    let times = || json(&folder, "parts/part-2-of-3/part.json")["of"]["swept"]["all"].clone();
    let before = times();
    folder.run(&format!("{line} -o parts --part 2/3")).done();
    assert_eq!(times(), before);
    folder.run("merge parts -o merged").done();
    let errors = |name: &str| -> Vec<Value> {
        let told = json(&folder, name);
        let knobs = told["knobs"].as_array().unwrap().clone();
        let cells = knobs.iter().flat_map(|knob| knob["cells"].as_array().unwrap().clone());
        cells
            .map(|cell| serde_json::json!([cell["value"], cell["errors"], cell["noise"]]))
            .collect()
    };
    assert_eq!(errors("merged/report.json").len(), 8);
    assert_eq!(errors("merged/report.json"), errors("whole/report.json"));
    let csv = std::fs::read_to_string(folder.at("merged/report.csv")).unwrap();
    assert!(csv.lines().next().unwrap().contains("\"machine\""), "{csv}");
    assert!(folder.at("merged/index.html").is_file() && folder.at("merged/ambient.svg").is_file());
    // Other options, then another file.
    folder.run(&format!("{line} -o parts --part 2/3 --exposure 1")).done();
    folder.run("merge parts -o merged").failed(&["part 2 of 3", "other options"]);
    folder.run(&format!("{line} -o parts --part 2/3")).done();
    folder.put_cloud("two.ply", &[facing_front(-0.5, 0.0, 1.0), facing_front(0.7, 0.2, 0.5)]);
    folder.run(&format!("{line} -o parts --part 0/3")).done();
    folder.run(&format!("{line} -o parts --part 3/3")).done();
    folder.run("merge parts -o merged").failed(&["another two.ply", "part 3 of 3"]);
}

#[test]
fn a_film_in_parts_has_the_pixels_of_the_whole_and_goes_on() {
    let folder = two();
    let line = format!("render two.ply -r ewa-phong {SMALL} --path orbit:7");
    std::fs::create_dir(folder.at("whole")).unwrap();
    std::fs::create_dir(folder.at("parts")).unwrap();
    folder.run(&format!("{line} -o whole/a.png -o whole/a.exr")).done();
    assert_eq!(pictures(&folder, "whole", "png").len(), 7);
    for number in 1..=3 {
        folder.run(&format!("{line} -o parts/a.png -o parts/a.exr --part {number}/3")).done();
    }
    // What is there is not drawn again; what was changed or lost is.
    let lost = folder.at("parts/part-1-of-3/a-4.png");
    std::fs::write(&lost, "nonsense").unwrap();
    folder.run("merge parts -o film").failed(&["a-4.png", "part 1 of 3"]);
    let again =
        folder.run(&format!("{line} -o parts/a.png -o parts/a.exr --part 1/3 --json")).json();
    assert_eq!((again["n_known"].as_u64(), again["n_frames"].as_u64()), (Some(2), Some(7)));
    folder.run("merge parts -o film").done();
    for ending in ["png", "exr"] {
        assert!(pictures(&folder, "film", ending) == pictures(&folder, "whole", ending));
    }
    let told = json(&folder, "film/pictures.json");
    assert_eq!(told["frames"].as_array().unwrap().len(), 7);
    assert!(told["frames"][6]["machine"]["threads"].as_u64().unwrap() > 0);
    folder.run("render two.ply -o a.png --part 1/2").misused(&["--path"]);
    folder.run("render two.ply -o a.png --path orbit:0").misused(&["orbit:N"]);
}

#[test]
fn a_comparison_in_parts_has_the_numbers_of_the_whole() {
    let folder = two();
    let line = format!("compare two.ply -r flat -r ewa-phong {SMALL} --repeats 1 --path orbit:5");
    folder.run(&format!("{line} -o whole")).done();
    for number in 1..=2 {
        folder.run(&format!("{line} -o parts --part {number}/2")).done();
    }
    folder.run("merge parts -o merged").done();
    let errors = |name: &str| -> Vec<Value> {
        let told = json(&folder, name);
        let each = told["renderers"].as_array().unwrap().iter();
        each.map(|one| {
            let frames = one["frames"].as_array().unwrap().iter();
            let frames: Vec<Value> = frames.map(|f| f["comparison"]["errors"].clone()).collect();
            serde_json::json!([one["name"], one["errors"], frames])
        })
        .collect()
    };
    assert_eq!(errors("merged/metrics.json"), errors("whole/metrics.json"));
    for frame in 1..=5 {
        let name = |place: &str| format!("{place}/frame-{frame}");
        assert!(
            pictures(&folder, &name("merged"), "png") == pictures(&folder, &name("whole"), "png")
        );
        assert!(
            pictures(&folder, &name("merged"), "exr") == pictures(&folder, &name("whole"), "exr")
        );
    }
    let shown = |name: &str| {
        let page = std::fs::read_to_string(folder.at(name)).unwrap();
        page.matches("data:image/png").count()
    };
    assert_eq!(shown("merged/index.html"), shown("whole/index.html"));
    folder.run(&format!("{line} -o parts --part 6/6")).failed(&["at most as many parts", "5"]);
    // Pictures that were cut, or are gone, are named, and nothing is written.
    let cut = folder.at("parts/part-1-of-2/frame-3/flat.png");
    let whole = std::fs::read(&cut).unwrap();
    std::fs::write(&cut, &whole[..whole.len() / 2]).unwrap();
    folder.run("merge parts -o again").failed(&["frame-3", "flat.png", "part 1 of 2"]);
    std::fs::write(&cut, whole).unwrap();
    std::fs::rename(folder.at("parts/part-2-of-2/frame-2"), folder.at("gone")).unwrap();
    folder.run("merge parts -o again").failed(&["frame-2", "part 2 of 2"]);
    assert!(!folder.at("again").exists(), "nothing is written");
    std::fs::rename(folder.at("gone"), folder.at("parts/part-2-of-2/frame-2")).unwrap();
    // A part that is begun anew and fails is not done.
    folder
        .run(&format!("{line} -o parts --part 2/2 --backend vulkan --adapter nowhere"))
        .failed(&["nowhere"]);
    folder.run("merge parts -o again").failed(&["part 2 of 2 is not done"]);
    folder.run("compare two.ply -r flat -o x --part 1/2").misused(&["--path"]);
}

/// Invariant: an index in parts makes the bytes of the whole
#[test]
fn an_index_in_parts_has_the_bytes_of_the_whole() {
    let folder = TestFolder::new();
    for (name, n) in [("a.ply", 150_000), ("b.ply", 120_000), ("c.ply", 40_000)] {
        put_points(&folder, name, n);
    }
    let files = "index a.ply b.ply c.ply --memory 64MB";
    folder.run(&format!("{files} -o whole.surfels")).done();
    let line = format!("{files} -o parts.surfels");
    let step = |step: &str, part: &str| folder.run(&format!("{line} --step {step} {part}"));
    step("points", "--part 1/2").failed(&["parts.surfels.index", "`extent` first"]);
    step("extent", "").done();
    step("points", "--part 1/2").done();
    step("plan", "").failed(&["b.ply", "`points` first"]);
    step("points", "--part 2/2").done();
    step("surfels", "--part 1/3").failed(&["`plan`"]);
    step("plan", "").done();
    for number in [2, 1, 3] {
        let told = step("surfels", &format!("--part {number}/3 --json")).json();
        assert!(told["done"]["n_all"].as_u64().unwrap() > 3, "{told}");
    }
    folder.run(&line).done();
    let bytes = |name: &str| std::fs::read(folder.at(name)).unwrap();
    assert!(bytes("whole.surfels") == bytes("parts.surfels"));
    assert!(!folder.files().iter().any(|name| name.contains(".index")));
}

fn put_points(folder: &TestFolder, name: &str, n: usize) {
    let whole = clouds::wavy_sphere(n);
    let is_bare = |c: &&Column| ["position", "color"].contains(&c.name());
    let columns: Vec<Column> = whole.columns().iter().filter(is_bare).cloned().collect();
    let cloud = Cloud::new(whole.origin(), columns).unwrap();
    surfelshop_cloud::write(folder.at(name), &cloud, &WriteOptions::default()).unwrap();
}
