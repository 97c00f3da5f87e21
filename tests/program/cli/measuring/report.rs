//! `surfelshop report`: what is swept, what is kept, and what it says.

use crate::cli::bake::faulty;
use crate::cli::program::{TestFolder, facing_front};
use serde_json::{Value, json};

fn desk() -> TestFolder {
    let desk = TestFolder::new();
    desk.put_cloud("two.ply", &[facing_front(-0.5, 0.0, 1.0), facing_front(0.7, 0.2, 0.6)]);
    desk
}

const SMALL: &str = "--size 40 --camera front --repeats 3";

fn cells(told: &Value) -> Vec<Value> {
    told["knobs"]
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|knob| knob["cells"].as_array().unwrap().clone())
        .collect()
}

#[test]
fn a_stranger_s_knob_is_swept_over_its_range() {
    let (desk, plugin) = (desk(), faulty());
    let line =
        format!("report two.ply -r fine --reference flat -o out {SMALL} --trust --plugin {plugin}");
    let told = desk.run(&format!("{line} --json")).json();
    assert_eq!(told["knobs"][0]["id"], "steps", "the one that trades time for quality");
    let cells = cells(&told);
    let values: Vec<&str> = cells.iter().map(|cell| cell["value"].as_str().unwrap()).collect();
    assert_eq!((values[0], values.last()), ("1", Some(&"64")));
    assert!(cells.iter().all(|cell| cell["runs"].as_array().unwrap().len() == 3));
    for file in ["index.html", "report.csv", "report.json", "steps.svg", "cells.json"] {
        assert!(desk.at("out").join(file).is_file(), "{file}");
    }
    let csv = std::fs::read_to_string(desk.at("out/report.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + cells.len());
    let page = std::fs::read_to_string(desk.at("out/index.html")).unwrap();
    assert!(
        !page.replace("http://www.w3.org/2000/svg", "").contains("http"),
        "no address but a name"
    );
}

/// Errors fall as the knob says; what was measured stays, to the last bit of its times, until something
/// that it depends on is another.
///
/// Invariant: a report keeps what was measured, until something that it depends on is another
#[test]
fn what_was_measured_is_kept_until_something_is_another() {
    let (desk, plugin) = (desk(), faulty());
    let run = |knob: &str, more: &str| {
        let line = format!(
            "report two.ply -r fine --reference fine -o out {SMALL} --trust --plugin {plugin} {more}"
        );
        cells(&desk.run(&format!("{line} --knob gain={knob} --json")).json())
    };
    let first = run("0.25,0.5", "");
    let rmse = |cell: &Value| cell["errors"][0][1].as_f64().unwrap();
    assert_eq!(first[0]["errors"][0][0], "rmse");
    assert!(rmse(&first[0]) > rmse(&first[1]), "nearer to the default, which is the reference");
    let more = run("0.25,0.5,1", "");
    assert_eq!(more[..2], first[..]);
    assert!(rmse(&more[2]).abs() < 1e-7);
    // Another light, other numbers.
    let other = run("0.25,0.5,1", "--background white --exposure 1");
    assert_ne!(other[0]["runs"], more[0]["runs"]);
    assert_eq!(run("1", "--background white --exposure 1")[0], other[2]);
}

#[test]
fn what_cannot_be_reported_is_one_line() {
    let (desk, plugin) = (desk(), faulty());
    let line = format!("report two.ply -o out {SMALL} --trust --plugin {plugin} --reference flat");
    let flat = format!("{line} -r flat");
    desk.run(&format!("report two.ply -r flat -o out {SMALL} --knob ambient=0.5"))
        .failed(&["say what errors are measured against", "--reference"]);
    desk.run(&format!("{flat} --knob nobody:ambient=1,2")).failed(&["meant for `nobody`"]);
    desk.run(&format!("{flat} --knob ambient=0.5 --set ewa-phong:ambient=1"))
        .failed(&["meant for `ewa-phong`"]);
    desk.run(&flat).failed(&["declares no parameter that trades time for quality", "ambient"]);
    desk.run(&format!("{flat} --knob shine=1,2")).failed(&["no parameter `shine`"]);
    desk.run(&format!("{flat} --knob ambient=1,two")).failed(&["found `two`"]);
    desk.run(&format!("{flat} --knob ambient=0.5").replace("reference flat", "reference none"))
        .failed(&["none"]);
    let nan = line.replace("--reference flat", "--reference not-finite");
    let nan = format!("{nan} -r fine --knob gain=1");
    assert_eq!(desk.run(&nan).code, 1);
    desk.put("out/cells.json", "nonsense");
    desk.run(&format!("{flat} --knob ambient=0.5")).failed(&["cells.json: it is no list of cells"]);
}

/// A bowl of 600 surfels: half of what they would see of the sky are others.
fn bowl(desk: &TestFolder) {
    bowl_of(desk, 0.07);
}

fn bowl_of(desk: &TestFolder, radius: f32) {
    let golden = std::f32::consts::PI * (3.0 - 5f32.sqrt());
    let surfel = |i: usize| {
        let y = -(i as f32 + 0.5) / 600.0;
        let (ring, turn) = ((1.0 - y * y).sqrt(), golden * i as f32);
        let [x, z] = [ring * turn.cos(), ring * turn.sin()];
        [x, y, z, -x, -y, -z, radius]
    };
    desk.put_cloud("bowl.ply", &(0..600).map(surfel).collect::<Vec<_>>());
}

/// Merged surfels are a knob of every renderer: coarser ones are more wrong, and what surfels cost is no
/// part of the renderer's own passes.
#[test]
fn detail_is_a_knob_of_the_host() {
    let desk = desk();
    // They overlap as those of scans do.
    bowl_of(&desk, 0.15);
    let line = "report bowl.ply -r ewa-phong --reference ewa-phong --size 32 --repeats 1 -o out \
                --camera top --surfels cpu";
    let told = cells(&desk.run(&format!("{line} --knob detail=0,8,32 --json")).json());
    let rmse: Vec<f64> = told.iter().map(|cell| cell["errors"][0][1].as_f64().unwrap()).collect();
    assert!(rmse[0] == 0.0 && 0.0 < rmse[1] && rmse[1] <= rmse[2], "{rmse:?}");
    let csv = std::fs::read_to_string(desk.at("out/report.csv")).unwrap();
    let mut rows = csv.lines().map(|row| row.split(',').collect::<Vec<_>>());
    let head = rows.next().unwrap();
    let column = head.iter().position(|name| *name == "\"coverage_difference\"").unwrap();
    let covers: Vec<f64> = rows.map(|row| row[column].parse().unwrap()).collect();
    assert!(covers[0] == 0.0 && covers[2] > 0.0, "outlines of 32 pixels differ: {covers:?}");
    assert!(told.iter().all(|cell| cell["runs"][0]["own_passes_ms"].is_null()));
    assert!(desk.at("out/detail.svg").is_file());
    desk.run(&format!("{line} --knob detail=1,65")).failed(&["detail", "64"]);
    desk.run(&format!("{line} --knob detail=1,2 --detail 1")).failed(&["--detail", "leave it out"]);
    desk.run("report bowl.ply -r reference --reference flat --knob detail=1 --size 8 -o out2")
        .failed(&["no parameter `detail`"]);
}

const RAYS: &str = "report bowl.ply -t ambient-occlusion --set method=rays --knob rays=4,64,256 \
                    --reference-again seed=1 --reference-set method=rays --reference-set seed=2 \
                    --reference-set rays=4096";

#[test]
fn a_tool_s_errors_fall_as_its_knob_says() {
    let desk = desk();
    bowl(&desk);
    let told = desk.run(&format!("{RAYS} --repeats 3 -o out --json")).json();
    assert_eq!(
        (&told["unit"]["kind"], &told["unit"]["id"]),
        (&json!("tool"), &json!("ambient-occlusion"))
    );
    let cells = cells(&told);
    let rmse = |cell: &Value| cell["errors"][0][1].as_f64().unwrap();
    assert_eq!(cells[0]["errors"][0][0], "rmse");
    assert!(rmse(&cells[0]) > 2.0 * rmse(&cells[1]), "a fourth by theory: {cells:?}");
    assert!(rmse(&cells[1]) > 1.3 * rmse(&cells[2]), "a half by theory: {cells:?}");
    let noise = cells[0]["noise"].as_f64().unwrap();
    // The mean of two of 4096 rays has 8192, 32 times as many as the last value: a root of 32 less
    // error, or somewhat less still, since strata do better than the root.
    let ratio = rmse(&cells[2]) / noise;
    assert!((4.0..12.0).contains(&ratio), "{ratio}");
    for cell in &cells {
        assert_eq!(cell["runs"].as_array().unwrap().len(), 3);
        assert!(cell["runs"][0]["wall_ms"].as_f64().unwrap() > 0.0, "{cell}");
    }
    let csv = std::fs::read_to_string(desk.at("out/report.csv")).unwrap();
    assert!(csv.contains("report --knob rays=64 -o alone bowl.ply"), "{csv}");
    // Known rows stay with the reference they were measured against, wherever it is gone or another.
    for (name, contents) in [("reference.f64", "12345678"), ("reference.f64", "")] {
        desk.put(&format!("out/{name}"), contents);
        let told = desk
            .run(&format!(
                "{} --repeats 0 -o out --json",
                RAYS.replace("4,64,256", "4,64,256,1024")
            ))
            .json();
        let more = self::cells(&told);
        assert_eq!(more[..3], cells[..], "nothing of them is another");
        assert!(rmse(&more[3]) < rmse(&cells[2]), "{contents:?}: {more:?}");
        let text = std::fs::read_to_string(desk.at("out/cells.json")).unwrap();
        let mut stored: Value = serde_json::from_str(&text).unwrap();
        stored["cells"].as_array_mut().unwrap().truncate(3);
        desk.put("out/cells.json", &stored.to_string());
    }
    // Each row's command gives that row.
    let alone = RAYS.replace("rays=4,64,256", "rays=64");
    let told = desk.run(&format!("{alone} --repeats 0 -o alone --json")).json();
    assert_eq!(self::cells(&told)[0]["errors"], cells[1]["errors"]);
}

/// Killed, not asked: what was measured before is on the disk, and the report goes on from there.
#[test]
fn a_report_that_is_killed_goes_on_where_it_was() {
    let desk = desk();
    bowl(&desk);
    let whole = cells(&desk.run(&format!("{RAYS} --repeats 2 -o whole --json")).json());
    let line = format!("{RAYS} --repeats 1000 -o out --json");
    let mut command = desk.command();
    command.args(line.split_whitespace()).stdout(std::process::Stdio::null());
    let mut child = command.stderr(std::process::Stdio::null()).spawn().unwrap();
    let noted = || -> Option<Vec<Value>> {
        let text = std::fs::read_to_string(desk.at("out/cells.json")).ok()?;
        let stored: Value = serde_json::from_str(&text).unwrap();
        let mut cells = stored["cells"].as_array().cloned()?;
        // What came since, a line each; the last one may be half there.
        let log = std::fs::read_to_string(desk.at("out/cells.log")).ok()?;
        for what in log.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok()) {
            let what = &what["what"];
            if let Some(cell) = what.get("cell") {
                cells.push(cell.clone());
            } else if let Some(run) = what.get("run") {
                let cell = cells.iter_mut().find(|cell| cell["value"] == run["value"]).unwrap();
                cell["runs"].as_array_mut().unwrap().push(run["run"].clone());
            }
        }
        Some(cells)
    };
    let n_runs = |cells: &[Value]| -> usize {
        cells.iter().map(|cell| cell["runs"].as_array().unwrap().len()).sum()
    };
    while noted().is_none_or(|cells| n_runs(&cells) < 4) {
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    child.kill().unwrap();
    assert!(!child.wait().unwrap().success());
    let noted = noted().unwrap();
    let most = noted.iter().map(|cell| cell["runs"].as_array().unwrap().len()).max().unwrap();
    let line = format!("{RAYS} --repeats {} -o out --json", most + 3);
    let resumed = cells(&desk.run(&line).json());
    assert_eq!(resumed.len(), whole.len());
    for ((resumed, noted), whole) in resumed.iter().zip(&noted).zip(&whole) {
        assert_eq!(resumed["value"], whole["value"]);
        assert_eq!(resumed["errors"], whole["errors"], "the same table");
        let (all, before) =
            (resumed["runs"].as_array().unwrap(), noted["runs"].as_array().unwrap());
        assert_eq!(all.len(), most + 3);
        assert_eq!(all[..before.len()], before[..], "what was measured is kept");
    }
}

#[test]
fn what_takes_too_long_is_left_out_and_said() {
    let (desk, plugin) = (desk(), faulty());
    let line = format!(
        "report two.ply -t works-slowly --set milliseconds=300 --knob items=1,2,4,8 --repeats 0 \
         --reference-set items=1 --longest 0.2 --trust --plugin {plugin} -o out"
    );
    // However often: what is known of a value is enough to leave out those behind it.
    for _ in 0..2 {
        let ended = desk.run(&line).done();
        assert!(ended.stdout.starts_with("items=1: "), "{}", ended.stdout);
        assert!(!ended.stdout.contains("items=2: "), "{}", ended.stdout);
        assert!(ended.stderr.contains("3 values behind 1 are left out"), "{}", ended.stderr);
        assert!(ended.stderr.contains("--longest allows more"), "{}", ended.stderr);
    }
}

#[test]
fn tools_that_cannot_be_measured_are_one_line() {
    let (desk, plugin) = (desk(), faulty());
    bowl(&desk);
    let line = format!(
        "report two.ply --repeats 0 --trust --plugin {plugin} -o out --reference-set seed=9"
    );
    let scatters = format!("{line} -t scatters --knob seed=1,2");
    let done = desk.run(&format!("{scatters} --json")).json();
    assert_eq!(done["of"], "2 surfels, column noise");
    desk.run(&format!("{scatters} --column none")).failed(&["no column `none`", "noise"]);
    desk.run(&format!("{scatters} --size 64")).failed(&["--size is meant for renderers"]);
    desk.run(&format!("{scatters} --env studio")).failed(&["--env is meant for renderers"]);
    desk.run(&format!("{scatters} bowl.ply")).failed(&["a tool works on one cloud"]);
    desk.run(&format!("{scatters} --reference bowl.ply --column radius"))
        .failed(&["bowl.ply has 600 surfels of 2"]);
    desk.run(&format!("{line} -t keeps-half --knob seed=1")).failed(&["no parameter `seed`"]);
    desk.run(&format!("{line} -t scatters -r flat")).misused(&["cannot be used with"]);
    desk.run(&line).misused(&["--renderer", "--tool"]);
    desk.run(&format!("{line} -r fine --knob gain=1 --longest 5"))
        .failed(&["--longest is meant for a tool"]);
    desk.run(&format!("{line} -r fine --knob gain=1 --column ao"))
        .failed(&["--column is meant for a tool"]);
}

/// What is drawn depends on files that no one typed: another cloud of the scene, another pattern.
#[test]
fn files_behind_a_scene_or_a_parameter_are_looked_at_again() {
    let desk = desk();
    bowl(&desk);
    desk.put("one.scene.toml", "format = 1\n[[clouds]]\npath = \"bowl.ply\"\n");
    let line = RAYS.replace("bowl.ply", "one.scene.toml");
    let run = || cells(&desk.run(&format!("{line} --repeats 0 -o out --json")).json());
    let first = run();
    assert_eq!(run(), first);
    // As many surfels on a board, which see all of the sky.
    let place = |i: usize| [(i % 30) as f32 / 15.0 - 1.0, (i / 30) as f32 / 20.0 - 1.0];
    let surfel = |i: usize| [place(i)[0], 0.0, place(i)[1], 0.0, 1.0, 0.0, 0.07];
    desk.put_cloud("bowl.ply", &(0..600).map(surfel).collect::<Vec<_>>());
    assert_ne!(run()[0]["errors"], first[0]["errors"]);
    let pattern = |color: &str| {
        let wgsl = "#import surfelshop::noise::Place
            #import procedural::pattern::Look
            fn look(at: Place, albedo: vec3<f32>) -> Look {
                return Look(vec3(COLOR), 0.9, 0.5, 1.0);
            }";
        desk.put("mine.wgsl", &wgsl.replace("COLOR", color));
    };
    pattern("0.25");
    let line = "report two.ply -r procedural --set file=mine.wgsl --reference flat --knob ambient=0.1 \
         --size 24 --camera front --repeats 0 -o patterns --json";
    let errors = || cells(&desk.run(line).json())[0]["errors"].clone();
    let before = errors();
    pattern("0.125, 0.5, 0.5");
    assert_ne!(errors(), before);
}

#[test]
fn a_tracer_is_not_measured_against_its_own_random_numbers() {
    let desk = desk();
    let line =
        "report two.ply -r reference --knob samples=2,4 --size 16 --camera front --repeats 0";
    let same = format!("{line} --reference-set samples=8 -o out");
    desk.run(&same).failed(&["the same random numbers", "--reference-set seed=1"]);
    desk.run(&format!("{same} --reference-set seed=1")).done();
    let line = "compare two.ply -r a=reference -r b=reference --size 16 --set a:samples=2 \
                --set b:samples=4 --reference b -o out";
    desk.run(line).failed(&["the same random numbers", "--set a:seed=1"]);
    desk.run(&format!("{line} --set a:seed=1")).done();
    bowl(&desk);
    desk.run(&RAYS.replace("again seed=1", "again seed=2").replace("--knob", "-o out --knob"))
        .failed(&["--reference-again seed=2", "made twice alike"]);
}
