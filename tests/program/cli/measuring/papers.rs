//! `surfelshop papers`: its pages, what is found again, that the commands beside numbers measure them, parts, and the
//! gallery (15 s). Costs 40 s of CPU time; with `SURFELSHOP_LONG` ten of all figures, tables and errata are drawn, which takes minutes.

use crate::cli::program::TestFolder;
use serde_json::Value;
use std::fs;

const SMALL: &str = "--size 40 --samples 4 --repeats 1";

/// What a number's place in a file says: pointers that are added up, over others behind ` / `.
fn evaluated(file: &Value, places: &str) -> f64 {
    let one = |pointer: &str| {
        let found = file.pointer(pointer).unwrap_or_else(|| panic!("{pointer} is missing"));
        found.as_f64().unwrap_or_else(|| {
            let runs = found.as_array().unwrap().iter();
            let mut runs: Vec<f64> = runs.map(|run| run["wall_ms"].as_f64().unwrap()).collect();
            runs.sort_by(f64::total_cmp);
            runs[runs.len() / 2]
        })
    };
    let sum = |places: &str| places.split(" + ").map(one).sum::<f64>();
    places.split_once(" / ").map_or_else(|| sum(places), |(value, over)| sum(value) / sum(over))
}

/// The words of a command as a shell takes them, without the program.
fn words(command: &str) -> Vec<String> {
    let (mut words, mut word, mut is_quoted) = (Vec::new(), String::new(), false);
    for c in command.chars() {
        match c {
            '\'' => is_quoted = !is_quoted,
            ' ' if !is_quoted => words.push(std::mem::take(&mut word)),
            c => word.push(c),
        }
    }
    words.push(word);
    assert_eq!(words.remove(0), "surfelshop", "{command}");
    words
}

fn entries(made: &Value) -> Vec<&Value> {
    let papers = made.as_array().unwrap().iter();
    papers.flat_map(|paper| paper["entries"].as_array().unwrap()).collect()
}

fn json(folder: &TestFolder, name: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.at(name)).unwrap()).unwrap()
}

/// Invariant: pages of the papers ask nothing of a network, are below 15 MB, and come out the same of what an
/// interrupted run left
#[test]
fn pages_hold_all_and_come_out_the_same_of_what_is_there() {
    let folder = TestFolder::new();
    let only = ["Figure 3", "Figure 10", "Table 1", "Figure 15", "Figure 43"];
    let mut line = vec!["papers", "thesis", "-o", "page"];
    line.extend(SMALL.split(' '));
    line.extend(only.iter().flat_map(|id| ["--only", id]));
    folder.run_with(&line).done();
    let pages = ["index.html", "thesis.html", "checked.html"];
    let read = || pages.map(|name| fs::read_to_string(folder.at(&format!("page/{name}"))).unwrap());
    let first = read();
    for (name, page) in pages.iter().zip(&first) {
        assert!(page.len() < 15_000_000, "{name}: {} bytes", page.len());
        for remote in ["http://", "https://", "src=\"/", "@import", "url("] {
            // What names the form of a drawing is no address that is asked for.
            let page = page.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
            assert!(!page.contains(remote), "{name}: {remote}");
        }
    }
    let [contents, thesis, checked] = &first;
    for id in only {
        assert!(thesis.contains(&format!("<h2>{id}")), "{id}");
    }
    assert!(thesis.contains("data:image/png;base64,") && thesis.contains("<svg"));
    assert!(thesis.contains("which stands in for Igea"), "without the paper's data");
    assert!(contents.contains("not made") && contents.contains("stood in"));
    assert!(checked.contains("id=\"ambient-occlusion\""));
    // All is there: nothing is made, and the pages are what they were.
    let again = folder.run_with(&line).done();
    assert_eq!(again.stdout.matches(": was there").count(), only.len() - 1, "{}", again.stdout);
    let same = read();
    assert!(same == first, "pages of the same folders differ");
    // Killed while it made one: that one is made again, the others are there.
    let at = |name: &str| folder.at(&format!("page/work/thesis-{name}"));
    let hash = json(&folder, "page/work/thesis-figure-15/outcome.json")["hash"].clone();
    fs::rename(at("figure-15"), at("figure-15.part")).unwrap();
    fs::remove_file(at("figure-15.part").join("outcome.json")).unwrap();
    fs::write(at("figure-15.part").join("hash"), hash.as_str().unwrap()).unwrap();
    let before = json(&folder, "page/papers.json");
    let again = folder.run_with(&line).done();
    assert_eq!(again.stdout.matches(": was there").count(), only.len() - 2, "{}", again.stdout);
    let after = json(&folder, "page/papers.json");
    let repeatable = |made: &Value| -> Vec<Value> {
        let numbers = entries(made)
            .into_iter()
            .flat_map(|entry| entry["numbers"].as_array().unwrap().clone());
        numbers.filter(|number| number["is_repeatable"] == true).collect()
    };
    assert!(repeatable(&before).len() >= 7, "{before}");
    assert_eq!(repeatable(&before), repeatable(&after));
}

/// Entries that are drawn: all, or those that take seconds.
fn candidates(folder: &TestFolder) -> Vec<String> {
    let is_long = std::env::var("SURFELSHOP_LONG").is_ok_and(|value| value == "1");
    let slow = [
        "{torso",
        "{fandisk",
        "{chameleon",
        "{mannequin",
        "{cornell",
        "{cathedral",
        "{knot",
        "{ring",
        "{dragon",
        "report",
    ];
    let listed = folder.run("papers --list --json").json();
    let is_quick = |entry: &&Value| {
        let text = format!("{}{}", entry["steps"], entry["computed"]);
        let computed = entry["computed"].as_str().unwrap();
        let is_slow = slow.iter().any(|word| text.contains(word))
            || ["occlusion", "bounces", "marble", "harmonics-T17", "splat-B10"]
                .iter()
                .any(|word| computed.starts_with(word));
        entry["impossible"] == "" && (is_long || !is_slow)
    };
    let name = |entry: &Value| {
        format!("{}/{}", entry["paper"].as_str().unwrap(), entry["id"].as_str().unwrap())
    };
    listed.as_array().unwrap().iter().filter(is_quick).map(name).collect()
}

/// Ten of them, the same on every run.
fn drawn(mut all: Vec<String>) -> Vec<String> {
    let mut state = 20_040_917u64;
    let mut chosen = Vec::new();
    while chosen.len() < 10 {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        chosen.push(all.swap_remove((state >> 33) as usize % all.len()));
    }
    chosen
}

/// Invariant: the commands beside a figure measure its very numbers, as they are typed in another folder
#[test]
fn ten_entries_have_the_numbers_that_their_commands_measure() {
    let (folder, elsewhere) = (TestFolder::new(), TestFolder::new());
    let chosen = drawn(candidates(&folder));
    let (mut n_numbers, mut n_commands) = (0, 0);
    for name in &chosen {
        let (paper, id) = name.split_once('/').unwrap();
        let mut line = vec!["papers", paper, "--only", id, "-o", "page"];
        line.extend(SMALL.split(' '));
        folder.run_with(&line).done();
        let made = json(&folder, "page/papers.json");
        let all = entries(&made);
        let [entry] = all[..] else { panic!("{name}: {made}") };
        let numbers = entry["numbers"].as_array().unwrap();
        for (i, command) in entry["commands"].as_array().unwrap().iter().enumerate() {
            let words = words(command.as_str().unwrap());
            n_commands += 1;
            elsewhere.run_with(&words.iter().map(String::as_str).collect::<Vec<_>>()).done();
            let file = match words[0].as_str() {
                "compare" => "metrics.json",
                "report" => "report.json",
                "papers" => "papers.json",
                _ => continue,
            };
            let out = words.iter().rposition(|word| word == "-o").unwrap();
            let file = format!("{}/{file}", words[out + 1]);
            let found = json(&elsewhere, &file);
            let of_times =
                numbers.iter().filter(|n| n["is_repeatable"] == false && n["command"] == i);
            for number in of_times {
                let again = evaluated(&found, number["pointer"].as_str().unwrap());
                assert!(again > 0.0 && again.is_finite(), "{name}: {}", number["what"]);
            }
            for number in numbers.iter().filter(|number| number["is_repeatable"] == true) {
                let again = match words[0].as_str() {
                    "papers" if number["command"].is_null() => {
                        let same = entries(&found)[0]["numbers"].as_array().unwrap();
                        same.iter().find(|other| other["what"] == number["what"]).unwrap()["value"]
                            .clone()
                    }
                    "compare" | "report" if number["command"] == i => {
                        found.pointer(number["pointer"].as_str().unwrap()).unwrap().clone()
                    }
                    _ => continue,
                };
                assert_eq!(again, number["value"], "{name}: {}", number["what"]);
                n_numbers += 1;
            }
            fs::remove_dir_all(elsewhere.at(&words[out + 1])).unwrap();
        }
    }
    assert!(
        n_commands >= 10 && n_numbers >= 20,
        "{n_commands} commands, {n_numbers} numbers of {chosen:?}"
    );
}

/// Invariant: parts of the papers, made apart and their folders laid together, are what one run makes
#[test]
fn parts_are_joined_by_the_command_without_a_part() {
    let folder = TestFolder::new();
    let only = ["Figure 3", "Figure 10", "Table 1", "Figure 4", "Figure 42", "Figure 43"];
    let run = |out: &str, more: &[&str]| {
        let mut line = vec!["papers", "thesis", "-o", out];
        line.extend(SMALL.split(' '));
        line.extend(only.iter().flat_map(|id| ["--only", id]));
        line.extend(more);
        folder.run_with(&line).done()
    };
    run("whole", &[]);
    run("one", &["--part", "1/2"]);
    run("two", &["--part", "2/2"]);
    assert!(!folder.at("one/index.html").exists(), "a part writes no pages");
    fs::create_dir_all(folder.at("page/work")).unwrap();
    let mut n_made = 0;
    for part in ["one/work", "two/work"] {
        for entry in fs::read_dir(folder.at(part)).unwrap() {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            assert!(!name.contains("part"), "nothing is left half made: {name}");
            n_made += usize::from(name.starts_with("thesis-"));
            let to = folder.at("page/work").join(&name);
            if !to.exists() {
                fs::rename(entry.path(), to).unwrap();
            }
        }
    }
    assert_eq!(n_made, only.len() - 1, "each is in one part");
    let joined = run("page", &[]);
    assert_eq!(joined.stdout.matches(": was there").count(), only.len() - 1, "{}", joined.stdout);
    let [whole, joined] = ["whole", "page"].map(|out| json(&folder, &format!("{out}/papers.json")));
    for (whole, joined) in entries(&whole).into_iter().zip(entries(&joined)) {
        for same in ["id", "numbers", "commands", "state"] {
            let commands = joined[same].to_string();
            assert_eq!(whole[same].to_string(), commands.replace("/page/work", "/whole/work"));
        }
    }
    folder.run("papers -o page --part 3/2").misused(&["3/8"]);
}

/// Invariant: the passes of a frame of global illumination are in one row each, and the commands beside the table
/// measure every number of it again
#[test]
fn times_by_pass_are_those_that_the_commands_measure() {
    let folder = TestFolder::new();
    let mut line = vec!["papers", "point-gi", "--only", "Section 5", "-o", "page"];
    line.extend(SMALL.split(' '));
    folder.run_with(&line).done();
    let made = json(&folder, "page/papers.json");
    let entry = entries(&made)[0];
    let numbers = entry["numbers"].as_array().unwrap();
    let file = |i: u64| json(&folder, &format!("page/work/point-gi-section-5/{i}/bench.json"));
    for number in numbers {
        let places = number["pointer"].as_str().unwrap();
        let value = evaluated(&file(number["command"].as_u64().unwrap()), places);
        let told = number["value"].as_f64().unwrap();
        assert!((value / told - 1.0).abs() < 1e-9, "{}: {value} {told}", number["what"]);
    }
    let at = |what: &str| numbers.iter().find(|number| number["what"] == what);
    assert!(at("shadow maps of lights at bounces 0").is_none(), "there is no light to reflect");
    let shading = at("shading by lights at bounces 3").unwrap()["pointer"].as_str().unwrap();
    assert!(!shading.contains(" + "), "one pass for all bounces: {shading}");
    let maps = at("shadow maps of lights at bounces 3").unwrap()["pointer"].as_str().unwrap();
    assert_eq!(maps.matches(" + ").count(), 2, "a pass of each bounce: {maps}");
    // A pass that no row names would be hidden in the last one.
    let rest = at("everything else at bounces 3").unwrap()["pointer"].as_str().unwrap();
    let first = file(0);
    for pointer in rest.split(" + ") {
        let pointer = pointer.replace("cpu_ms", "stage").replace("wall_ms", "stage");
        let stage = first.pointer(&pointer).unwrap().as_str().unwrap();
        assert!(!stage.starts_with("pass "), "{stage} is in no row");
    }
    // The commands can be typed elsewhere, and have what the numbers name.
    let elsewhere = TestFolder::new();
    let command = entry["commands"][2].as_str().unwrap();
    let words = words(command);
    elsewhere.run_with(&words.iter().map(String::as_str).collect::<Vec<_>>()).done();
    let again = json(&elsewhere, "point-gi-section-5-2/bench.json");
    let of_command: Vec<&Value> = numbers.iter().filter(|n| n["command"] == 2).collect();
    assert!(of_command.len() > 40, "{} numbers", of_command.len());
    for number in of_command {
        assert!(evaluated(&again, number["pointer"].as_str().unwrap()) > 0.0, "{number}");
    }
}

/// The size and values of a picture.
fn levels(path: &std::path::Path) -> ((u32, u32), Vec<u8>) {
    let picture = crate::cli::program::read_png(path);
    (picture.dimensions(), picture.into_raw())
}

/// Invariant: the gallery of the README and the manual is what the program draws
#[test]
fn the_gallery_is_what_the_program_draws() {
    let folder = TestFolder::new();
    folder.run("papers --gallery gallery -o page --size 144 --samples 32 --repeats 1").done();
    let stored = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/gallery");
    let names = |path: &std::path::Path| {
        let names = fs::read_dir(path).unwrap().map(|entry| entry.unwrap().file_name());
        let mut names: Vec<String> = names.map(|name| name.into_string().unwrap()).collect();
        names.sort();
        names
    };
    let all = names(&stored);
    assert_eq!(all, names(&folder.at("gallery")), "the same pictures");
    assert!(all.len() >= 5);
    let bytes = all.iter().map(|name| stored.join(name).metadata().unwrap().len()).sum::<u64>();
    assert!(bytes < 500_000, "{bytes} bytes");
    // Other devices and compilers round otherwise: edges of surfels move by a part of a pixel, which is below 1 %. A
    // picture with another bias, light or order of colours is 5 % off or more, as a shift by two pixels is.
    const APART: f64 = 0.015;
    for name in &all {
        let (size, old) = levels(&stored.join(name));
        let (new_size, new) = levels(&folder.at(&format!("gallery/{name}")));
        assert_eq!(size, new_size, "{name}");
        let apart = |a: &[u8]| surfelshop_image::metrics::compare_levels(a, &new).unwrap().rmse;
        assert!(
            apart(&old) < APART,
            "assets/gallery/{name} is {:.4} off; if that is wanted, make it again: surfelshop papers --gallery \
             assets/gallery -o OUT --size 144 --samples 32 --repeats 1",
            apart(&old)
        );
        let shifted: Vec<u8> = old.iter().copied().cycle().skip(8).take(old.len()).collect();
        assert!(apart(&shifted) > APART, "{name}: the bound tells nothing");
    }
}

#[test]
fn what_is_not_there_is_said_in_a_line() {
    let folder = TestFolder::new();
    let line = |options: &[&str]| {
        let mut line = vec!["papers", "-o", "page"];
        line.extend(options);
        folder.run_with(&line)
    };
    line(&["--only", "Figure 99"]).failed(&["no figure, table or erratum `Figure 99`", "--list"]);
    line(&["--data", "nowhere", "--only", "T28"])
        .failed(&["nowhere", "expected a folder of models"]);
    folder.run("papers").misused(&["--out"]);
    folder.put("file", "no folder");
    folder
        .run("papers --only T28 -o file/page")
        .failed(&["file/page", "the folder cannot be made"]);
}
