//! Processor time.

use std::time::Duration;
use surfelshop_render::Clocks;

/// The CPU time of the program so far, of all its threads, where the system tells.
pub fn cpu_time() -> Option<Duration> {
    #[cfg(unix)]
    {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        let seconds = u64::try_from(time.tv_sec).ok()?;
        Some(Duration::new(seconds, u32::try_from(time.tv_nsec).ok()?))
    }
    #[cfg(not(unix))]
    None
}

/// Clocks of CPU time in nanoseconds, where the system tells.
pub fn clocks() -> Option<Clocks> {
    #[cfg(unix)]
    {
        use rustix::time::{ClockId, clock_gettime};
        fn nanoseconds(clock: ClockId) -> u64 {
            let time = clock_gettime(clock);
            #[allow(clippy::unnecessary_cast, reason = "on some systems they are narrower")]
            let [seconds, rest] = [time.tv_sec, time.tv_nsec].map(|part| part as i64);
            u64::try_from(1_000_000_000 * seconds + rest).unwrap_or(0)
        }
        Some(Clocks {
            process: || nanoseconds(ClockId::ProcessCPUTime),
            thread: || nanoseconds(ClockId::ThreadCPUTime),
        })
    }
    #[cfg(not(unix))]
    None
}

/// Milliseconds of CPU time since an earlier reading.
pub fn cpu_ms_since(then: Option<Duration>) -> Option<f64> {
    let (now, then) = (cpu_time()?, then?);
    Some(now.saturating_sub(then).as_secs_f64() * 1e3)
}
