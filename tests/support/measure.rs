//! What a piece of work costs the process that does it, as Linux tells.
//!
//! Each piece runs in a process of its own: the peak of memory belongs to a process and never
//! falls, and memory that an earlier piece gave back would spare a later one its page faults.

use anyhow::{Context as _, Result};
use std::process::Command;
use std::time::Instant;

/// The environment variable that tells a test, run again in a process of its own, what to do there.
const TASK: &str = "SURFELSHOP_TEST_TASK";

/// The cost of a piece of work.
#[derive(Clone, Copy, Debug)]
pub struct Cost {
    /// User and system time of all threads, seconds.
    pub cpu: f64,
    /// Elapsed time, seconds.
    pub wall: f64,
    /// The most memory the process had at a time, from its start to the end of the work, bytes.
    pub peak: f64,
}

impl Cost {
    /// Does a piece of work and tells its cost.
    ///
    /// # Errors
    /// The work's own, or where the system does not tell.
    pub fn of<T>(work: impl FnOnce() -> Result<T>) -> Result<(T, Self)> {
        let (cpu, started) = (cpu_seconds(), Instant::now());
        let done = work()?;
        let wall = started.elapsed().as_secs_f64();
        Ok((done, Self { cpu: cpu_seconds() - cpu, wall, peak: peak_bytes()? }))
    }

    /// The line by which a child tells its parent.
    #[must_use]
    pub fn to_line(self) -> String {
        format!("cost {} {} {}", self.cpu, self.wall, self.peak)
    }

    /// The cost that a child told among other lines.
    ///
    /// # Errors
    /// Where there is none.
    pub fn from_lines(lines: &str) -> Result<Self> {
        // A test's name may stand in front, without an end of its line.
        let line = lines.lines().find_map(|line| Some(line.split_once("cost ")?.1));
        let numbers: Vec<f64> = line
            .with_context(|| format!("the child tells its cost, found: {lines}"))?
            .split(' ')
            .map(str::parse)
            .collect::<Result<_, _>>()?;
        let [cpu, wall, peak] = numbers[..] else { anyhow::bail!("three numbers: {lines}") };
        Ok(Self { cpu, wall, peak })
    }
}

/// Runs this program again with other arguments and returns what it prints.
///
/// # Errors
/// Where it cannot be run or fails.
pub fn in_child(arguments: &[&str]) -> Result<String> {
    output_of(Command::new(std::env::current_exe()?).args(arguments))
}

/// Runs one test of this program again with a task and returns what it prints.
///
/// # Errors
/// Where it cannot be run or fails.
pub fn test_in_child(test: &str, task: &str) -> Result<String> {
    let arguments = ["--exact", test, "--nocapture", "--include-ignored"];
    output_of(Command::new(std::env::current_exe()?).args(arguments).env(TASK, task))
}

/// The task of a test that [`test_in_child`] runs.
#[must_use]
pub fn task_of_child() -> Option<String> {
    std::env::var(TASK).ok()
}

fn output_of(command: &mut Command) -> Result<String> {
    let output = command.output()?;
    let errors = String::from_utf8_lossy(&output.stderr);
    anyhow::ensure!(output.status.success(), "{command:?} failed: {errors}");
    Ok(String::from_utf8(output.stdout)?)
}

/// Processor time of this process so far, threads that have ended included.
pub(crate) fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// The most memory this process had so far.
fn peak_bytes() -> Result<f64> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let words = line.context("the kernel keeps the peak of memory")?;
    let kibibytes: f64 = words.trim().trim_end_matches(" kB").parse()?;
    Ok(kibibytes * 1024.0)
}
