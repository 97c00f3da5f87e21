//! `surfelshop farm`: work in parts as a job for render farms, and such a job run here.

pub(crate) mod arguments;
mod job;
mod local;
mod papers;
mod scripts;
mod template;

use anyhow::{Context as _, ensure};
use arguments::{FarmArguments, FarmCommand, FarmJob};
use job::{Job, JobOrder, Step};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::path::{Path, PathBuf};
use surfelshop_cloud::files::folder_of;
use surfelshop_session::options::PrintArguments;
use surfelshop_session::options::part::Part;
use surfelshop_session::options::path::PathSpec;
use surfelshop_session::output::{command_line, files, terminal};
use surfelshop_session::render::RenderArguments;

/// The template of Open Job Description.
const TEMPLATE: &str = "template.yaml";
/// The values of its parameters.
const PARAMETERS: &str = "parameters.json";
/// What `farm run` has to know.
const JOB: &str = "job.json";

/// What `farm run` knows of a job.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct StoredJob {
    name: String,
    steps: Vec<Step>,
}

/// Options of a job that its tasks do not get.
const OF_JOB: [&str; 4] = ["--parts", "--out", "--output", "-o"];

/// Runs the command.
pub(crate) fn run(arguments: &FarmArguments) -> anyhow::Result<()> {
    // In front of it stand `farm` and what the job is.
    let words: Vec<String> = command_line::typed_words().skip(2).collect();
    let words = command_line::without(&words, &OF_JOB);
    let words: Vec<String> = words.into_iter().filter(|word| word != "--json").collect();
    let merge = "merge \"$JOB/parts\" -o \"$JOB/result\"".to_owned();
    match &arguments.command {
        FarmCommand::Report(given) => {
            let (work, n) = (&given.work, given.parts);
            without_part(work.part)?;
            let order = JobOrder {
                command: "report",
                words,
                files: &work.files,
                place: &work.out,
                parts: n,
            };
            let part = |number: &str| format!("-o \"$JOB/parts\" --part {number}/{n}");
            let job = order.job(&[
                ("Reference", None, part("0")),
                ("Parts", Some(n), part("$PART")),
                ("Merge", None, merge),
            ])?;
            write(&job, &work.report)
        }
        FarmCommand::Compare(given) => {
            let (work, n) = (&given.work, given.parts);
            without_part(work.part)?;
            ensure!(work.path.is_some(), "a comparison is divided along --path, such as orbit:24");
            if let Some(PathSpec::Orbit(frames) | PathSpec::Along(frames)) = work.path {
                ensure!(
                    n <= frames,
                    "--parts {n}: the path has {frames} pictures, and a part has one at least"
                );
            }
            let order = JobOrder {
                command: "compare",
                words,
                files: &work.files,
                place: &work.out,
                parts: n,
            };
            let part = format!("-o \"$JOB/parts\" --part $PART/{n}");
            let job = order.job(&[("Parts", Some(n), part), ("Merge", None, merge)])?;
            write(&job, &work.report)
        }
        FarmCommand::Film(given) => write(&film(given, words, merge)?, &given.work.report),
        FarmCommand::Index(given) => {
            let (work, n) = (&given.work, given.parts);
            without_part(work.part)?;
            ensure!(
                work.step.is_none(),
                "--step is what the tasks of a job are given; leave it out"
            );
            let name = work.output.file_name().unwrap_or_default().to_string_lossy();
            let name = command_line::quoted(name.into_owned());
            let place = folder_of(&work.output);
            let order = JobOrder { command: "index", words, files: &work.inputs, place, parts: n };
            let out = format!("-o \"$JOB/\"{name}");
            let job = order.job(&[
                ("Extent", None, format!("{out} --step extent")),
                ("Points", Some(n), format!("{out} --step points --part $PART/{n}")),
                ("Plan", None, format!("{out} --step plan")),
                ("Surfels", Some(n), format!("{out} --step surfels --part $PART/{n}")),
                ("Pyramid", None, out),
            ])?;
            write(&job, &work.report)
        }
        FarmCommand::Papers(given) => write(&papers::job(given, words)?, &given.work.report),
        FarmCommand::Run(given) => local::run(given),
    }
}

/// A film in parts.
fn film(
    given: &FarmJob<RenderArguments>,
    words: Vec<String>,
    merge: String,
) -> anyhow::Result<Job> {
    let (work, n) = (&given.work, given.parts);
    without_part(work.part)?;
    ensure!(work.path.is_some(), "a film is divided along --path, such as orbit:240");
    let first = work.out.first().context("a film needs a picture to write")?;
    let place = folder_of(first.path());
    ensure!(
        work.out.iter().all(|file| folder_of(file.path()) == place),
        "-o: expected all files of a film in one folder, which is the job's, found several"
    );
    let order = JobOrder { command: "render", words, files: &work.files, place, parts: n };
    let mut part = format!("--part $PART/{n}");
    for file in &work.out {
        let name = file.path().file_name().unwrap_or_default().to_string_lossy();
        let name = command_line::quoted(name.into_owned());
        part.push_str(&format!(" -o \"$JOB/parts/\"{name}"));
    }
    order.job(&[("Parts", Some(n), part), ("Merge", None, merge)])
}

/// Refuses a part of a job.
fn without_part(part: Option<Part>) -> anyhow::Result<()> {
    ensure!(part.is_none(), "--part is what the tasks of a job are given; leave it out");
    Ok(())
}

/// Writes the folder of a job.
fn write(job: &Job, print: &PrintArguments) -> anyhow::Result<()> {
    let place = &job.place;
    std::fs::create_dir_all(place)
        .with_context(|| format!("{}: the folder cannot be made", place.display()))?;
    let program = std::env::current_exe().context("the program does not know its own place")?;
    let shown = program.display().to_string();
    let stored = StoredJob { name: job.name.clone(), steps: job.steps.clone() };
    check_free(place, &stored)?;
    let all = [
        (TEMPLATE, template::template(job)),
        (PARAMETERS, serde_json::to_string_pretty(&template::parameters(job, &shown))?),
        (JOB, serde_json::to_string_pretty(&stored)?),
        ("task.sh", scripts::task(job, &program)?),
        ("slurm.sh", scripts::slurm(job)?),
    ];
    for (name, text) in &all {
        files::write_whole(&place.join(name), text.as_bytes())?;
    }
    let n_tasks: u64 = job.steps.iter().map(|step| u64::from(step.parts.unwrap_or(1))).sum();
    if print.json {
        return terminal::json(&json!({
            "command": "farm",
            "version": env!("CARGO_PKG_VERSION"),
            "job": place.display().to_string(),
            "files": all.iter().map(|(name, _)| name).collect::<Vec<_>>(),
            "steps": job.steps,
            "n_tasks": n_tasks,
        }));
    }
    let at = command_line::from_here(place);
    let farm = command_line::program();
    terminal::line(format!(
        "{at}: {}, {n_tasks} tasks. Next, one of:\n  {farm} farm run {at}\n  sh {at}/slurm.sh\n  \
         and {at}/{TEMPLATE} with {PARAMETERS} for any farm that takes Open Job Description",
        job.name
    ))
}

/// Refuses the folder of another job that was run: its parts would be taken for those of this one.
fn check_free(place: &Path, job: &StoredJob) -> anyhow::Result<()> {
    let results: Vec<&str> =
        ["parts", "result"].into_iter().filter(|name| place.join(name).exists()).collect();
    let path = place.join(JOB);
    if results.is_empty() || !path.is_file() {
        return Ok(());
    }
    let known = files::read_short(&path, 1 << 30)?;
    let known = serde_json::from_slice::<StoredJob>(&known).ok();
    ensure!(
        known.as_ref() == Some(job),
        "{}: another job was run there; name another folder, or delete {} in it",
        place.display(),
        results.join(" and ")
    );
    Ok(())
}

/// Reads what was written of a job.
fn stored(place: &Path) -> anyhow::Result<(PathBuf, StoredJob)> {
    let path = place.join(JOB);
    ensure!(
        path.is_file(),
        "{}: expected the folder of a job, which `surfelshop farm report` and its like write",
        place.display()
    );
    let bytes = files::read_short(&path, 1 << 30)?;
    let stored = serde_json::from_slice(&bytes)
        .with_context(|| format!("{}: it is no job of this program", path.display()))?;
    let place = place.canonicalize().with_context(|| place.display().to_string())?;
    Ok((place, stored))
}
