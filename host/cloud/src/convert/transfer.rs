//! A short queue of batches between a format that reads and one that writes.

use super::counts::SharedCounts;
use super::select::Selection;
use super::target::{Target, TargetBatch, Types};
use crate::assemble::TrainedSplats;
use crate::cloud::buffer::Buffer;
use crate::error::ReadError;
use crate::formats::table_sink::{check_count, check_header};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use surfelshop_api::columns::Values;
use surfelshop_api::format::{CloudHeader, CloudSinkHost, CloudSourceHost, check_batch};
use surfelshop_api::{CloudView, Error, Result};

/// Batches that wait for the writer.
const WAITING: usize = 4;

/// Columns whose values are written: memory that the system need not find again for every batch. At most as many as a
/// batch has: what waits longer would grow with the file.
#[derive(Clone, Default)]
struct Spare(Arc<Mutex<Vec<Buffer>>>);

impl Spare {
    fn columns(&self) -> MutexGuard<'_, Vec<Buffer>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn put(&self, columns: Vec<Buffer>) {
        let mut spare = self.columns();
        let free = columns.len().saturating_sub(spare.len());
        spare.extend(columns.into_iter().filter(|column| !column.is_empty()).take(free));
    }

    /// A copy of values.
    fn filled(&self, values: &Values<'_>) -> Result<Buffer> {
        let element = values.element();
        let mut spare = self.columns();
        let found = spare.iter().position(|column| column.element() == element);
        let mut buffer = match found {
            Some(place) => spare.remove(place),
            None => Buffer::with_capacity(element, 0),
        };
        drop(spare);
        buffer.clear();
        buffer.append(values).map_err(|out| Error::new(out.to_string()))?;
        Ok(buffer)
    }
}

/// What goes through the queue.
enum Message {
    Cloud(Box<CloudHeader>),
    Batch(Vec<Buffer>),
    Faces(Vec<[u32; 3]>),
    Failed(String),
    End,
}

/// What both ends and the caller share.
pub(super) struct Shared {
    sender: SyncSender<Message>,
    warnings: Mutex<Vec<String>>,
    writer_gone: AtomicBool,
}

impl Shared {
    fn warnings_mut(&self) -> MutexGuard<'_, Vec<String>> {
        self.warnings.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn send(&self, message: Message) -> Result<()> {
        self.sender.send(message).map_err(|_gone| {
            self.writer_gone.store(true, Ordering::Relaxed);
            Error::new("the writer takes no more")
        })
    }

    pub(super) fn warnings(&self) -> Vec<String> {
        std::mem::take(&mut self.warnings_mut())
    }

    pub(super) fn writer_is_gone(&self) -> bool {
        self.writer_gone.load(Ordering::Relaxed)
    }

    /// Says that there is no more.
    pub(super) fn finish(&self) {
        // A writer that is gone has said why.
        drop(self.send(Message::End));
    }

    /// Says that there is no more, since a file could not be read.
    pub(super) fn fail(&self, error: &ReadError) {
        drop(self.send(Message::Failed(error.to_string())));
    }
}

/// The reader's end.
pub(super) struct TransferSink {
    shared: Arc<Shared>,
    header: Option<CloudHeader>,
    /// The cloud as splats that become what the host has for them.
    splats: Option<TrainedSplats>,
    keeps_trained: bool,
    columns: Option<Vec<String>>,
    spare: Spare,
    /// Points of the cloud so far.
    n: u64,
}

/// The writer's end.
pub(super) struct TransferSource {
    receiver: Receiver<Message>,
    target: Target,
    /// A cloud whose header came while batches of the one before were asked for.
    next: Option<CloudHeader>,
    ended: bool,
    faces: Vec<[u32; 3]>,
    batch: TargetBatch,
    spare: Spare,
    pub(super) counts: SharedCounts,
}

/// Both ends. Where there is a header of all clouds, they become one.
pub(super) fn transfer(
    merged: Option<CloudHeader>,
    selection: Selection,
    types: Types,
) -> (TransferSink, TransferSource) {
    let (sender, receiver) = sync_channel(WAITING);
    let (warnings, writer_gone) = Default::default();
    let shared = Arc::new(Shared { sender, warnings, writer_gone });
    let columns = selection.columns.clone();
    let counts: SharedCounts = Arc::default();
    let target = Target::new(merged, selection, types, Arc::clone(&counts));
    let spare = Spare::default();
    let (next, ended, faces, batch) = Default::default();
    let other = spare.clone();
    let source = TransferSource { receiver, target, next, ended, faces, batch, spare, counts };
    let (header, splats, keeps_trained) = (None, None, types.trained_splats);
    let sink = TransferSink { shared, header, splats, keeps_trained, columns, spare: other, n: 0 };
    (sink, source)
}

impl TransferSink {
    pub(super) fn state(&self) -> Arc<Shared> {
        Arc::clone(&self.shared)
    }

    /// Says where a cloud has fewer points than its head announced, and what was wrong with its splats.
    pub(super) fn end_cloud(&mut self) {
        let mut warnings: Vec<String> = Vec::new();
        if let Some(splats) = self.splats.take() {
            splats.tell(&mut warnings);
        }
        warnings.iter().for_each(|line| self.warn(line));
        let announced = self.header.take().and_then(|header| header.rows);
        let n = std::mem::take(&mut self.n);
        if let Some(announced) = announced.filter(|&announced| announced > n) {
            let said = format!("{n} of {announced} points were read");
            // The format may have said so, and why.
            let is_said = self.shared.warnings_mut().iter().any(|line| line.contains(&said));
            if !is_said {
                self.warn(&format!("{announced} points are announced, {n} were read"));
            }
        }
    }

    pub(super) fn columns(&self) -> Option<Vec<String>> {
        self.columns.clone()
    }
}

impl CloudSinkHost for TransferSink {
    fn begin(&mut self, header: &CloudHeader) -> Result<bool> {
        check_header(header)?;
        self.end_cloud();
        self.header = Some(header.clone());
        let mut warnings: Vec<String> = Vec::new();
        if !self.keeps_trained {
            self.splats = TrainedSplats::of(header, &mut warnings);
        }
        warnings.iter().for_each(|line| self.warn(line));
        let sent = self.splats.as_ref().map_or(header, TrainedSplats::header);
        self.shared.send(Message::Cloud(Box::new(sent.clone())))?;
        Ok(true)
    }

    fn batch(&mut self, values: &[Values<'_>]) -> Result<()> {
        let Some(header) = &self.header else {
            return Err(Error::new("a batch came before the header of its cloud"));
        };
        let rows = check_batch(header, values)?;
        if rows == 0 {
            return Ok(());
        }
        self.n += rows as u64;
        check_count(header, self.n)?;
        let copies = match &self.splats {
            Some(splats) => {
                splats.batch(values, rows).map_err(|fault| Error::new(fault.to_string()))?
            }
            None => values.iter().map(|values| self.spare.filled(values)).collect::<Result<_>>()?,
        };
        self.shared.send(Message::Batch(copies))
    }

    fn faces(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        self.shared.send(Message::Faces(triangles.to_vec()))
    }

    fn warn(&mut self, line: &str) {
        const MOST: usize = 100;
        let mut warnings = self.shared.warnings_mut();
        if warnings.len() < MOST {
            warnings.push(line.to_owned());
        }
    }
}

impl TransferSource {
    /// Gives the first scan this number.
    pub(super) fn count_scans_from(&mut self, first: u16) {
        self.target.first_scan = first;
    }

    /// The next message; an error where the reader failed or is gone.
    fn receive(&mut self) -> Result<Message> {
        if self.ended {
            return Ok(Message::End);
        }
        match self.receiver.recv() {
            Ok(Message::Failed(line)) => Err(Error::new(line)),
            Ok(Message::End) => {
                self.ended = true;
                match self.target.nothing_left() {
                    Some(line) => Err(Error::new(line)),
                    None => Ok(Message::End),
                }
            }
            Ok(message) => Ok(message),
            Err(_gone) => Err(Error::new("the reader ended before it was done")),
        }
    }
}

impl CloudSourceHost for TransferSource {
    fn next_cloud(&mut self) -> Result<Option<CloudHeader>> {
        loop {
            let header = match self.next.take() {
                Some(header) => header,
                None => match self.receive()? {
                    Message::Cloud(header) => *header,
                    Message::End => return Ok(None),
                    // The writer asked for no more of the cloud before.
                    _ => continue,
                },
            };
            return Ok(Some(self.target.begin(header)));
        }
    }

    fn next_batch(&mut self) -> Result<Option<CloudView<'_>>> {
        if self.next.is_some() || self.ended {
            return Ok(self.last());
        }
        loop {
            match self.receive()? {
                Message::Batch(mut columns) => {
                    self.spare.put(std::mem::take(&mut self.batch.columns));
                    self.batch = self.target.batch(&mut columns);
                    self.spare.put(columns);
                    if self.batch.rows > 0 {
                        break;
                    }
                }
                Message::Faces(mut faces) if self.target.keeps_faces() => {
                    self.target.number(&mut faces);
                    self.faces.append(&mut faces);
                }
                Message::Faces(_) => {}
                Message::Cloud(header) if self.target.merges() => self.target.go_on(*header),
                Message::Cloud(header) => {
                    self.next = Some(*header);
                    return Ok(self.last());
                }
                Message::End => return Ok(self.last()),
                Message::Failed(line) => return Err(Error::new(line)),
            }
        }
        Ok(Some(self.target.view(&self.batch, &[])))
    }
}

impl TransferSource {
    /// After the points of a cloud: its triangles, with no points.
    fn last(&mut self) -> Option<CloudView<'_>> {
        if self.faces.is_empty() {
            return None;
        }
        self.batch = self.target.empty();
        let faces = std::mem::take(&mut self.faces);
        self.batch.faces = faces;
        Some(self.target.view(&self.batch, &self.batch.faces))
    }
}
