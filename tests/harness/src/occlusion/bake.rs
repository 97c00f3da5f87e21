//! Runs the tool over a cloud and takes its column.

use crate::measure::cpu_seconds;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;
use surfelshop_ambient_occlusion::SurfelshopPackage;
use surfelshop_api::abi::host_side::{Fault, Plugin};
use surfelshop_api::job::{JobHost, RANGE};
use surfelshop_api::params::{Value, Values};
use surfelshop_api::tool::EditHeader;
use surfelshop_api::{CloudView, HostInfo, Result};

/// A host of jobs whose loops run on rayon's threads, the caller's pool where there is one.
#[derive(Default)]
pub struct Desk {
    /// The values of the last column that was staged.
    pub staged: Mutex<Vec<f32>>,
    /// Every message with the fraction it came with.
    pub messages: Mutex<Vec<(f64, String)>>,
    /// Ranges of loops that were handed out; the job is cancelled once there are `cancel_after`.
    pub ranges: AtomicUsize,
    /// See `ranges`; never where 0.
    pub cancel_after: usize,
    /// Set once the job was told that it is cancelled.
    pub cancelled: AtomicBool,
}

impl JobHost for Desk {
    fn progress(&self, fraction: f64, message: &str) {
        if !message.is_empty() {
            self.messages.lock().expect("no thread panics").push((fraction, message.to_owned()));
        }
    }

    fn cancelled(&self) -> bool {
        let cancelled =
            self.cancel_after > 0 && self.ranges.load(Ordering::Relaxed) >= self.cancel_after;
        self.cancelled.fetch_or(cancelled, Ordering::Relaxed);
        cancelled
    }

    fn stage(&self, _header: &EditHeader, values: &[&[u8]]) -> Result<()> {
        let floats = values.iter().flat_map(|bytes| bytes.as_chunks::<4>().0);
        *self.staged.lock().expect("no thread panics") =
            floats.map(|bytes| f32::from_le_bytes(*bytes)).collect();
        Ok(())
    }

    fn parallel(
        &self,
        count: usize,
        _share: Range<f64>,
        work: &(dyn Fn(Range<usize>) + Sync),
    ) -> bool {
        use rayon::prelude::*;
        (0..count.div_ceil(RANGE)).into_par_iter().all(|range| {
            self.ranges.fetch_add(1, Ordering::Relaxed);
            let start = range * RANGE;
            let goes_on = !self.cancelled();
            if goes_on {
                work(start..(start + RANGE).min(count));
            }
            goes_on
        })
    }
}

/// A column `ao` and what it cost.
#[derive(Clone, Debug)]
pub struct Baked {
    /// Accessibility of each surfel.
    pub ao: Vec<f32>,
    /// User and system time of all threads, seconds.
    pub cpu: f64,
    /// Elapsed time, seconds.
    pub wall: f64,
    /// The messages in their order.
    pub messages: Vec<String>,
}

/// Bakes with these settings.
///
/// # Errors
/// The tool's own.
///
/// # Panics
/// Never: no thread of the job panics with a lock in its hands.
pub fn bake(cloud: &CloudView<'_>, values: &Values) -> Result<Baked, Fault> {
    let desk = Desk::default();
    let mut tool = Plugin::of::<SurfelshopPackage>().create(0, &HostInfo::default())?;
    let (started, before) = (Instant::now(), cpu_seconds());
    tool.run(values, cloud, &desk)?;
    let (cpu, wall) = (cpu_seconds() - before, started.elapsed().as_secs_f64());
    let ao = desk.staged.into_inner().expect("no thread panics");
    let messages = desk.messages.into_inner().expect("no thread panics");
    Ok(Baked { ao, cpu, wall, messages: messages.into_iter().map(|(_, m)| m).collect() })
}

/// Settings from text such as `method=rays rays=64`.
///
/// # Panics
/// Where a word is no pair.
#[must_use]
pub fn values(text: &str) -> Values {
    let pair = |word: &str| {
        let (id, value) = word.split_once('=').expect("words like id=value");
        let value = match (value.parse::<i64>(), value.parse::<f64>(), value.parse::<bool>()) {
            (Ok(number), ..) => Value::Int(number),
            (_, Ok(number), _) => Value::Float(number),
            (.., Ok(flag)) => Value::Bool(flag),
            _ => Value::Text(value.to_owned()),
        };
        (id.to_owned(), value)
    };
    text.split_whitespace().map(pair).collect()
}
