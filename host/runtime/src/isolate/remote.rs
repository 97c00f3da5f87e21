//! The host as a library sees it from a process of its own: what it asks for goes to the program.

use super::clouds::{CloudHead, bytes};
use super::message::{Ask, CUT, Reply};
use super::process::leave_with_all;
use super::wire::{Message, Part, Wire};
use crate::plugins::leave;
use rayon::prelude::*;
use std::convert::Infallible;
use std::io;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::columns::Values;
use surfelshop_api::format::{CloudHeader, CloudSinkHost, CloudSourceHost, FileHost};
use surfelshop_api::job::{JobHost, RANGE};
use surfelshop_api::tool::EditHeader;
use surfelshop_api::{CloudView, Error, Result};

/// As much as the thread of a call has; plugins may count on it.
const STACK_BYTES: usize = 8 << 20;
/// How old the answer may be whether to stop, and how often progress is told: a question takes some 20 µs.
const PULSE: Duration = Duration::from_millis(5);

/// Nobody but the system ends the wait for the program.
pub(super) fn forever() -> std::result::Result<(), Infallible> {
    Ok(())
}

/// The program at the other end.
pub(super) struct Program {
    wire: Mutex<Wire>,
    is_cancelled: AtomicBool,
    asked: Mutex<Option<Instant>>,
    told: Mutex<Option<Instant>>,
    pool: OnceLock<Option<rayon::ThreadPool>>,
}

/// Whether this is due again, and if so that it was done now.
fn is_due(last: &Mutex<Option<Instant>>) -> bool {
    let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
    let is_due = last.is_none_or(|last| last.elapsed() >= PULSE);
    if is_due {
        *last = Some(Instant::now());
    }
    is_due
}

impl Program {
    pub(super) fn new(wire: Wire) -> Self {
        let (asked, told) = Default::default();
        let (is_cancelled, pool) = Default::default();
        Self { wire: Mutex::new(wire), is_cancelled, asked, told, pool }
    }

    fn wire(&self) -> std::sync::MutexGuard<'_, Wire> {
        self.wire.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The next order; ends the process where there will be none.
    pub(super) fn order(&self) -> Message {
        self.is_cancelled.store(false, Ordering::Relaxed);
        self.wire().receive(&mut forever).unwrap_or_else(|_gone| leave_with_all())
    }

    /// Tells something that nobody answers.
    pub(super) fn tell(&self, ask: &Ask, parts: &[&[u8]]) {
        if self.wire().send(ask, parts, &mut forever).is_err() {
            leave(CUT);
        }
    }

    /// Asks for something; ends the process where there will be no answer.
    fn ask(&self, ask: &Ask, parts: &[&[u8]]) -> Result<(Reply, Vec<Part>)> {
        let mut wire = self.wire();
        let received = wire
            .send(ask, parts, &mut forever)
            .and_then(|()| wire.receive(&mut forever))
            .and_then(|message| Ok((message.head::<Reply, Infallible>()?, message.parts)));
        match received.unwrap_or_else(|_gone| leave(CUT)) {
            (Reply::Refused(line), _) => Err(Error::new(line)),
            answered => Ok(answered),
        }
    }

    fn done(&self, ask: &Ask, parts: &[&[u8]]) -> Result<()> {
        self.ask(ask, parts).map(|_done| ())
    }

    fn pool(&self) -> Option<&rayon::ThreadPool> {
        let made = self.pool.get_or_init(|| {
            let builder = rayon::ThreadPoolBuilder::new().stack_size(STACK_BYTES);
            builder.thread_name(|i| format!("plugin loop {i}")).build().ok()
        });
        made.as_ref()
    }

    fn raise(&self, fraction: f64) {
        if is_due(&self.told) {
            self.tell(&Ask::Progress(fraction), &[b""]);
        }
    }
}

impl JobHost for Program {
    fn progress(&self, fraction: f64, message: &str) {
        if message.is_empty() {
            self.raise(fraction);
        } else {
            self.tell(&Ask::Progress(fraction), &[message.as_bytes()]);
        }
    }

    fn cancelled(&self) -> bool {
        if !self.is_cancelled.load(Ordering::Relaxed)
            && is_due(&self.asked)
            && let Ok((Reply::Is(true), _)) = self.ask(&Ask::Cancelled, &[])
        {
            self.is_cancelled.store(true, Ordering::Relaxed);
        }
        self.is_cancelled.load(Ordering::Relaxed)
    }

    fn stage(&self, header: &EditHeader, values: &[&[u8]]) -> Result<()> {
        let header = encoded(header)?;
        self.done(&Ask::Stage, &[&[&header[..]], values].concat())
    }

    fn parallel(
        &self,
        count: usize,
        share: Range<f64>,
        work: &(dyn Fn(Range<usize>) + Sync),
    ) -> bool {
        // Few items are large ones, such as the parts of a file.
        let size = if count < RANGE * RANGE { 1 } else { RANGE };
        let (n_done, all) = (AtomicUsize::new(0), AtomicBool::new(true));
        let one = |i: usize| {
            if self.cancelled() {
                all.store(false, Ordering::Relaxed);
                return;
            }
            let range = i * size..((i + 1) * size).min(count);
            let len = range.len();
            work(range);
            let n_done = n_done.fetch_add(len, Ordering::Relaxed) + len;
            if share.end > share.start {
                self.raise(share.start + (share.end - share.start) * n_done as f64 / count as f64);
            }
        };
        let n_ranges = count.div_ceil(size);
        match self.pool() {
            Some(pool) => pool.install(|| (0..n_ranges).into_par_iter().for_each(one)),
            None => (0..n_ranges).for_each(one),
        }
        all.into_inner()
    }

    fn compute(&self, graph: &EncodedGraph, buffers: &[u32]) -> Result<Vec<Vec<u8>>> {
        let ask = Ask::Compute(buffers.to_vec());
        let (_done, parts) = self.ask(&ask, &[&graph.structure, &graph.data])?;
        Ok(parts.iter().map(|part| part.bytes().to_vec()).collect())
    }
}

fn encoded(value: &impl serde::Serialize) -> Result<Vec<u8>> {
    rmp_serde::to_vec_named(value).map_err(|error| Error::new(error.to_string()))
}

fn in_words(error: &Error) -> io::Error {
    io::Error::other(error.message().to_owned())
}

impl FileHost for Program {
    fn length(&self) -> u64 {
        match self.ask(&Ask::Length, &[]) {
            Ok((Reply::Count(length), _)) => length,
            _ => 0,
        }
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        let ask = Ask::ReadAt(offset, buffer.len() as u64);
        let (_found, parts) = self.ask(&ask, &[]).map_err(|error| in_words(&error))?;
        let found = parts.first().map_or(&[][..], Part::bytes);
        let n = found.len().min(buffer.len());
        buffer[..n].copy_from_slice(&found[..n]);
        Ok(n)
    }

    fn write_at(&self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        self.done(&Ask::WriteAt(offset), &[bytes]).map_err(|error| in_words(&error))
    }
}

/// Where a format puts its clouds.
pub(super) struct RemoteSink<'a>(pub(super) &'a Program);

impl CloudSinkHost for RemoteSink<'_> {
    fn begin(&mut self, header: &CloudHeader) -> Result<bool> {
        let (reply, _) = self.0.ask(&Ask::Begin, &[&encoded(header)?])?;
        Ok(matches!(reply, Reply::Is(true)))
    }

    fn batch(&mut self, values: &[Values<'_>]) -> Result<()> {
        let columns: Vec<&[u8]> = values.iter().map(bytes).collect();
        self.0.done(&Ask::Batch, &columns)
    }

    fn faces(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        self.0.done(&Ask::Faces, &[bytemuck::cast_slice(triangles)])
    }

    fn warn(&mut self, line: &str) {
        self.0.tell(&Ask::Warn, &[line.as_bytes()]);
    }
}

/// Where a format takes the clouds that it writes.
pub(super) struct RemoteSource<'a> {
    pub(super) program: &'a Program,
    /// The points that were handed over last.
    pub(super) last: Option<(CloudHead, Vec<Part>)>,
}

impl CloudSourceHost for RemoteSource<'_> {
    fn next_cloud(&mut self) -> Result<Option<CloudHeader>> {
        let (_done, parts) = self.program.ask(&Ask::NextCloud, &[])?;
        let header = parts.first().map(|part| rmp_serde::from_slice(part.bytes()));
        header.transpose().map_err(|error| Error::new(error.to_string()))
    }

    fn next_batch(&mut self) -> Result<Option<CloudView<'_>>> {
        let (reply, parts) = self.program.ask(&Ask::NextBatch, &[])?;
        self.last = match reply {
            Reply::Points(Some(head)) => Some((head, parts)),
            _ => None,
        };
        Ok(self.last.as_ref().map(|(head, parts)| head.view(parts)))
    }
}
