//! A job run here: the standard's own program runs tasks, several at a time, step after step.

use super::arguments::FarmRun;
use super::{PARAMETERS, Step, TEMPLATE, stored};
use anyhow::{Context as _, bail};
use serde_json::json;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;
use surfelshop_session::output::terminal::{self, Progress};

/// How often a task is tried.
const TRIES: u32 = 2;

/// Runs a job.
pub(super) fn run(arguments: &FarmRun) -> anyhow::Result<()> {
    let (place, job) = stored(&arguments.job)?;
    check_openjd(arguments)?;
    let started = Instant::now();
    let mut steps = Vec::new();
    for step in &job.steps {
        let n_again = run_step(arguments, &place, step)?;
        let tasks = step.parts.unwrap_or(1);
        steps.push(json!({ "name": step.name, "tasks": tasks, "tried_again": n_again }));
    }
    let seconds = started.elapsed().as_secs_f64();
    if arguments.report.json {
        return terminal::json(&json!({
            "command": "farm",
            "version": env!("CARGO_PKG_VERSION"),
            "job": place.display().to_string(),
            "steps": steps,
            "seconds": seconds,
        }));
    }
    terminal::line(format!("{}: done in {seconds:.1} s", arguments.job.display()))
}

/// Says how to get the standard's program where it is missing.
fn check_openjd(arguments: &FarmRun) -> anyhow::Result<()> {
    let version = Command::new(&arguments.openjd)
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    match version {
        Ok(_) => Ok(()),
        Err(error) => bail!(
            "{}: {error}; install it with `pip install openjd-cli`, name it with --openjd, or run the tasks by task.sh \
             or slurm.sh in the folder of the job",
            arguments.openjd.display()
        ),
    }
}

/// A task that failed, and the last line that says why.
type Failure = (Option<u32>, String);

/// Runs all tasks of a step; how many had to be tried again.
fn run_step(arguments: &FarmRun, place: &Path, step: &Step) -> anyhow::Result<usize> {
    let tasks: Vec<Option<u32>> = match step.parts {
        Some(parts) => (1..=parts).map(Some).collect(),
        None => vec![None],
    };
    let progress = Progress::new(format!("{}: {} tasks", step.name, tasks.len()));
    let next = AtomicUsize::new(0);
    let (say, hear) = std::sync::mpsc::channel();
    let again = AtomicUsize::new(0);
    let failures: Mutex<Vec<Failure>> = Mutex::default();
    let work = |say: std::sync::mpsc::Sender<()>| {
        while let Some(&task) = tasks.get(next.fetch_add(1, Ordering::Relaxed)) {
            let mut outcome = Ok(());
            for attempt in 0..TRIES {
                if attempt > 0 {
                    again.fetch_add(1, Ordering::Relaxed);
                }
                outcome = run_task(arguments, place, &step.name, task);
                if outcome.is_ok() {
                    break;
                }
            }
            if let (Err(error), Ok(mut all)) = (outcome, failures.lock()) {
                all.push((task, format!("{error:#}")));
            }
            if say.send(()).is_err() {
                return;
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..arguments.workers.min(u32::try_from(tasks.len()).unwrap_or(u32::MAX)) {
            let (work, say) = (&work, say.clone());
            scope.spawn(move || work(say));
        }
        drop(say);
        for (n, ()) in hear.iter().enumerate() {
            // Ctrl-C ends the program, and with it the tasks; what they wrote stays.
            let _goes_on = progress.tell((n + 1) as f64 / tasks.len() as f64);
        }
    });
    drop(progress);
    let mut failures = failures.into_inner().unwrap_or_default();
    failures.sort();
    let Some((task, line)) = failures.first() else { return Ok(again.into_inner()) };
    let named = task.map_or_else(String::new, |part| format!(", part {part}"));
    let more = match failures.len() {
        1 => String::new(),
        n => format!("; {} more tasks failed", n - 1),
    };
    bail!("{}{named}: {line}{more}; run the job again, what is done is not done again", step.name)
}

/// Runs one task, in a session of its own.
fn run_task(
    arguments: &FarmRun,
    place: &Path,
    step: &str,
    task: Option<u32>,
) -> anyhow::Result<()> {
    let mut command = Command::new(&arguments.openjd);
    let parameters = place.join(PARAMETERS);
    command
        .arg("run")
        .arg(place.join(TEMPLATE))
        .args(["--step", step, "--no-run-dependencies"])
        .arg("-p")
        .arg(format!("file://{}", parameters.display()))
        // Where the job is now, wherever it was written.
        .arg("-p")
        .arg(format!("Job={}", place.display()));
    if let Some(part) = task {
        command.arg("-tp").arg(format!("Part={part}"));
    }
    let output = command.stdin(Stdio::null()).output().context("openjd cannot be started")?;
    let log = place.join("log");
    if std::fs::create_dir_all(&log).is_ok() {
        let name = task.map_or_else(|| step.to_owned(), |part| format!("{step}-{part}"));
        let text = [output.stdout.as_slice(), output.stderr.as_slice()].concat();
        // What a task said is beside the point where it cannot be kept.
        drop(std::fs::write(log.join(format!("{name}.txt")), text));
    }
    match output.status.success() {
        true => Ok(()),
        false => bail!("{}", reason(&String::from_utf8_lossy(&output.stdout))),
    }
}

/// Why a task failed: in the words of the standard, else its last line.
fn reason(said: &str) -> String {
    let failed = said.lines().rev().find_map(|line| line.split_once("openjd_fail: "));
    let last = || said.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or_default();
    failed.map_or_else(last, |(_, reason)| reason).trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_are_told_in_the_words_of_the_standard() {
        let said = "start\n12:00 openjd_fail: surfelshop: no such file\nSession ended\n";
        assert_eq!(reason(said), "surfelshop: no such file");
        assert_eq!(reason("start\nended with 1\n\n"), "ended with 1");
    }
}
