//! How fast work goes, and so how long the rest will take.
//!
//! Shares that work tells of itself do not follow time: one step takes a tenth of its share, another ten times
//! of it. So only the last of what was seen counts, never the mean since the start.

use std::collections::VecDeque;
use std::time::Duration;

/// Before this, of the work or of a step of it, there is no estimate: the first steps of a tool, such as
/// building a tree, say little of the others. Nor does less than this tell a rate.
const LEAST_TIME: Duration = Duration::from_secs(1);
/// Nor is there one from a share smaller than this.
const LEAST_SHARE: f64 = 0.005;
/// The rate is that of the last of so many parts of the time since the start, and of at least [`LEAST_LOOK`]:
/// short enough to forget another kind of work, long enough that uneven work has a mean.
const PARTS: u32 = 4;
const LEAST_LOOK: Duration = Duration::from_secs(2);
/// Samples within that time, about.
const SAMPLES: u32 = 16;

/// When how much was done.
type RateWindow = (Duration, f64);

/// How fast work goes that is looked at now and then. Times are since its start.
#[derive(Clone, Debug)]
pub struct Pace {
    /// From the start of what counts on.
    seen: VecDeque<RateWindow>,
    /// Where the present step began, which is work of another kind than what was before.
    step: RateWindow,
    /// What the step before it took.
    step_before: Duration,
}

impl Default for Pace {
    /// Work that starts now.
    fn default() -> Self {
        Self {
            seen: [RateWindow::default()].into(),
            step: RateWindow::default(),
            step_before: Duration::ZERO,
        }
    }
}

impl Pace {
    /// Notes that a step begins, of which what was before tells nothing.
    pub fn begin_step(&mut self, at: Duration, fraction: f64) {
        self.step_before = at.saturating_sub(self.step.0);
        self.step = (at, fraction);
    }

    /// When the present step began, and what was done by then.
    #[cfg(test)]
    pub(super) fn step(&self) -> (Duration, f64) {
        self.step
    }

    /// The time left where the rest goes as fast as what was done of late; `None` where that is not known.
    pub fn left(&mut self, fraction: f64, at: Duration) -> Option<Duration> {
        let look = (at / PARTS).max(LEAST_LOOK);
        self.see(fraction, at, look);
        let oldest = *self.seen.front()?;
        let mut since = if self.step.0 > oldest.0 { self.step } else { oldest };
        if at.saturating_sub(since.0) < LEAST_TIME {
            // Steps that follow each other fast, such as one for each of many items, are of one kind.
            if self.step_before >= LEAST_TIME {
                return None;
            }
            since = oldest;
        }
        let (took, done) = (at.saturating_sub(since.0), fraction - since.1);
        if took < LEAST_TIME || done < LEAST_SHARE || fraction >= 1.0 {
            return None;
        }
        Duration::try_from_secs_f64(took.as_secs_f64() * (1.0 - fraction) / done).ok()
    }

    /// Takes a sample, and lets go of those that are older than what is looked at and not needed for a rate.
    fn see(&mut self, fraction: f64, at: Duration, look: Duration) {
        // Work that goes back begins again.
        if self.seen.back().is_some_and(|last| fraction < last.1) {
            self.seen.clear();
        }
        if self.seen.back().is_none_or(|last| at.saturating_sub(last.0) >= look / SAMPLES) {
            self.seen.push_back((at, fraction));
        }
        let will_do = |next: &RateWindow| {
            at.saturating_sub(next.0) >= look && fraction - next.1 >= LEAST_SHARE
        };
        while self.seen.get(1).is_some_and(will_do) {
            self.seen.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: f64 = 0.05;

    /// What is told every [`TICK`] of work whose share done is a function of seconds: seconds and seconds left.
    fn told(seconds: f64, share: impl Fn(f64) -> f64) -> Vec<(f64, Option<f64>)> {
        let mut pace = Pace::default();
        let ticks = (0..(seconds / TICK) as u32).map(|i| f64::from(i) * TICK);
        let mut left = |at: f64| {
            let left = pace.left(share(at), Duration::from_secs_f64(at));
            (at, left.map(|left| left.as_secs_f64()))
        };
        ticks.map(&mut left).collect()
    }

    /// Whether all that is told from `from` to `to` is within a share of the truth.
    fn is_right(told: &[(f64, Option<f64>)], [from, to]: [f64; 2], share: f64) {
        let end = told.len() as f64 * TICK;
        for (at, left) in told.iter().filter(|(at, _)| (from..to).contains(at)) {
            let left = left.unwrap_or_else(|| panic!("nothing is told at {at} s"));
            let truth = end - at;
            assert!((left / truth - 1.0).abs() < share, "at {at} s: {left} s, in truth {truth}");
        }
    }

    #[test]
    fn even_work_is_told_to_the_second() {
        for seconds in [10.0, 3600.0] {
            let told = told(seconds, |at| at / seconds);
            assert!(told.iter().all(|(at, left)| *at >= 1.0 || left.is_none()));
            is_right(&told, [(0.0051 * seconds).max(1.05), seconds], 1e-6);
        }
    }

    /// As ambient occlusion of 400,000 points: three fourths of the shares in 5 s, the rest in 23 s. By the mean
    /// since the start it took 2 s for what took 22.
    #[test]
    fn a_fast_beginning_is_forgotten() {
        let told = told(28.0, |at| if at < 5.0 { 0.15 * at } else { 0.75 + (at - 5.0) / 92.0 });
        is_right(&told, [7.3, 28.0], 0.02);
        // The other way round, in a longer run: a tenth in 100 s, the rest in 100 s.
        let told = self::told(200.0, |at| if at < 100.0 { 1e-3 * at } else { 9e-3 * at - 0.8 });
        is_right(&told, [134.0, 200.0], 0.02);
    }

    #[test]
    fn uneven_work_has_a_mean_and_rests_do_not_lose_it() {
        // Tells of itself every 5 s only, which is 2/7 of what is looked at after 70 s, and of its samples 1/16.
        let rough = told(200.0, |at| (at / 5.0).floor() * 0.025);
        is_right(&rough, [70.0, 160.0], 2.0 / 7.0 + 1.0 / 16.0 + 0.05);
        let waves = told(100.0, |at| at / 100.0 + 0.004 * at.sin());
        is_right(&waves, [20.0, 90.0], 0.2);
    }

    #[test]
    fn a_step_is_measured_by_itself_unless_steps_are_many() {
        let seconds = Duration::from_secs_f64;
        let mut pace = Pace::default();
        pace.begin_step(seconds(5.0), 0.61);
        assert_eq!(pace.left(0.6168, seconds(5.9)), None, "too little is known of the step");
        let left = pace.left(0.91, seconds(45.0)).unwrap().as_secs_f64();
        assert!((left - 12.0).abs() < 0.1, "{left}");
        // A message for each item: 20 s of even work.
        let mut pace = Pace::default();
        for i in 1..200 {
            let (at, done) = (f64::from(i) * 0.1, f64::from(i) / 200.0);
            pace.begin_step(seconds(at), done);
            let left = pace.left(done, seconds(at));
            if i > 10 {
                assert!((left.unwrap().as_secs_f64() - (20.0 - at)).abs() < 1e-6, "{i}: {left:?}");
            }
        }
    }

    #[test]
    fn what_is_kept_hardly_grows_and_work_may_begin_again() {
        let mut pace = Pace::default();
        for i in 0..1_000_000u32 {
            let at = Duration::from_millis(50) * i;
            // Rests for hours.
            let share = if i < 500_000 { f64::from(i) / 1e6 } else { 0.5 };
            pace.left(share, at);
            // With the logarithm of the time at most: 64 in the first 8 s, and 64 for each time e after that.
            assert!(pace.seen.len() < 700, "{i}: {}", pace.seen.len());
        }
        let (at, later) = (Duration::from_secs(50_001), Duration::from_secs(50_011));
        assert_eq!(pace.left(0.0, at), None);
        assert_eq!(pace.left(0.25, later), Some(Duration::from_secs(30)));
    }
}
