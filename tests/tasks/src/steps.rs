//! Steps of a verification: run in order, timed, and summed up at the end.

use std::time::{Duration, Instant};

/// How a step ended.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Outcome {
    /// It ran and found nothing wrong.
    Passed,
    /// It ran and found something, or could not run although it had to.
    Failed(String),
    /// It could not run here, and that is tolerated, but never silently.
    NotChecked(String),
}

struct Entry {
    name: &'static str,
    outcome: Outcome,
    took: Duration,
}

/// The steps run so far.
pub(crate) struct Steps {
    started: Instant,
    entries: Vec<Entry>,
}

impl Steps {
    /// No step has run yet; the clock starts.
    pub(crate) fn new() -> Self {
        Self { started: Instant::now(), entries: Vec::new() }
    }

    /// Runs a step, prints its time and result and remembers both.
    pub(crate) fn run(&mut self, name: &'static str, step: impl FnOnce() -> Outcome) {
        println!("\n== {name}");
        let started = Instant::now();
        let outcome = step();
        let entry = Entry { name, outcome, took: started.elapsed() };
        println!("{}", line(&entry));
        self.entries.push(entry);
    }

    /// Whether this step has run and passed.
    pub(crate) fn passed(&self, name: &str) -> bool {
        self.entries.iter().any(|entry| entry.name == name && entry.outcome == Outcome::Passed)
    }

    /// Prints a line per step and the total; true when nothing failed.
    pub(crate) fn sum_up(&self) -> bool {
        println!("\n== summary");
        for entry in &self.entries {
            println!("{}", line(entry));
        }
        let good = !self.entries.iter().any(|entry| matches!(entry.outcome, Outcome::Failed(_)));
        let verdict = if good { "verified" } else { "NOT verified" };
        println!("{verdict} in {}", readable(self.started.elapsed()));
        good
    }
}

fn line(entry: &Entry) -> String {
    let time = readable(entry.took);
    let (word, reason) = match &entry.outcome {
        Outcome::Passed => ("ok", None),
        Outcome::Failed(reason) => ("FAILED", Some(reason)),
        Outcome::NotChecked(reason) => ("NOT CHECKED", Some(reason)),
    };
    let reason = reason.map(|reason| format!("  ({reason})")).unwrap_or_default();
    format!("{word:<11}  {name:<8} {time:>9}{reason}", name = entry.name)
}

/// Minutes and seconds, or tenths of a second below a minute.
pub(crate) fn readable(time: Duration) -> String {
    let seconds = time.as_secs();
    if seconds < 60 {
        format!("{:.1} s", time.as_secs_f64())
    } else {
        format!("{} min {:02} s", seconds / 60, seconds % 60)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_failure_fails_the_whole() {
        let mut steps = Steps::new();
        steps.run("fmt", || Outcome::Passed);
        steps.run("clippy", || Outcome::NotChecked("no clippy here".into()));
        assert!(steps.sum_up(), "a tolerated gap does not fail");
        steps.run("test", || Outcome::Failed("exit status: 101".into()));
        assert!(!steps.sum_up());
        assert!(steps.passed("fmt") && !steps.passed("test") && !steps.passed("clippy"));
    }

    #[test]
    fn times_are_readable() {
        assert_eq!(readable(Duration::from_millis(1_240)), "1.2 s");
        assert_eq!(readable(Duration::from_secs(125)), "2 min 05 s");
    }
}
