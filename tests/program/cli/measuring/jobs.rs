//! Jobs for render farms: what is written, and that its scripts do what one piece does. Costs 8 s; with
//! `SURFELSHOP_LONG` a minute more, for templates that the standard's own program checks and runs.

use crate::cli::program::{TestFolder, facing_front};
use serde_json::Value;
use std::process::Command;

fn two() -> TestFolder {
    let folder = TestFolder::new();
    folder.put_cloud("two.ply", &[facing_front(-0.5, 0.0, 1.0), facing_front(0.7, 0.2, 0.6)]);
    folder
}

const FILM: &str = "two.ply -r ewa-phong --size 40 --camera front --path orbit:6";

/// Runs a task of a job by hand.
fn task(folder: &TestFolder, words: &[&str]) -> std::process::Output {
    task_of(folder, "job", words)
}

/// The same of any job.
fn task_of(folder: &TestFolder, job: &str, words: &[&str]) -> std::process::Output {
    let mut command = Command::new("bash");
    command.arg(folder.at(&format!("{job}/task.sh"))).args(words);
    for (name, value) in folder.command().get_envs() {
        match value {
            Some(value) => command.env(name, value),
            None => command.env_remove(name),
        };
    }
    // From anywhere: the job knows its folders.
    command.current_dir("/").output().unwrap()
}

fn same_film(folder: &TestFolder) {
    for i in 1..=6 {
        let read = |name: &str| std::fs::read(folder.at(&format!("{name}/two-{i}.png"))).unwrap();
        assert!(read("job/result") == read("whole"), "picture {i}");
    }
}

#[test]
#[cfg(unix)]
fn a_job_s_tasks_make_what_one_piece_makes_and_say_how_they_fail() {
    let folder = two();
    std::fs::create_dir(folder.at("whole")).unwrap();
    folder.run(&format!("render {FILM} -o whole/two.png")).done();
    let told = folder.run(&format!("farm film {FILM} -o job/two.png --parts 3 --json")).json();
    assert_eq!(told["n_tasks"], 4);
    let template = std::fs::read_to_string(folder.at("job/template.yaml")).unwrap();
    for words in [
        "specificationVersion: jobtemplate-2023-09",
        "dependencies: [ { dependsOn: Parts } ]",
        "{ name: Part, type: INT, range: \"1-3\" }",
        "INPUT1='{{Param.Input1}}'",
        "openjd_progress: 100",
        "openjd_fail: ",
    ] {
        assert!(template.contains(words), "{words} is missing in:\n{template}");
    }
    let slurm = std::fs::read_to_string(folder.at("job/slurm.sh")).unwrap();
    assert!(slurm.contains("--array=1-3") && slurm.contains("--dependency=afterok"), "{slurm}");
    for part in ["1", "3"] {
        let ended = task(&folder, &["Parts", part]);
        assert!(ended.status.success(), "{ended:?}");
        assert!(String::from_utf8_lossy(&ended.stdout).contains("openjd_progress: 100"));
    }
    // What is wrong with a command line, and not the usage below it.
    let ended = task(&folder, &["Parts", "9"]);
    let said = String::from_utf8_lossy(&ended.stdout).into_owned();
    let failed = said.lines().find_map(|line| line.strip_prefix("openjd_fail: ")).unwrap();
    assert!(failed.contains("9/3") && !failed.contains("--help"), "{said}");
    let ended = task(&folder, &["Merge"]);
    assert!(!ended.status.success());
    let said = String::from_utf8_lossy(&ended.stdout).into_owned();
    assert!(said.contains("openjd_fail: surfelshop: part 2 of 3 is missing"), "{said}");
    assert!(!task(&folder, &["Parts"]).status.success(), "a part has to be named");
    assert!(!task(&folder, &["Nothing"]).status.success());
    assert!(task(&folder, &["Parts", "2"]).status.success());
    assert!(task(&folder, &["Merge"]).status.success());
    same_film(&folder);
}

/// Words of the papers: four entries without times.
const PAPERS: [&str; 15] = [
    "thesis",
    "--only",
    "Figure 3",
    "--only",
    "Figure 10",
    "--only",
    "Table 1",
    "--only",
    "Figure 14",
    "--size",
    "40",
    "--samples",
    "4",
    "--repeats",
    "1",
];

/// Writes the job of the papers, and makes them in one piece.
fn papers(folder: &TestFolder) {
    let all = |words: &[&str]| folder.run_with(&[words, &PAPERS].concat()).done();
    all(&["papers", "-o", "whole"]);
    all(&["farm", "papers", "--parts", "2", "-o", "papers"]);
}

/// The page without when and where it was made.
fn same_pages(folder: &TestFolder) {
    let read = |place: &str| {
        let page = std::fs::read_to_string(folder.at(&format!("{place}/thesis.html"))).unwrap();
        let page = page.replace(&format!("/{place}/work"), "/work");
        page.lines().filter(|line| !line.contains(" threads; ")).map(str::to_owned).collect()
    };
    let [whole, job]: [Vec<String>; 2] = ["whole", "papers/result"].map(read);
    assert!(whole.iter().any(|line| line.contains("data:image/png;base64,")));
    assert_eq!(whole.len(), job.len());
    for (whole, job) in whole.iter().zip(&job) {
        assert!(whole == job, "{}\n{}", &whole[..whole.len().min(400)], &job[..job.len().min(400)]);
    }
}

/// Invariant: the pages of the papers that the tasks of a job make, in any order, are those of one run
#[test]
#[cfg(unix)]
fn the_papers_made_by_a_job_are_those_of_one_run() {
    let folder = TestFolder::new();
    papers(&folder);
    let template = std::fs::read_to_string(folder.at("papers/template.yaml")).unwrap();
    assert!(template.contains("name: \"papers in 2 parts\""), "{template}");
    assert!(template.contains("- name: Pages\n  dependencies: [ { dependsOn: Parts } ]"));
    for words in [["Parts", "2"], ["Parts", "1"], ["Pages", ""]] {
        let ended = task_of(&folder, "papers", &words);
        assert!(ended.status.success(), "{ended:?}");
        let has_pages = folder.at("papers/result/index.html").exists();
        assert_eq!(has_pages, words[0] == "Pages", "a part writes no pages");
        if has_pages {
            let said = String::from_utf8_lossy(&ended.stdout).into_owned();
            assert_eq!(said.matches(": was there").count(), 4, "parts made all: {said}");
        }
    }
    same_pages(&folder);
    folder.run("farm papers -o job --part 1/2").failed(&["--part", "leave it out"]);
    folder.run("farm papers -o job --gallery small").failed(&["--gallery", "makes pages"]);
}

#[test]
fn what_is_no_job_is_one_line() {
    let folder = two();
    folder.run("farm film two.ply -o two.png").failed(&["--path"]);
    folder.run("farm compare two.ply -r flat -o job").failed(&["--path"]);
    folder.run("farm report two.ply -r flat -o job --parts 0").misused(&["0"]);
    folder.run("farm report two.ply -r flat -o job --part 1/2").failed(&["--part", "leave it out"]);
    folder.run("farm run job").failed(&["job", "surfelshop farm report"]);
    folder.run("farm report two.ply -r flat --knob ambient=0,1 --reference flat -o job").done();
    folder.run("farm run job --openjd /no/such/openjd").failed(&[
        "/no/such/openjd",
        "pip install openjd-cli",
        "slurm.sh",
    ]);
    folder.run("farm report two.ply -r flat --title {{x}} -o job").misused(&["--title"]);
    folder
        .run("farm index two.ply --step extent -o i/a.surfels")
        .failed(&["--step", "leave it out"]);
    let compare = "farm compare two.ply -r flat -r ewa-phong --path orbit:4 -o c";
    folder.run(&format!("{compare} --parts 5")).failed(&["--parts 5", "4 pictures"]);
    folder.run("farm film two.ply --path orbit:4 -o a/a.png -o b/b.png").failed(&["one folder"]);
    // Another job's parts are not taken for this one's.
    std::fs::create_dir(folder.at("job/parts")).unwrap();
    let line = "farm report two.ply -r flat --knob ambient=0,1 --reference flat -o job";
    folder.run(line).done();
    folder.run(&format!("{line} --parts 3")).failed(&["another job was run there", "delete parts"]);
    folder
        .run_with(&["farm", "film", "a\r.ply", "-o", "r/a.png", "--path", "orbit:4"])
        .failed(&["templates"]);
}

/// What is no Unicode is refused in a line, or drawn.
#[test]
#[cfg(unix)]
fn names_without_unicode_are_no_panic() {
    use std::os::unix::ffi::OsStrExt as _;
    let folder = two();
    let odd = std::ffi::OsStr::from_bytes(b"odd\xff.ply");
    std::fs::copy(folder.at("two.ply"), folder.at("two.ply").with_file_name(odd)).unwrap();
    let run = |words: &[&str]| {
        let ended = folder.command().args(words).arg(odd).output().unwrap();
        (ended.status.code(), String::from_utf8_lossy(&ended.stderr).into_owned())
    };
    let (code, said) = run(&["farm", "film", "--path", "orbit:4", "-o", "f/a.png"]);
    assert!(code == Some(1) && said.contains("it is no Unicode"), "{code:?} {said}");
    std::fs::create_dir(folder.at("p")).unwrap();
    let part = ["render", "--size", "40", "--path", "orbit:2", "--part", "1/2", "-o", "p/a.png"];
    assert_eq!(run(&part).0, Some(0));
    let page = ["share", "--size", "40", "--path", "orbit:2", "-o", "page.html"];
    assert_eq!(run(&page).0, Some(0));
}

/// The standard's own program checks the templates and runs them; in a virtual environment that this makes where
/// `openjd` is not installed.
#[test]
#[cfg(unix)]
fn the_standard_s_program_takes_the_templates_and_runs_them() {
    if std::env::var_os("SURFELSHOP_LONG").is_none() {
        return;
    }
    let folder = two();
    let openjd = openjd(&folder);
    std::fs::create_dir(folder.at("whole")).unwrap();
    folder.run(&format!("render {FILM} -o whole/two.png")).done();
    let report = "two.ply -r ewa-phong --size 40 --reference ewa-phong --reference-set ambient=1 --repeats 1 --knob \
                  ambient=0,0.5,0.9";
    folder.run(&format!("report {report} -o whole")).done();
    let compare = "two.ply -r flat -r ewa-phong --size 40 --path orbit:4 --repeats 1";
    let index = "two.ply -o index/two.surfels";
    for line in [
        format!("farm report {report} -o report --parts 2"),
        format!("farm compare {compare} -o compare --parts 2"),
        format!("farm index {index} --parts 2"),
        format!("farm film {FILM} -o job/two.png --parts 3"),
    ] {
        folder.run(&line).done();
    }
    papers(&folder);
    for job in ["report", "compare", "index", "job", "papers"] {
        let template = folder.at(&format!("{job}/template.yaml"));
        let checked = Command::new(&openjd).arg("check").arg(&template).output().unwrap();
        assert!(checked.status.success(), "{job}: {checked:?}");
        folder.run(&format!("farm run {job} --workers 2 --openjd {openjd}")).done();
    }
    same_film(&folder);
    same_pages(&folder);
    let errors = |name: &str| -> Vec<Value> {
        let text = std::fs::read_to_string(folder.at(name)).unwrap();
        let told: Value = serde_json::from_str(&text).unwrap();
        let cells = told["knobs"][0]["cells"].as_array().unwrap().clone();
        cells.iter().map(|cell| cell["errors"].clone()).collect()
    };
    assert_eq!(errors("report/result/report.json"), errors("whole/report.json"));
    // A task that fails is tried again, then named.
    std::fs::remove_file(folder.at("two.ply")).unwrap();
    folder
        .run(&format!("farm run job --workers 2 --openjd {openjd}"))
        .failed(&["Parts, part 1", "two.ply"]);
}

#[cfg(unix)]
fn openjd(folder: &TestFolder) -> String {
    if Command::new("openjd").arg("--version").output().is_ok_and(|ended| ended.status.success()) {
        return "openjd".to_owned();
    }
    let place = folder.at("venv");
    let made = Command::new("python3").args(["-m", "venv"]).arg(&place).status().unwrap();
    assert!(made.success(), "python3 -m venv");
    let pip = Command::new(place.join("bin/pip")).args(["-q", "install", "openjd-cli"]).status();
    assert!(pip.unwrap().success(), "pip install openjd-cli");
    place.join("bin/openjd").display().to_string()
}
