//! Large clouds on their way to where they are drawn: their surfels are put in order on a thread of their
//! own, and until that is done a few of them stand for all.

use super::darkroom::{Order, Queue, Task};
use crate::clouds::Clouds;
use anyhow::Context as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use surfelshop_api::columns::{RADIUS, TANGENT_U, TANGENT_V};
use surfelshop_cloud::{Buffer, Cloud, CloudError, Column, Loaded};
use surfelshop_engine::{Engine, Supplier, Supply};

/// Clouds of fewer surfels are in order in a tenth of a second.
pub(super) const LARGE: usize = 1_000_000;

/// About so many surfels stand for all.
const FEW: usize = 200_000;

/// A large cloud and what stands for it.
struct Coarse {
    whole: Cloud,
    few: Cloud,
}

/// Clouds whose surfels are put in order, one after the other.
#[derive(Default)]
pub(super) struct Arriving {
    /// Those that were shown so far and are not there yet.
    coarse: Vec<Coarse>,
    /// The one at work, by the generations of its columns.
    at_work: Option<Vec<u64>>,
    /// Tells its thread to stop at the next question.
    stop: Arc<AtomicBool>,
    /// Counts the threads: what an earlier one says is not meant any more.
    serial: u64,
    /// Clouds that could not be brought beside the window: the next picture says why.
    refused: Vec<Vec<u64>>,
}

/// What came of it.
pub(crate) struct Arrived {
    serial: u64,
    supply: Result<Supply, String>,
}

/// What tells a cloud, as it is drawn, from another.
fn key(cloud: &Cloud) -> Vec<u64> {
    cloud.columns().iter().map(Column::generation).collect()
}

impl Arriving {
    /// An order for a few surfels in place of one for clouds of which the engine lacks large ones, and
    /// how many of all surfels each of those stands for; `None` where all can be drawn at once.
    pub(super) fn order(
        &mut self,
        order: &Order,
        engine: &Engine,
    ) -> Result<Option<(Order, u32)>, CloudError> {
        let is_missing = |cloud: &Cloud| {
            let refused = || self.refused.contains(&key(cloud));
            cloud.len() >= LARGE && !engine.holds(&[cloud.view()]) && !refused()
        };
        let missing: Vec<Cloud> = (order.clouds.loaded.iter())
            .map(|loaded| &loaded.cloud)
            .filter(|cloud| is_missing(cloud))
            .cloned()
            .collect();
        let missing_now = |key_of: &Vec<u64>| missing.iter().any(|cloud| key(cloud) == *key_of);
        self.coarse.retain(|coarse| missing_now(&key(&coarse.whole)));
        if self.at_work.as_ref().is_some_and(|at_work| !missing_now(at_work)) {
            self.let_go();
        }
        if missing.is_empty() {
            return Ok(None);
        }
        let mut stride = 1;
        let mut loaded = order.clouds.loaded.clone();
        for Loaded { cloud, .. } in &mut loaded {
            if !missing_now(&key(cloud)) {
                continue;
            }
            stride = stride.max(stride_of(cloud));
            let known = self.coarse.iter().find(|known| key(&known.whole) == key(cloud));
            let few = match known {
                Some(known) => known.few.clone(),
                None => {
                    let few = few(cloud)?;
                    self.coarse.push(Coarse { whole: cloud.clone(), few: few.clone() });
                    few
                }
            };
            *cloud = few;
        }
        // What is known of all stays what it is of the whole.
        let clouds = Arc::new(Clouds { loaded, facts: order.clouds.facts.clone() });
        let mut few = Order { clouds, ..order.clone() };
        few.detail.stride = 1;
        Ok(Some((few, u32::try_from(stride).unwrap_or(u32::MAX))))
    }

    /// Puts the next cloud in order, unless one is at work.
    pub(super) fn go_on(&mut self, engine: &Engine, queue: &Queue) -> anyhow::Result<()> {
        if self.at_work.is_some() {
            return Ok(());
        }
        let Some(coarse) = self.coarse.first() else { return Ok(()) };
        self.serial += 1;
        self.stop = Arc::default();
        self.at_work = Some(key(&coarse.whole));
        let work = Work {
            supplier: engine.supplier(),
            cloud: coarse.whole.clone(),
            queue: queue.clone(),
            serial: self.serial,
            stop: self.stop.clone(),
        };
        let started = std::thread::Builder::new().name("arriving".to_owned()).spawn(|| work.run());
        if let Err(error) = started {
            self.refused.extend(self.at_work.take());
            return Err(error).context("the surfels cannot be put in order beside the window");
        }
        Ok(())
    }

    /// Whether something is on its way.
    pub(super) fn is_at_work(&self) -> bool {
        self.at_work.is_some()
    }

    /// Whether a thread's words are of what is on its way now.
    pub(super) fn is_meant(&self, serial: u64) -> bool {
        self.is_at_work() && serial == self.serial
    }

    /// Takes what has come, for the engine; nothing of an earlier thread.
    pub(super) fn take(&mut self, arrived: Arrived) -> Option<Supply> {
        if !self.is_meant(arrived.serial) {
            return None;
        }
        let at_work = self.at_work.take()?;
        self.coarse.retain(|coarse| key(&coarse.whole) != at_work);
        match arrived.supply {
            Ok(supply) => Some(supply),
            Err(reason) => {
                tracing::debug!("a cloud is drawn without having been put in order: {reason}");
                self.refused.push(at_work);
                None
            }
        }
    }

    /// Wants nothing of it any more.
    pub(super) fn let_go(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.at_work = None;
    }
}

impl Drop for Arriving {
    fn drop(&mut self) {
        if self.is_at_work() {
            // Its thread is left behind.
            super::darkroom::abandon();
        }
        self.let_go();
    }
}

/// A thread's work.
struct Work {
    supplier: Supplier,
    cloud: Cloud,
    queue: Queue,
    serial: u64,
    stop: Arc<AtomicBool>,
}

impl Work {
    fn run(self) {
        let Self { supplier, cloud, queue, serial, stop } = self;
        let tell = |fraction| {
            queue.add(Task::Arriving(serial, fraction));
            !stop.load(Ordering::Relaxed)
        };
        // Threads of its own: those that all share draw pictures and look up surfels meanwhile, and
        // whoever waits for one of them would wait for all of this.
        let n_threads = rayon::current_num_threads().saturating_sub(1).max(1);
        let supply = match rayon::ThreadPoolBuilder::new().num_threads(n_threads).build() {
            Ok(pool) => pool.install(|| supplier.supply(&[cloud.view()], &tell)),
            Err(_none) => supplier.supply(&[cloud.view()], &tell),
        };
        let supply = supply.map_err(|error| error.to_string());
        queue.add(Task::Arrived(Box::new(Arrived { serial, supply })));
    }
}

fn stride_of(cloud: &Cloud) -> usize {
    cloud.len().div_ceil(FEW)
}

/// One of each so many surfels of a cloud, and so much larger that they cover as much.
fn few(cloud: &Cloud) -> Result<Cloud, CloudError> {
    let stride = stride_of(cloud);
    // Another one of each run: scans have rows, of which every so-manieth would leave columns alone.
    let chosen = |run: usize| run * stride + (run.wrapping_mul(0x9E37_79B9) >> 7) % stride;
    let mask: Vec<bool> = (0..cloud.len()).map(|i| chosen(i / stride) == i).collect();
    let few = cloud.keep(&mask)?;
    let factor = (stride as f32).sqrt();
    let larger = [RADIUS, TANGENT_U, TANGENT_V].into_iter().filter_map(|name| {
        let column = few.column(name)?;
        let Buffer::F32(values) = column.values() else { return None };
        let values = values.iter().map(|value| value * factor).collect();
        Some(Column::new(name, column.components(), Buffer::F32(values)))
    });
    few.with_columns(larger.collect())
}
