//! `surfelshop bench`: what it measures is complete, finite and consistent; how long anything takes is
//! no matter of a test.

use crate::cli::program::{TestFolder, facing_front};
use serde_json::Value;

fn desk() -> TestFolder {
    let desk = TestFolder::new();
    desk.put_cloud("two.ply", &[facing_front(-0.5, 0.0, 1.0), facing_front(0.7, 0.2, 0.6)]);
    desk
}

/// Cells of what was told, each with runs whose median and ratio are its own.
#[track_caller]
fn cells(told: &Value, n_runs: usize) -> Vec<Value> {
    let cells = told["cells"].as_array().unwrap().clone();
    let places = ["file", "series", "surfels", "size", "side", "distance", "what"];
    for cell in &cells {
        let number = |name: &str| cell[name].as_f64().unwrap_or(f64::NAN);
        for name in ["wall_ms", "wall_spread_ms", "cpu_ms", "first_ms", "wall_ratio", "cpu_ratio"] {
            assert!(number(name).is_finite() && number(name) >= 0.0, "{name}: {cell}");
        }
        let runs = cell["runs"].as_array().unwrap();
        assert_eq!(runs.len(), n_runs, "{cell}");
        let mut wall: Vec<f64> = runs.iter().map(|run| run["wall_ms"].as_f64().unwrap()).collect();
        wall.sort_by(f64::total_cmp);
        assert_eq!(number("wall_ms"), wall[n_runs / 2], "{cell}");
        let is_frame = cell["what"] != "surfels alone";
        assert_eq!(cell["frames_per_second"].is_number(), is_frame, "{cell}");
        let is_base = |other: &&Value| {
            let here = places.iter().all(|place| other[place] == cell[place]);
            here && other["variant"] == told["ratios_to"]
        };
        let base = cells.iter().find(is_base).unwrap();
        let ratio = number("wall_ms") / base["wall_ms"].as_f64().unwrap();
        // Both are read back from decimal digits.
        assert!((number("wall_ratio") / ratio - 1.0).abs() < 1e-9, "{cell}");
    }
    cells
}

/// Invariant: the stages of a frame are told once each, and what they take adds up to the sum that is told
#[test]
fn a_frame_is_the_sum_of_its_stages() {
    let desk = desk();
    let line = "bench two.ply --split -r flat --frames 2 --sizes 32 --json -o out";
    let told = desk.run(line).json();
    let splits = told["splits"].as_array().unwrap();
    assert_eq!(splits.len(), 2, "two ways to draw, one renderer");
    for split in splits {
        let stages = split["stages"].as_array().unwrap();
        let of = |key: &str| stages.iter().map(|stage| stage[key].clone()).collect::<Vec<_>>();
        let names = of("stage");
        let is_told = |name: &str| names.iter().any(|told| *told == name);
        for name in ["graph", "columns", "pass shade", "read-back: floats", "display transform"] {
            assert_eq!(names.iter().filter(|told| **told == name).count(), 1, "{name}: {names:?}");
        }
        assert!(is_told("PNG encoding") && is_told("what is left of the frame"), "{names:?}");
        for part in ["choosing and culling", "placing", "visibility", "blending", "packing"] {
            let by_processor = split["variant"] == "cpu";
            let name = format!("surfels: {part}");
            assert!(is_told(&name) || !by_processor, "{name}: {names:?}");
        }
        let sum: f64 = stages
            .iter()
            .filter(|stage| stage["is_part"] == false)
            .map(|stage| stage["cpu_ms"].as_f64().unwrap())
            .sum();
        let sum_told = split["sum_ms"].as_f64().unwrap();
        assert!((sum / sum_told - 1.0).abs() < 1e-9, "{sum} {sum_told}");
        assert!(split["whole_ms"].as_f64().unwrap() > 0.0);
        assert!(of("runs_cpu_ms").iter().all(|runs| runs.as_array().unwrap().len() == 2));
    }
    assert!(std::fs::read_to_string(desk.at("out/split.csv")).unwrap().contains("pass shade"));
    desk.run("bench two.ply --split --start").misused(&["--split"]);
}

fn named(cells: &[Value], key: &str, value: &str) -> usize {
    cells.iter().filter(|cell| cell[key] == value).count()
}

/// Invariant: what is measured of speed is complete, finite, and its ratios are those of its
/// medians
#[test]
fn frames_and_surfels_alone_are_measured_in_every_way() {
    let desk = desk();
    let line = "bench two.ply -r ewa-phong -r plain=flat --frames 2 --sizes 64,32x16 -o out";
    let told = desk.run(&format!("{line} --json")).json();
    let cells = cells(&told, 2);
    assert_eq!(cells.len(), 2 * 3 * 2, "sizes, two renderers and surfels alone, strategies");
    for (key, value) in [("variant", "quads"), ("variant", "cpu"), ("size", "64x64")] {
        assert_eq!(named(&cells, key, value), 6, "{value}");
    }
    for what in ["ewa-phong", "plain", "surfels alone"] {
        assert_eq!(named(&cells, "what", what), 4, "{what}");
    }
    assert_eq!(told["ratios_to"], "quads");
    for cell in cells.iter().filter(|cell| cell["what"] == "surfels alone") {
        let passes = cell["surfel_passes"].as_array().unwrap();
        let by_processor = passes.iter().any(|pass| *pass == "surfels: processor");
        assert_eq!(by_processor, cell["variant"] == "cpu", "{cell}");
    }
    assert!(told["adapter"]["name"].is_string() && told["threads"].as_u64().unwrap() > 0);
    let memory = told["memory"].as_array().unwrap();
    let bytes = |variant: usize, of: &str| memory[variant][of].as_u64().unwrap();
    assert!(bytes(0, "device_bytes") > 0 && bytes(0, "host_bytes") == 0, "{memory:?}");
    assert!(bytes(1, "host_bytes") > 0 && bytes(1, "device_bytes") == 0, "{memory:?}");
    let stored = std::fs::read_to_string(desk.at("out/bench.json")).unwrap();
    assert_eq!(serde_json::from_str::<Value>(&stored).unwrap(), told);
    let csv = std::fs::read_to_string(desk.at("out/bench.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + cells.len());
    assert_eq!(std::fs::read_to_string(desk.at("out/memory.csv")).unwrap().lines().count(), 3);
    let printed = desk.run(&line.replace("-o out", "")).done();
    let lines: Vec<&str> = printed.stdout.lines().collect();
    assert!(lines[0].contains("ratios are to quads"), "{printed:?}");
    assert!(lines.iter().filter(|line| line.contains("two.ply")).count() == 12 + 2, "{printed:?}");
}

#[test]
fn growth_is_measured_up_to_what_is_asked_for() {
    let desk = desk();
    let line = "bench --growth --most 30000 --largest 512 --frames 2 -o grown --json";
    let told = desk.run(line).json();
    let cells = cells(&told, 2);
    for (series, n_points) in [("surfels", 2), ("pixels", 2), ("closeness", 4)] {
        assert_eq!(named(&cells, "series", series), n_points * 2 * 2, "{series}");
        let svg = std::fs::read_to_string(desk.at("grown").join(format!("{series}.svg"))).unwrap();
        assert!(svg.contains("surfels alone, cpu"), "{series}");
    }
    let fits = told["fits"].as_array().unwrap();
    assert_eq!(fits.len(), 3 * 2 * 2);
    for fit in fits {
        assert!(fit["wall"].as_f64().unwrap().is_finite(), "{fit}");
    }
    let of = |surfels: u64| {
        let memory = told["memory"].as_array().unwrap().iter();
        let found = memory.filter(|one| one["surfels"] == surfels);
        found.map(|one| one["device_bytes"].as_u64().unwrap()).max().unwrap()
    };
    assert_eq!((of(10_000), of(30_000)), (320_000, 960_000), "three vectors, radius and colour");
    for file in ["growth.csv", "growth.json", "fits.csv", "memory.csv"] {
        assert!(desk.at("grown").join(file).is_file(), "{file}");
    }
}

#[test]
fn a_start_is_the_sum_of_its_phases() {
    let desk = desk();
    let line = "bench two.ply --start --sizes 32 --frames 1 --strategies cpu --detail 0.5 --camera front \
                --set ewa-phong:ambient=0.3 -o started --json";
    let told = desk.run(line).json();
    let [start] = told["starts"].as_array().unwrap().as_slice() else { panic!("{told}") };
    let phases = start["phases_ms"].as_object().unwrap();
    let sum: f64 = phases.values().map(|ms| ms.as_f64().unwrap()).sum();
    // Of one start, whose median it is.
    assert!((sum - start["wall_ms"].as_f64().unwrap()).abs() < 1e-6, "{start}");
    assert!(phases["device"].as_f64().unwrap() > 0.0, "{start}");
    assert!(desk.at("started/start.csv").is_file() && desk.at("started/start.json").is_file());
}

#[test]
fn what_cannot_be_measured_is_one_line() {
    let desk = desk();
    desk.run("bench two.ply -r reference").failed(&["found a tracer"]);
    desk.run("bench two.ply -r nobody").failed(&["nobody"]);
    desk.run("bench none.ply --sizes 32").failed(&["none.ply"]);
    desk.run("bench two.ply --strategies wishes").misused(&["wishes", "quads", "cpu"]);
    desk.run("bench --growth --most 9999").misused(&["9999"]);
    desk.run("bench two.ply --growth").misused(&["--growth"]);
}
