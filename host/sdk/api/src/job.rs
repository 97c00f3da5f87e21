//! A running job's line to the host: progress, cancellation, parallel loops, the GPU and edits.

use crate::abi::EncodedGraph;
use crate::error::{Error, Result};
use crate::graph::{BufferId, Graph};
use crate::stroke::Stroke;
use crate::tool::{ColumnHeader, Edit, EditHeader, NewColumn};
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// What an error says where the user asked to stop.
pub const CANCELLED: &str = "cancelled";

/// What a host offers a running job.
pub trait JobHost {
    /// Takes progress in [0, 1] and what is being done; an empty message keeps the last.
    fn progress(&self, fraction: f64, message: &str);
    /// Whether the user asked to stop.
    fn cancelled(&self) -> bool;
    /// Takes a staged edit.
    ///
    /// # Errors
    /// Where the edit does not fit the cloud.
    fn stage(&self, header: &EditHeader, values: &[&[u8]]) -> Result<()>;

    /// Calls `work` with ranges that cover `0..count` without overlap, on any threads and in any
    /// order, and takes the share done as progress from `share.start` to `share.end`. Returns
    /// false, with ranges left out, where the user asked to stop.
    fn parallel(
        &self,
        count: usize,
        share: Range<f64>,
        work: &(dyn Fn(Range<usize>) + Sync),
    ) -> bool {
        for start in (0..count).step_by(RANGE) {
            if self.cancelled() {
                return false;
            }
            work(start..(start + RANGE).min(count));
            let done = (start + RANGE).min(count) as f64 / count as f64;
            self.progress(share.start + done * (share.end - share.start), "");
        }
        true
    }

    /// Runs a graph of compute passes on the device and returns the bytes of these of its buffers,
    /// named by their position in the graph.
    ///
    /// # Errors
    /// Where there is no device, or the graph is refused or fails.
    fn compute(&self, _graph: &EncodedGraph, _buffers: &[u32]) -> Result<Vec<Vec<u8>>> {
        Err(Error::new("this host runs no graphs for tools"))
    }
}

/// Most items in a range of a parallel loop: few enough that a loop over all pairs of a million
/// surfels still asks several times a second whether to stop.
pub const RANGE: usize = 16;

/// A running tool's or tracer's line to the host.
pub struct Job<'a> {
    host: &'a dyn JobHost,
    stroke: Option<&'a Stroke>,
}

impl<'a> Job<'a> {
    /// A job that reports to `host`.
    #[must_use]
    pub fn new(host: &'a dyn JobHost) -> Self {
        Self { host, stroke: None }
    }

    /// The same of a tool that is handled. ABI 3.11.
    #[doc(hidden)]
    #[must_use]
    pub fn with_stroke(self, stroke: &'a Stroke) -> Self {
        Self { stroke: Some(stroke), ..self }
    }

    /// What the hand did, where the tool is [handled](crate::Handling). ABI 3.11.
    #[must_use]
    pub fn stroke(&self) -> Option<&'a Stroke> {
        self.stroke
    }

    /// Tells how far the work is, in [0, 1], and what is being done; an empty message keeps the
    /// last. A message with 1 is what the host shows beside the result.
    pub fn progress(&self, fraction: f64, message: &str) {
        self.host.progress(fraction, message);
    }

    /// Whether the user asked to stop; a job that sees it returns soon.
    #[must_use]
    pub fn cancelled(&self) -> bool {
        self.host.cancelled()
    }

    /// Returns an error where the user asked to stop, for use with `?` in loops.
    ///
    /// # Errors
    /// "cancelled", where the user asked to stop.
    pub fn check(&self) -> Result<()> {
        if self.cancelled() { Err(Error::new(CANCELLED)) } else { Ok(()) }
    }

    /// Calls `work` with ranges that cover `0..count` without overlap, on the host's threads.
    ///
    /// Progress goes from `share.start` to `share.end` under the last message. Which ranges there
    /// are, and on which threads, is not fixed: what `work` computes for an item must depend on
    /// that item alone, and then the result is the same on any number of threads.
    ///
    /// # Errors
    /// "cancelled", where the user asked to stop; some ranges were then left out.
    ///
    /// # Panics
    /// Where `work` panics, after the ranges under way have ended.
    pub fn each_range(
        &self,
        count: usize,
        share: Range<f64>,
        work: impl Fn(Range<usize>) + Sync,
    ) -> Result<()> {
        match self.host.parallel(count, share, &work) {
            true => self.check(),
            false => Err(Error::new(CANCELLED)),
        }
    }

    /// Calls `work(0)` to `work(count - 1)` on the host's threads, each of which takes long, such as a part of a file;
    /// otherwise as [`each_range`](Self::each_range). Came while ABI 3.11 was current.
    ///
    /// # Errors
    /// "cancelled", where the user asked to stop; some pieces were then left out.
    ///
    /// # Panics
    /// Where `work` panics.
    pub fn each_piece(
        &self,
        count: usize,
        share: Range<f64>,
        work: impl Fn(usize) + Sync,
    ) -> Result<()> {
        // Ranges have up to `RANGE` items: so many stand for one piece.
        self.each_range(count * RANGE, share, |range| {
            for i in range.filter(|i| i % RANGE == 0) {
                work(i / RANGE);
            }
        })
    }

    /// Computes `compute(0)` to `compute(count - 1)` on the host's threads, as
    /// [`each_range`](Self::each_range).
    ///
    /// # Errors
    /// "cancelled", where the user asked to stop.
    ///
    /// # Panics
    /// Where `compute` panics.
    pub fn map<T: Send>(
        &self,
        count: usize,
        share: Range<f64>,
        compute: impl Fn(usize) -> T + Sync,
    ) -> Result<Vec<T>> {
        let found: Mutex<Vec<(usize, Vec<T>)>> = Mutex::new(Vec::new());
        self.each_range(count, share, |range| {
            let values = range.clone().map(&compute).collect();
            // A value is only ever added whole, so a thread that died left nothing half done.
            found.lock().unwrap_or_else(PoisonError::into_inner).push((range.start, values));
        })?;
        let mut found = found.into_inner().unwrap_or_else(PoisonError::into_inner);
        found.sort_unstable_by_key(|(start, _)| *start);
        let mut all = Vec::with_capacity(count);
        all.extend(found.into_iter().flat_map(|(_, values)| values));
        Ok(all)
    }

    /// Runs a graph of compute passes on the GPU and returns the bytes of these of its buffers.
    ///
    /// There is no view: numbers of workgroups and sizes of textures are fixed, and nothing of the
    /// host's view, lights or surfels can be read; there are no outputs. Nothing of the graph stays
    /// on the device, so no resource is persistent; shaders are compiled once in a run. The passes
    /// that feed none of the buffers still run: a tool asks for what it needs.
    ///
    /// Some devices end loops early without a word: Mesa's software device after 65,535 rounds of all
    /// loops of an invocation together. Longer work is divided over invocations and dispatches.
    ///
    /// # Errors
    /// Where the machine has no GPU, or the graph is refused or fails; a tool that can do without
    /// goes on without.
    pub fn compute(&self, graph: &Graph, buffers: &[BufferId]) -> Result<Vec<Vec<u8>>> {
        let structure = rmp_serde::to_vec_named(graph.structure())?;
        let encoded = EncodedGraph { structure, data: graph.data().to_vec() };
        let buffers: Vec<u32> = buffers.iter().map(|buffer| buffer.0).collect();
        self.host.compute(&encoded, &buffers)
    }

    /// Stages an edit; it is committed when the tool returns `Ok`.
    ///
    /// A run stages columns and values as often as it likes, a later one of a name in the place of an earlier,
    /// and then at most one mask or some new surfels; or it stages one new cloud and nothing else. Lengths are those
    /// of the cloud that the tool was given.
    ///
    /// # Errors
    /// Where the edit does not fit the cloud or what was staged before; it is then left out.
    pub fn edit(&self, edit: &Edit<'_>) -> Result<()> {
        let describe = |columns: &[NewColumn<'_>]| -> Vec<ColumnHeader> {
            columns
                .iter()
                .map(|column| ColumnHeader {
                    name: column.name.to_owned(),
                    components: column.components,
                    element: column.values.element(),
                })
                .collect()
        };
        match edit {
            Edit::Columns(columns) => {
                let bytes: Vec<Vec<u8>> =
                    columns.iter().map(|c| little_endian(&c.values)).collect();
                self.stage(&EditHeader::Columns(describe(columns)), &bytes)
            }
            Edit::Keep(mask) => {
                let bytes = mask.iter().map(|&keep| u8::from(keep)).collect();
                self.stage(&EditHeader::Keep, &[bytes])
            }
            Edit::Values { surfels: rows, columns } | Edit::Add { like: rows, columns } => {
                let values = columns.iter().map(|column| little_endian(&column.values));
                let rows = little_endian(&crate::columns::Values::U32(rows));
                let bytes: Vec<Vec<u8>> = std::iter::once(rows).chain(values).collect();
                let header = match edit {
                    Edit::Add { .. } => EditHeader::Add(describe(columns)),
                    _ => EditHeader::Values(describe(columns)),
                };
                self.stage(&header, &bytes)
            }
            Edit::NewCloud { origin, columns } => {
                let bytes: Vec<Vec<u8>> =
                    columns.iter().map(|c| little_endian(&c.values)).collect();
                let header = EditHeader::NewCloud { origin: *origin, columns: describe(columns) };
                self.stage(&header, &bytes)
            }
        }
    }

    fn stage(&self, header: &EditHeader, values: &[Vec<u8>]) -> Result<()> {
        let slices: Vec<&[u8]> = values.iter().map(Vec::as_slice).collect();
        self.host.stage(header, &slices)
    }
}

/// The values' bytes, least significant first.
fn little_endian(values: &crate::columns::Values<'_>) -> Vec<u8> {
    use crate::columns::Values;
    macro_rules! bytes {
        ($slice:expr) => {
            $slice.iter().flat_map(|value| value.to_le_bytes()).collect()
        };
    }
    match values {
        Values::I8(slice) => bytes!(slice),
        Values::U8(slice) => slice.to_vec(),
        Values::I16(slice) => bytes!(slice),
        Values::U16(slice) => bytes!(slice),
        Values::I32(slice) => bytes!(slice),
        Values::U32(slice) => bytes!(slice),
        Values::F32(slice) => bytes!(slice),
        Values::F64(slice) => bytes!(slice),
    }
}
