//! How long the stages of a frame take, where that is asked for: each pass is submitted and waited for by itself then,
//! so that its time is its own, and the clocks are read where one stage ends and the next begins.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;
pub use surfelshop_raster::Clocks;

/// Which clock tells a stage's CPU time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StageClock {
    /// That of the whole process, all threads together, the driver's among them: nothing else runs meanwhile.
    Process,
    /// Those of the threads that work at it, added up: other stages run beside it.
    Threads,
}

/// A stage of a frame.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct StageTime {
    /// What it is called.
    pub name: String,
    /// What tells its CPU time.
    pub clock: StageClock,
    /// Milliseconds of CPU time.
    pub cpu_ms: f64,
    /// Milliseconds from start to end; nothing where it does not stand alone.
    pub wall_ms: Option<f64>,
    /// Whether it is a part of the stage before it that is not one.
    pub is_part: bool,
}

/// Tells stages apart, once that is asked for.
#[derive(Default)]
pub(crate) struct Stages(Mutex<Option<Running>>);

struct Running {
    clocks: Clocks,
    /// When the last stage ended, and the process's CPU time then.
    since: (Instant, u64),
    all: Vec<StageTime>,
}

/// Nanoseconds in milliseconds.
fn ms(nanoseconds: u64) -> f64 {
    nanoseconds as f64 * 1e-6
}

impl Running {
    /// Adds to a stage; frames of one picture have the same ones.
    fn add(&mut self, stage: StageTime) {
        let known = self.all.iter_mut().find(|known| known.name == stage.name);
        match known {
            Some(known) => {
                known.cpu_ms += stage.cpu_ms;
                known.wall_ms = known.wall_ms.zip(stage.wall_ms).map(|(a, b)| a + b);
            }
            None => self.all.push(stage),
        }
    }
}

impl Stages {
    fn running(&self) -> MutexGuard<'_, Option<Running>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins a frame whose stages are told.
    pub(crate) fn begin(&self, clocks: Clocks) {
        let since = (Instant::now(), (clocks.process)());
        *self.running() = Some(Running { clocks, since, all: Vec::new() });
    }

    /// Whether stages are told.
    pub(crate) fn are_told(&self) -> bool {
        self.running().is_some()
    }

    /// The clocks, where stages are told.
    pub(crate) fn clocks(&self) -> Option<Clocks> {
        self.running().as_ref().map(|running| running.clocks)
    }

    /// Ends a stage: all since the last one ended was it.
    pub(crate) fn end(&self, name: &str) {
        let mut running = self.running();
        let Some(running) = running.as_mut() else { return };
        let now = (Instant::now(), (running.clocks.process)());
        let (started, cpu) = std::mem::replace(&mut running.since, now);
        running.add(StageTime {
            name: name.to_owned(),
            clock: StageClock::Process,
            cpu_ms: ms(now.1.saturating_sub(cpu)),
            wall_ms: Some((now.0 - started).as_secs_f64() * 1e3),
            is_part: false,
        });
    }

    /// Says what threads took for a part of the stage that ended last.
    pub(crate) fn part(&self, name: &str, nanoseconds: u64) {
        if let Some(running) = self.running().as_mut() {
            running.add(StageTime {
                name: name.to_owned(),
                clock: StageClock::Threads,
                cpu_ms: ms(nanoseconds),
                wall_ms: None,
                is_part: true,
            });
        }
    }

    /// Ends the frame and returns its stages, in the order in which they began.
    pub(crate) fn take(&self) -> Vec<StageTime> {
        self.running().take().map_or_else(Vec::new, |running| running.all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};

    static NOW: AtomicU64 = AtomicU64::new(0);

    /// Three milliseconds from reading to reading.
    fn clock() -> u64 {
        NOW.fetch_add(3_000_000, Ordering::Relaxed)
    }

    #[test]
    fn stages_share_all_of_the_time_between_them() {
        let stages = Stages::default();
        stages.end("nobody asked");
        assert!(!stages.are_told() && stages.take().is_empty());
        stages.begin(Clocks { process: clock, thread: clock });
        for name in ["a", "b"] {
            stages.end(name);
        }
        stages.part("b: half", 1_500_000);
        stages.end("a");
        let all = stages.take();
        assert!(!stages.are_told());
        let told: Vec<_> = all.iter().map(|one| (one.name.as_str(), one.cpu_ms)).collect();
        assert_eq!(told, [("a", 6.0), ("b", 3.0), ("b: half", 1.5)]);
        assert!(all[2].is_part && all[2].clock == StageClock::Threads);
        assert!(all[2].wall_ms.is_none() && all[0].wall_ms.is_some());
    }
}
