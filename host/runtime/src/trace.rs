//! Runs tracers: renderers that write pixels themselves, on any number of threads and without a
//! graphics device.
//!
//! A picture is the mean over its samples, each tile's added up in the order of their numbers, so
//! that it is the same on any number of threads. Sums are kept apart for even and odd samples: two
//! pictures that know nothing of each other, from which follows how far the whole is from its limit.
//!
//! Invariants: nobody waits for a tracer longer than its patience after it was asked to stop; a
//! tracer has all the time it needs while it works; one that fails ends the picture with its fault.

mod progressive;

pub use progressive::{TraceProgress, Tracing};

use crate::boundary::{Fault, Instance};
use crate::plugins::{LoadedUnit, Timeouts, on_own_thread};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};
use surfelshop_api::job::JobHost;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::tool::EditHeader;
use surfelshop_api::{Error, FrameRequest, HostInfo, Tile, Traced};
use surfelshop_cloud::Cloud;
use surfelshop_image::{SampleSums, TracedPicture};

/// Pixels along a tile.
const TILE: u32 = 32;

/// How often the caller is asked whether to go on.
const TICK: Duration = Duration::from_millis(50);

/// A picture to be traced.
#[derive(Clone, Debug)]
pub struct TraceOrder {
    /// The clouds in view; their columns are shared.
    pub clouds: Vec<Cloud>,
    /// View, scene, facts, parameters and environment.
    pub request: FrameRequest,
    /// Texels of the environment; see [`Traced::texels`].
    pub texels: Arc<[[f32; 3]]>,
    /// Samples of each pixel, at least 1.
    pub samples: u32,
    /// Threads; as many as the machine has where 0.
    pub threads: usize,
}

/// How many samples the parameters of a tracer ask for.
#[must_use]
pub fn samples_of(unit: &LoadedUnit, values: &Values) -> u32 {
    let declared = unit.description.params.iter().find(|declared| declared.id == "samples");
    match declared.map(|declared| declared.sanitise(values.get("samples"))) {
        Some(Value::Int(samples)) => u32::try_from(samples).unwrap_or(1).max(1),
        _ => 1,
    }
}

/// What all threads of a picture share.
struct Work {
    instance: Instance,
    order: TraceOrder,
    /// The next tile.
    next: AtomicUsize,
    stop: AtomicBool,
}

/// What a thread tells.
enum TraceEvent {
    Tile(Tile, SampleSums),
    Fault(Fault),
}

/// Longest side of a picture, as of most graphics devices.
const LONGEST_SIDE: u32 = 16384;

/// Most pixels: four pictures of 16 bytes a pixel are kept, which makes 4 GiB.
const MOST_PIXELS: u64 = 1 << 26;

fn check_size([width, height]: [u32; 2]) -> Result<(), Fault> {
    let sides = 1..=LONGEST_SIDE;
    let n_pixels = u64::from(width) * u64::from(height);
    if sides.contains(&width) && sides.contains(&height) && n_pixels <= MOST_PIXELS {
        return Ok(());
    }
    Err(Fault::Error(format!(
        "a picture of {width} x {height} was asked for; each side must be 1 to {LONGEST_SIDE}, and \
         width times height at most {MOST_PIXELS}"
    )))
}

/// Traces a picture on threads of its own. `goes_on` is asked again and again, with the share that is
/// done, whether to.
///
/// # Errors
/// Where the picture is empty or too large, the tracer fails, or was asked to stop: [`CANCELLED`](surfelshop_api::job::CANCELLED).
pub fn trace(
    unit: &LoadedUnit,
    order: TraceOrder,
    patience: &Timeouts,
    mut goes_on: impl FnMut(f64) -> bool,
) -> Result<TracedPicture, Fault> {
    check_size(order.request.view.size_px)?;
    let started = Instant::now();
    let version = env!("CARGO_PKG_VERSION").to_owned();
    let instance = unit.create(&HostInfo { host_version: version, ..HostInfo::default() })?;
    let (samples, [width, height]) = (order.samples.max(1), order.request.view.size_px);
    let n_tiles = (width.div_ceil(TILE) * height.div_ceil(TILE)) as usize;
    let available = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = if order.threads == 0 { available } else { order.threads };
    let (next, stop) = Default::default();
    let work = Arc::new(Work { instance, order, next, stop });
    let (tell, told) = mpsc::channel();
    for _ in 0..threads.min(n_tiles).max(1) {
        let (work, tell) = (work.clone(), tell.clone());
        on_own_thread(move || work.run(&tell))?;
    }
    drop(tell);
    let mut sums = SampleSums::new([width, height]);
    let (mut done, mut asked_to_stop) = (0usize, None::<Instant>);
    let mut fault = None;
    loop {
        match told.recv_timeout(TICK) {
            Ok(TraceEvent::Tile(tile, part)) => {
                sums.put(tile, &part);
                done += 1;
            }
            Ok(TraceEvent::Fault(found)) => fault = fault.or(Some(found)),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        let wanted = goes_on(done as f64 / n_tiles.max(1) as f64) && fault.is_none();
        if !wanted {
            work.stop.store(true, Ordering::Relaxed);
            let since = *asked_to_stop.get_or_insert_with(Instant::now);
            if since.elapsed() > patience.cancel {
                return Err(Fault::TimedOut(patience.cancel));
            }
        }
    }
    match fault {
        Some(fault) => Err(fault),
        None if done < n_tiles => Err(Fault::Error(surfelshop_api::job::CANCELLED.to_owned())),
        None => Ok(sums.picture(samples, started.elapsed())),
    }
}

impl Work {
    /// Fills tiles until there are none left.
    fn run(&self, tell: &mpsc::Sender<TraceEvent>) {
        let views: Vec<_> = self.order.clouds.iter().map(Cloud::view).collect();
        let scene = Traced { clouds: &views, texels: &self.order.texels };
        let [width, height] = self.order.request.view.size_px;
        let across = width.div_ceil(TILE);
        loop {
            let index = self.next.fetch_add(1, Ordering::Relaxed) as u32;
            let (x, y) = (index % across.max(1) * TILE, index / across.max(1) * TILE);
            if y >= height || x >= width || self.stop.load(Ordering::Relaxed) {
                return;
            }
            let size = [TILE.min(width - x), TILE.min(height - y)];
            let tile = Tile { x, y, width: size[0], height: size[1], sample: 0 };
            let mut part = SampleSums::new(size);
            let mut pixels = vec![0.0; 4 * (size[0] * size[1]) as usize];
            for sample in 0..self.order.samples.max(1) {
                if self.stop.load(Ordering::Relaxed) {
                    return;
                }
                let tile = Tile { sample, ..tile };
                let request = &self.order.request;
                if let Err(fault) = self.instance.tile(request, &scene, tile, &mut pixels, self) {
                    // A tracer that was stopped says so; that is no fault.
                    if !self.stop.load(Ordering::Relaxed) {
                        drop(tell.send(TraceEvent::Fault(fault)));
                    }
                    return;
                }
                part.add(sample, &pixels);
            }
            if tell.send(TraceEvent::Tile(tile, part)).is_err() {
                return;
            }
        }
    }
}

impl JobHost for Work {
    fn progress(&self, _fraction: f64, _message: &str) {}

    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn stage(&self, _header: &EditHeader, _values: &[&[u8]]) -> surfelshop_api::Result<()> {
        Err(Error::new("a tracer stages no edits"))
    }
}
