//! Test programs: two at a time, the longest first, each with its time, and the slowest tests of all.
//!
//! Programs that mostly wait (for deadlines, child processes, a window) run beside those that compute.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::cargo;
use crate::steps::{Outcome, readable};

/// Programs that take long, longest first, and then the one that uses one processor alone, so that it does not come last:
/// the others follow in the order that Cargo names them.
const FIRST: [&str; 5] = ["program", "render", "surfelshop_viewer", "memory", "pure"];

/// Programs that measure the memory of their own process: one test at a time.
const ONE_BY_ONE: [&str; 1] = ["memory"];

/// Programs at a time. Each runs as many tests at a time as the machine has processors.
const AT_A_TIME: usize = 2;

/// How many of the slowest tests are listed.
const N_SLOWEST: usize = 10;

/// A test program.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Program {
    name: String,
    executable: PathBuf,
    /// The folder of its package, where Cargo runs it.
    folder: PathBuf,
}

/// How a program ended.
struct Ended {
    name: String,
    took: Duration,
    /// Tests with their seconds.
    tests: Vec<(String, f64)>,
    failed: bool,
}

/// Builds all test programs and runs them.
pub(crate) fn run(long: bool) -> Outcome {
    let started = Instant::now();
    let built = cargo::output(
        cargo::step("test").args(["--no-run", "--message-format=json-render-diagnostics"]),
    );
    let text = match built {
        Ok(text) => text,
        Err(reason) => return Outcome::Failed(format!("the tests were not built: {reason}")),
    };
    println!("built in {}", readable(started.elapsed()));
    let programs = Mutex::new(in_order(text.lines().filter_map(program_of).collect()));
    let ended = Mutex::new(Vec::new());
    let work = || {
        loop {
            let Some(program) = locked(&programs).pop_front() else { return };
            let one = run_program(&program, long);
            locked(&ended).push(one);
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..AT_A_TIME {
            scope.spawn(work);
        }
    });
    let ended = ended.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    sum_up(&ended)
}

fn locked<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// The long ones first.
fn in_order(mut programs: Vec<Program>) -> VecDeque<Program> {
    let rank = |program: &Program| FIRST.iter().position(|first| *first == program.name);
    programs.sort_by_key(|program| rank(program).unwrap_or(FIRST.len()));
    programs.into()
}

/// The program that a message of Cargo's names, if any.
fn program_of(message: &str) -> Option<Program> {
    let is_test =
        message.contains("\"reason\":\"compiler-artifact\"") && message.contains("\"test\":true}");
    let executable = text_of(message, "executable").filter(|_| is_test)?;
    let manifest = PathBuf::from(text_of(message, "manifest_path")?);
    let target = &message[message.find("\"target\":")?..];
    Some(Program {
        name: text_of(target, "name")?,
        executable: executable.into(),
        folder: manifest.parent()?.to_owned(),
    })
}

/// A text of a JSON object, by its name.
fn text_of(message: &str, name: &str) -> Option<String> {
    let start = message.find(&format!("\"{name}\":\""))? + name.len() + 4;
    let mut text = String::new();
    let mut rest = message[start..].chars();
    loop {
        match rest.next()? {
            '"' => return Some(text),
            '\\' => text.push(rest.next()?),
            other => text.push(other),
        }
    }
}

/// Runs a program to its end and prints what it said where it failed.
fn run_program(program: &Program, long: bool) -> Ended {
    let mut command = Command::new(&program.executable);
    command.current_dir(&program.folder).env("CARGO", cargo::program()).stdin(Stdio::null());
    // Times of single tests are not stable in libtest; this lets it tell them.
    command.args(["-Z", "unstable-options", "--report-time"]).env("RUSTC_BOOTSTRAP", "1");
    if ONE_BY_ONE.contains(&program.name.as_str()) {
        command.arg("--test-threads=1");
    }
    if long {
        command.env("SURFELSHOP_LONG", "1");
    }
    let started = Instant::now();
    let output = command.output();
    let took = started.elapsed();
    let name = program.name.clone();
    let (said, failed) = match output {
        Ok(output) => {
            let said = String::from_utf8_lossy(&output.stdout).into_owned()
                + &String::from_utf8_lossy(&output.stderr);
            (said, !output.status.success())
        }
        Err(error) => (error.to_string(), true),
    };
    let tests: Vec<(String, f64)> = said.lines().filter_map(timed).collect();
    if failed {
        println!("-- {name} ({})\n{said}", program.executable.display());
    }
    let word = if failed { "FAILED" } else { "ok" };
    println!("{word:<7} {name:<28} {:>4} tests {:>12}", tests.len(), readable(took));
    Ended { name, took, tests, failed }
}

/// A test and its seconds, from a line such as `test a::b ... ok <0.123s>`.
fn timed(line: &str) -> Option<(String, f64)> {
    let rest = line.strip_prefix("test ")?;
    let (name, result) = rest.split_once(" ... ")?;
    let seconds = result.split_once('<')?.1.strip_suffix("s>")?;
    Some((name.to_owned(), seconds.parse().ok()?))
}

/// Prints the slowest tests and counts all.
fn sum_up(ended: &[Ended]) -> Outcome {
    let all = ended.iter().flat_map(|one| one.tests.iter().map(|(test, s)| (*s, &one.name, test)));
    let mut all: Vec<_> = all.collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let took: Duration = ended.iter().map(|one| one.took).sum();
    println!(
        "{} tests of {} programs, {} one after the other; the slowest:",
        all.len(),
        ended.len(),
        readable(took)
    );
    for (seconds, program, test) in all.iter().take(N_SLOWEST) {
        println!("{seconds:>8.1} s  {program} {test}");
    }
    let failed: Vec<&str> =
        ended.iter().filter(|one| one.failed).map(|one| one.name.as_str()).collect();
    match (failed.is_empty(), all.is_empty()) {
        (true, false) => Outcome::Passed,
        (true, true) => Outcome::Failed("no test was run".into()),
        (false, _) => Outcome::Failed(failed.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_are_read_from_what_cargo_says_and_nothing_else_is() {
        let line = |test: bool, executable: &str| {
            format!(
                "{{\"reason\":\"compiler-artifact\",\"package_id\":\"x\",\"manifest_path\":\"/a b/Cargo.toml\",\
                 \"target\":{{\"kind\":[\"test\"],\"name\":\"pure\"}},\"profile\":{{\"opt_level\":\"3\",\
                 \"test\":{test}}},\"executable\":{executable},\"fresh\":true}}"
            )
        };
        let found = program_of(&line(true, "\"/t\\\\x\"")).unwrap();
        assert_eq!(found.name, "pure");
        assert_eq!(found.executable, PathBuf::from("/t\\x"));
        assert_eq!(found.folder, PathBuf::from("/a b"));
        assert_eq!(program_of(&line(false, "\"/t/x\"")), None);
        assert_eq!(program_of(&line(true, "null")), None);
    }

    #[test]
    fn times_of_tests_are_read() {
        assert_eq!(timed("test a::b ... ok <1.250s>"), Some(("a::b".to_owned(), 1.25)));
        assert_eq!(timed("test a::b ... FAILED <0.5s>"), Some(("a::b".to_owned(), 0.5)));
        assert_eq!(timed("test result: ok. 3 passed; finished in 0.1s"), None);
    }

    #[test]
    fn the_longest_programs_begin() {
        let program = |name: &str| Program {
            name: name.to_owned(),
            executable: PathBuf::new(),
            folder: PathBuf::new(),
        };
        let ordered = in_order(["a", "pure", "program"].map(program).to_vec());
        let names: Vec<&str> = ordered.iter().map(|program| program.name.as_str()).collect();
        assert_eq!(names, ["program", "pure", "a"]);
    }
}
