//! A picture that is traced in the background, sample by sample, and can be looked at before it is done.
//!
//! Each tile takes its samples in their order, so that the last picture is the one that [`trace`](super::trace)
//! makes. All tiles take one before any takes the next but for those that are still at work.

use super::{TILE, TraceOrder, check_size};
use crate::boundary::{Fault, Instance};
use crate::plugins::{LoadedUnit, on_own_thread};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};
use surfelshop_api::job::JobHost;
use surfelshop_api::tool::EditHeader;
use surfelshop_api::{Error, HostInfo, Tile, Traced};
use surfelshop_cloud::Cloud;
use surfelshop_image::{Image, SampleSums, TracedPicture};

/// Time between two notices that there is more to see.
const NOTICE: Duration = Duration::from_millis(250);

/// A picture that is being traced; dropping it stops that.
pub struct Tracing {
    work: Arc<TracingWork>,
    stopped: Option<Instant>,
}

/// How far a picture is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceProgress {
    /// The share that is done, 0 to 1.
    pub fraction: f64,
    /// Samples that every pixel has.
    pub samples: u32,
    /// Samples that every pixel will have.
    pub of: u32,
}

/// A tile of the picture.
struct TileWork {
    tile: Tile,
    /// Held while a sample is computed: samples of a tile come one after the other.
    turn: Mutex<()>,
    sums: Mutex<(u32, SampleSums)>,
}

/// What all threads share.
struct TracingWork {
    order: TraceOrder,
    instance: OnceLock<Instance>,
    tiles: Vec<TileWork>,
    /// The next sample of the next tile.
    next: AtomicUsize,
    n_done: AtomicUsize,
    n_threads: AtomicUsize,
    stop: AtomicBool,
    fault: Mutex<Option<Fault>>,
    started: Instant,
    noticed: Mutex<Instant>,
    notice: Box<dyn Fn() + Send + Sync>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Tracing {
    /// Starts to trace on threads of its own. `notice` is called, by any of them, when there is more to see, a few
    /// times a second, and when all is done.
    ///
    /// # Errors
    /// Where the picture is empty or too large, or no thread can be started.
    pub fn start(
        unit: &LoadedUnit,
        order: TraceOrder,
        notice: impl Fn() + Send + Sync + 'static,
    ) -> Result<Self, Fault> {
        let [width, height] = order.request.view.size_px;
        check_size([width, height])?;
        let available = std::thread::available_parallelism().map_or(1, usize::from);
        let n_threads = if order.threads == 0 { available } else { order.threads };
        let across = width.div_ceil(TILE);
        let tile = |i: u32| {
            let (x, y) = (i % across * TILE, i / across * TILE);
            let size = [TILE.min(width - x), TILE.min(height - y)];
            TileWork {
                tile: Tile { x, y, width: size[0], height: size[1], sample: 0 },
                turn: Mutex::new(()),
                sums: Mutex::new((0, SampleSums::new(size))),
            }
        };
        let tiles: Vec<TileWork> = (0..across * height.div_ceil(TILE)).map(tile).collect();
        let now = Instant::now();
        let work = Arc::new(TracingWork {
            order,
            instance: OnceLock::new(),
            tiles,
            next: AtomicUsize::new(0),
            n_done: AtomicUsize::new(0),
            n_threads: AtomicUsize::new(1),
            stop: AtomicBool::new(false),
            fault: Mutex::new(None),
            started: now,
            noticed: Mutex::new(now),
            notice: Box::new(notice),
        });
        let (first, unit) = (work.clone(), unit.clone());
        on_own_thread(move || first.begin(&unit, n_threads))?;
        Ok(Self { work, stopped: None })
    }

    /// Asks it to stop; returns when that was asked for first.
    pub fn stop(&mut self) -> Instant {
        self.work.stop.store(true, Ordering::Relaxed);
        *self.stopped.get_or_insert_with(Instant::now)
    }

    /// Whether no thread works on it any more.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.work.n_threads.load(Ordering::Acquire) == 0
    }

    /// How far it is.
    #[must_use]
    pub fn progress(&self) -> TraceProgress {
        let (n, n_tiles) = (self.work.n_done.load(Ordering::Acquire), self.work.tiles.len());
        let of = self.work.order.samples.max(1);
        let samples = self.work.tiles.iter().map(|tile| lock(&tile.sums).0).min().unwrap_or(0);
        TraceProgress { fraction: n as f64 / (n_tiles * of as usize).max(1) as f64, samples, of }
    }

    /// Why it ended before it was done, taken out.
    #[must_use]
    pub fn take_fault(&self) -> Option<Fault> {
        lock(&self.work.fault).take()
    }

    /// Puts what is traced so far over a picture of the same size, four values a pixel: radiance and straight
    /// coverage. Tiles without a sample stay as they are.
    pub fn put_over(&self, picture: &mut Image) {
        let width = picture.width as usize;
        for TileWork { tile, sums, .. } in &self.work.tiles {
            let (n, color) = {
                let sums = lock(sums);
                (sums.0, sums.1.color(sums.0))
            };
            if n == 0 {
                continue;
            }
            let rows = color.data.chunks_exact(4 * tile.width as usize);
            for (row, values) in rows.enumerate() {
                let start = 4 * ((tile.y as usize + row) * width + tile.x as usize);
                if let Some(place) = picture.data.get_mut(start..start + values.len()) {
                    place.copy_from_slice(values);
                }
            }
        }
    }

    /// The picture, once all of it is traced.
    #[must_use]
    pub fn picture(&self) -> Option<TracedPicture> {
        let of = self.work.order.samples.max(1);
        let mut sums = SampleSums::new(self.work.order.request.view.size_px);
        for TileWork { tile, sums: part, .. } in &self.work.tiles {
            let part = lock(part);
            if part.0 < of {
                return None;
            }
            sums.put(*tile, &part.1);
        }
        Some(sums.picture(of, self.work.started.elapsed()))
    }
}

impl Drop for Tracing {
    fn drop(&mut self) {
        self.stop();
    }
}

/// Counts a thread while it works, and gives notice when the last one ends.
struct Working(Arc<TracingWork>);

impl Drop for Working {
    fn drop(&mut self) {
        if self.0.n_threads.fetch_sub(1, Ordering::AcqRel) == 1 {
            (self.0.notice)();
        }
    }
}

impl TracingWork {
    /// Makes the tracer's instance, which may take long, starts the other threads and works with them.
    fn begin(self: Arc<Self>, unit: &LoadedUnit, n_threads: usize) {
        let _working = Working(self.clone());
        let version = env!("CARGO_PKG_VERSION").to_owned();
        match unit.create(&HostInfo { host_version: version, ..HostInfo::default() }) {
            Ok(instance) => drop(self.instance.set(instance)),
            Err(fault) => return self.fail(fault),
        }
        for _ in 1..n_threads.min(self.tiles.len()) {
            self.n_threads.fetch_add(1, Ordering::AcqRel);
            let working = Working(self.clone());
            // Where there is no further thread, fewer do.
            if on_own_thread(move || working.0.trace()).is_err() {
                break;
            }
        }
        self.trace();
    }

    fn fail(&self, fault: Fault) {
        // A tracer that was stopped says so; that is no fault.
        if !self.stop.swap(true, Ordering::Relaxed) {
            *lock(&self.fault) = Some(fault);
        }
    }

    /// Traces samples of tiles until there are none left.
    fn trace(&self) {
        let Some(instance) = self.instance.get() else { return };
        let views: Vec<_> = self.order.clouds.iter().map(Cloud::view).collect();
        let scene = Traced { clouds: &views, texels: &self.order.texels };
        let n_all = self.tiles.len() * self.order.samples.max(1) as usize;
        let mut pixels = Vec::new();
        loop {
            let index = self.next.fetch_add(1, Ordering::Relaxed);
            if index >= n_all || self.stop.load(Ordering::Relaxed) {
                return;
            }
            let TileWork { tile, turn, sums } = &self.tiles[index % self.tiles.len()];
            let _turn = lock(turn);
            let sample = lock(sums).0;
            let tile = Tile { sample, ..*tile };
            pixels.clear();
            pixels.resize(4 * (tile.width * tile.height) as usize, 0.0);
            if let Err(fault) = instance.tile(&self.order.request, &scene, tile, &mut pixels, self)
            {
                return self.fail(fault);
            }
            let mut sums = lock(sums);
            sums.1.add(sample, &pixels);
            sums.0 += 1;
            drop(sums);
            self.n_done.fetch_add(1, Ordering::AcqRel);
            self.tell();
        }
    }

    /// Gives notice, if that was some time ago.
    fn tell(&self) {
        let is_due = {
            let mut noticed = lock(&self.noticed);
            let is_due = noticed.elapsed() >= NOTICE;
            if is_due {
                *noticed = Instant::now();
            }
            is_due
        };
        if is_due {
            (self.notice)();
        }
    }
}

impl JobHost for TracingWork {
    fn progress(&self, _fraction: f64, _message: &str) {}

    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn stage(&self, _header: &EditHeader, _values: &[&[u8]]) -> surfelshop_api::Result<()> {
        Err(Error::new("a tracer stages no edits"))
    }
}
