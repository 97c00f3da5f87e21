//! How far a tool is, told from any thread and asked from any other.

use super::pace::Pace;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// How far a run is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Progress {
    /// The share done, in [0, 1].
    pub fraction: f64,
    /// What is being done, on one line; empty where the tool did not say.
    pub message: String,
    /// Time since the start.
    pub elapsed: Duration,
    /// Time until the end, as the share done of late tells; `None` at the beginning and end.
    pub left: Option<Duration>,
}

/// Characters of a message that are kept: a motion's six numbers with all digits, and words around them.
const MESSAGE: usize = 400;

/// What the tool's threads and the host's share.
pub(super) struct Shared {
    started: Instant,
    begun: AtomicBool,
    /// Time from the start to the end.
    took: OnceLock<Duration>,
    cancelled: AtomicBool,
    /// The bits of the share done, which are in the order of the numbers: none is negative.
    fraction: AtomicU64,
    message: Mutex<String>,
    /// How fast it goes; a message that is another begins a step.
    pace: Mutex<Pace>,
    /// What the tool said when it was done.
    conclusion: Mutex<String>,
    device: OnceLock<String>,
}

impl Shared {
    pub(super) fn new() -> Self {
        Self {
            started: Instant::now(),
            begun: AtomicBool::new(false),
            took: OnceLock::new(),
            cancelled: AtomicBool::new(false),
            fraction: AtomicU64::new(0),
            message: Mutex::default(),
            pace: Mutex::default(),
            conclusion: Mutex::default(),
            device: OnceLock::new(),
        }
    }

    pub(super) fn elapsed(&self) -> Duration {
        self.started.elapsed()
    }

    /// Notes that the instance is made.
    pub(super) fn begin(&self) {
        self.begun.store(true, Ordering::Relaxed);
    }

    /// Notes that the tool has returned.
    pub(super) fn end(&self) {
        // It returns once.
        let _once = self.took.set(self.elapsed());
    }

    /// Time from the start to the end; until now where there was none yet.
    pub(super) fn took(&self) -> Duration {
        self.took.get().copied().unwrap_or_else(|| self.elapsed())
    }

    pub(super) fn has_begun(&self) -> bool {
        self.begun.load(Ordering::Relaxed)
    }

    pub(super) fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    pub(super) fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// Takes the share done; what is no number is passed over.
    pub(super) fn set(&self, fraction: f64) {
        if !fraction.is_nan() {
            self.fraction.store(fraction.clamp(0.0, 1.0).abs().to_bits(), Ordering::Relaxed);
        }
    }

    /// Takes the share done by one of several threads, which may be told late.
    pub(super) fn raise(&self, fraction: f64) {
        if !fraction.is_nan() {
            self.fraction.fetch_max(fraction.clamp(0.0, 1.0).abs().to_bits(), Ordering::Relaxed);
        }
    }

    /// Takes what is being done, or at the end what was; an empty text leaves what was said before.
    pub(super) fn say(&self, fraction: f64, message: &str) {
        if message.trim().is_empty() {
            return;
        }
        let words = message.split_whitespace().collect::<Vec<_>>().join(" ");
        let line: String = words.chars().filter(|c| !c.is_control()).take(MESSAGE).collect();
        // Texts are only ever put there whole.
        if fraction >= 1.0 {
            self.conclusion.lock().unwrap_or_else(PoisonError::into_inner).clone_from(&line);
        }
        let mut message = self.message.lock().unwrap_or_else(PoisonError::into_inner);
        if *message != line {
            self.pace().begin_step(self.elapsed(), fraction.clamp(0.0, 1.0));
            *message = line;
        }
    }

    /// What the tool said when it was done; empty where it said nothing.
    pub(super) fn conclusion(&self) -> String {
        self.conclusion.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    pub(super) fn set_device(&self, description: String) {
        // Only the first device counts; there is no other.
        drop(self.device.set(description));
    }

    pub(super) fn device(&self) -> Option<String> {
        self.device.get().cloned()
    }

    pub(super) fn progress(&self) -> Progress {
        let fraction = f64::from_bits(self.fraction.load(Ordering::Relaxed));
        let message = self.message.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let elapsed = self.elapsed();
        let left = self.pace().left(fraction, elapsed);
        Progress { fraction, message, elapsed, left }
    }

    fn pace(&self) -> MutexGuard<'_, Pace> {
        // A pace is never left half changed.
        self.pace.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_left_follows_from_the_share_done() {
        let seconds = Duration::from_secs;
        let left = |fraction, at| Pace::default().left(fraction, at);
        assert_eq!(left(0.25, seconds(10)), Some(seconds(30)));
        assert_eq!(left(0.5, Duration::from_millis(900)), None);
        assert_eq!((left(0.0, seconds(10)), left(1.0, seconds(10))), (None, None));
    }

    #[test]
    fn a_step_begins_where_its_message_comes_first() {
        let shared = Shared::new();
        let begun = || shared.pace().step().1;
        shared.say(0.25, "sorting");
        shared.say(0.5, "sorting");
        assert!((begun() - 0.25).abs() < f64::EPSILON);
        shared.say(0.5, "tracing");
        shared.say(0.75, "");
        assert!((begun() - 0.5).abs() < f64::EPSILON);
    }

    #[test]
    fn shares_stay_in_range_and_late_ones_do_not_go_back() {
        let shared = Shared::new();
        shared.set(f64::NAN);
        assert_eq!(shared.progress().fraction.to_bits(), 0);
        shared.raise(0.5);
        shared.raise(0.25);
        assert!((shared.progress().fraction - 0.5).abs() < f64::EPSILON);
        shared.set(-3.0);
        assert_eq!(shared.progress().fraction.to_bits(), 0);
        shared.set(f64::INFINITY);
        assert!((shared.progress().fraction - 1.0).abs() < f64::EPSILON);
    }

    #[test]
    fn messages_are_one_line_and_stay_until_the_next() {
        let shared = Shared::new();
        shared.say(0.5, "tracing\n\trays\u{1b}[2J");
        shared.say(0.5, " ");
        assert_eq!(shared.progress().message, "tracing rays[2J");
    }
}
