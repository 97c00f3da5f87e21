//! What a piece of work costs the process that does it, as Linux tells.
//!
//! Each piece runs in a process of its own: the peak of memory belongs to a process and never
//! falls, and memory that an earlier piece gave back would spare a later one its page faults.

use anyhow::{Context as _, Result};
use std::process::Command;
use std::time::Instant;

/// The cost of a piece of work.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cost {
    /// User and system time of all threads, seconds.
    pub(crate) cpu: f64,
    /// Elapsed time, seconds.
    pub(crate) wall: f64,
    /// The most memory the process had at a time, from its start to the end of the work, bytes.
    pub(crate) peak: f64,
}

impl Cost {
    /// Does a piece of work and tells its cost.
    pub(crate) fn of<T>(work: impl FnOnce() -> Result<T>) -> Result<(T, Self)> {
        let (cpu, started) = (cpu_seconds()?, Instant::now());
        let done = work()?;
        let wall = started.elapsed().as_secs_f64();
        Ok((done, Self { cpu: cpu_seconds()? - cpu, wall, peak: peak_bytes()? }))
    }

    /// The line by which a child tells its parent.
    pub(crate) fn to_line(self) -> String {
        format!("cost {} {} {}", self.cpu, self.wall, self.peak)
    }

    /// The cost that a child told among other lines.
    pub(crate) fn from_lines(lines: &str) -> Result<Self> {
        let line = lines.lines().find_map(|line| line.strip_prefix("cost "));
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
pub(crate) fn in_child(arguments: &[&str]) -> Result<String> {
    let output = Command::new(std::env::current_exe()?).args(arguments).output()?;
    let errors = String::from_utf8_lossy(&output.stderr);
    anyhow::ensure!(output.status.success(), "{arguments:?} failed: {errors}");
    Ok(String::from_utf8(output.stdout)?)
}

/// Processor time of this process so far. `/proc/self/stat` counts in hundredths of a second, too
/// coarse for work that takes ten of them; the scheduler's own account is in nanoseconds.
fn cpu_seconds() -> Result<f64> {
    // The account of a running thread is brought up to date when it lets others run.
    std::thread::yield_now();
    let mut nanoseconds = 0.0;
    for thread in std::fs::read_dir("/proc/self/task").context("processor time is Linux's")? {
        let account = std::fs::read_to_string(thread?.path().join("schedstat"))?;
        nanoseconds += account.split(' ').next().unwrap_or_default().parse::<f64>()?;
    }
    Ok(nanoseconds * 1e-9)
}

/// The most memory this process had so far.
fn peak_bytes() -> Result<f64> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let words = line.context("the kernel keeps the peak of memory")?;
    let kibibytes: f64 = words.trim().trim_end_matches(" kB").parse()?;
    Ok(kibibytes * 1024.0)
}
