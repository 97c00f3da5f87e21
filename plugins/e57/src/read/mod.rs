//! Reading: headers through the crate `e57`, points packet by packet.

mod batch;
mod bits;
mod color;
mod extensions;
mod fields;
pub(crate) mod header;
pub(crate) mod layout;
mod packets;
pub(crate) mod pages;
mod scanner;
mod streams;

use crate::read::batch::{Batch, Tally};
use crate::read::header::FileFacts;
use crate::read::layout::Layout;
use crate::read::packets::Packets;
use crate::read::pages::{PAGE, Pages, place};
use crate::read::streams::Streams;
use crate::refused;
use e57::{E57Reader, Header, PointCloud};
use std::ops::Range;
use std::sync::{Mutex, PoisonError};
use surfelshop_api::format::{BATCH, CloudSink, FileSource};
use surfelshop_api::job::RANGE;
use surfelshop_api::{Error, Job, Result};

/// Batches that are decoded at once, by as many threads.
const AT_ONCE: usize = 8;
/// Most bytes of a batch.
const BATCH_BYTES: usize = 1 << 24;

/// Most bytes of a file's description that the crate `e57` takes.
const LONGEST_DESCRIPTION: u64 = 50 << 20;

/// Reads the scans of a file.
///
/// # Errors
/// Where the file is damaged, or has no scans.
pub(crate) fn read(file: &FileSource, clouds: &mut CloudSink<'_>, job: &Job<'_>) -> Result<()> {
    check_description(file)?;
    // The crate reads whole pages: a buffer before it would be emptied by every seek.
    let document = E57Reader::new(file.stream()).map_err(|error| refused(&error))?;
    let scans = document.pointclouds();
    if scans.is_empty() {
        let n_images = document.images().len();
        return Err(Error::new(format!("expected scans, found none, and {n_images} images")));
    }
    let facts = FileFacts::new(&document, &scans);
    let mut layouts: Vec<_> =
        scans.iter().map(|scan| Layout::new(scan, |column| clouds.wants(column))).collect();
    if layouts.iter().flatten().any(Layout::has_wide_colors) {
        layouts.iter_mut().flatten().for_each(Layout::widen_colors);
    }
    let n_points = scans.iter().map(|scan| scan.records as f64).sum();
    let mut reading = Reading { file, job, n_points, n_done: 0.0, tally: Tally::default() };
    let mut n_read = 0;
    for ((number, scan), layout) in (1..).zip(&scans).zip(layouts) {
        match layout {
            Ok(layout) => {
                let (header, doubt) = facts.header(scan, &layout);
                n_read += 1;
                if clouds.begin(&header)? {
                    layout.doubts.iter().chain(&doubt).for_each(|line| clouds.warn(line));
                    let name = |error: Error| Error::new(format!("scan {number}: {error}"));
                    reading.points(number, scan, &layout, clouds).map_err(name)?;
                }
            }
            Err(line) => clouds.warn(&format!("scan {number} is left out: {line}")),
        }
        reading.n_done += scan.records as f64;
    }
    reading.tally.lines().iter().for_each(|line| clouds.warn(line));
    if n_read == 0 {
        return Err(Error::new("expected scans with coordinates, found none"));
    }
    Ok(())
}

/// Bytes of a file's header.
const HEADER: usize = 48;

/// Whether a file begins with a header that can be read: the crate does not say what it found instead.
fn check_header(file: &FileSource) -> Result<()> {
    let mut header = [0; HEADER];
    let found = file.read_at(0, &mut header)?;
    let begins = header.starts_with(b"ASTM-E57");
    if found < HEADER {
        let what = if begins { "the file is cut short" } else { "no E57 file, or cut short" };
        return Err(Error::new(format!(
            "expected an E57 header of {HEADER} bytes, found {found}: {what}"
        )));
    }
    if !begins {
        return Err(Error::new(
            "expected a file that begins with ASTM-E57, found another beginning",
        ));
    }
    let word = |at: usize| header[at..].first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
    if (word(8), word(12)) != (1, 0) {
        let (major, minor) = (word(8), word(12));
        return Err(Error::new(format!("expected E57 1.0, found {major}.{minor}")));
    }
    let page = header[40..].first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
    if page != PAGE {
        return Err(Error::new(format!("expected pages of {PAGE} bytes, found {page}")));
    }
    Ok(())
}

/// Whether the description of a file is there and undamaged, before memory is taken for what it is said to be.
fn check_description(file: &FileSource) -> Result<()> {
    check_header(file)?;
    let header = Header::read(&mut file.stream()).map_err(|error| refused(&error))?;
    let (offset, len) = (header.phys_xml_offset, header.xml_length);
    let end = offset.saturating_add(len);
    let (expected, found) = (header.phys_length.max(end), file.length());
    if expected > found {
        return Err(Error::new(format!(
            "expected {expected} bytes as the file's header says, found {found}: the file is damaged or cut short"
        )));
    }
    // The crate refuses longer ones, and names no page.
    if len <= LONGEST_DESCRIPTION {
        let mut pages = Pages::new(file, place(offset)?, u64::MAX);
        pages.take(usize::try_from(len)?).map(|_checked| ())?;
    }
    Ok(())
}

/// Reading the points of a file's scans.
struct Reading<'a> {
    file: &'a FileSource,
    job: &'a Job<'a>,
    /// Points of all scans, and of those that are done, as the file announces them.
    n_points: f64,
    n_done: f64,
    tally: Tally,
}

impl Reading<'_> {
    /// Hands over the points of a scan.
    fn points(
        &mut self,
        number: usize,
        scan: &PointCloud,
        layout: &Layout,
        clouds: &mut CloudSink<'_>,
    ) -> Result<()> {
        if scan.records == 0 {
            return Ok(());
        }
        let mut packets = Packets::open(self.file, scan.file_offset)?;
        let mut decoder = Decoder::new(layout);
        let at_once = (decoder.rows * AT_ONCE) as u64;
        let mut left = scan.records;
        while left > 0 {
            let streams = &mut decoder.streams;
            while streams.n_points().is_some_and(|n| n < at_once) && packets.next(streams)? {}
            let there = match streams.n_points() {
                Some(n) => n,
                None => constant_points(scan)?,
            };
            let n = there.min(left).min(at_once);
            if n == 0 {
                break;
            }
            let done = self.n_done + (scan.records - left) as f64;
            let share = done / self.n_points..((done + n as f64) / self.n_points).min(1.0);
            // No more than `at_once`.
            for batch in decoder.batches(n as usize, share, self.job)? {
                self.tally.add(batch.tally);
                if !batch.is_empty() {
                    clouds.batch(&batch.values())?;
                }
                decoder.give_back(batch);
            }
            decoder.streams.forget(n);
            left -= n;
            self.job.check()?;
        }
        if left > 0 {
            let (announced, found) = (scan.records, scan.records - left);
            clouds.warn(&format!(
                "scan {number}: expected {announced} points, found {found}: the file is damaged"
            ));
        }
        Ok(())
    }
}

/// Points of a scan whose values are all constant, so that nothing of the file stands for them.
fn constant_points(scan: &PointCloud) -> Result<u64> {
    if scan.records <= BATCH as u64 {
        return Ok(scan.records);
    }
    Err(Error::new(format!(
        "expected points, found {} times the same without a byte in the file: the file is damaged",
        scan.records
    )))
}

/// Decodes the points of a scan in batches, on several threads.
struct Decoder<'a> {
    layout: &'a Layout,
    streams: Streams,
    /// Points of a batch.
    rows: usize,
    /// Batches that were handed over: their memory is used again.
    spare: Mutex<Vec<Batch>>,
}

impl<'a> Decoder<'a> {
    fn new(layout: &'a Layout) -> Self {
        let streams = Streams::new(&layout.fields, |field| layout.needs(field));
        let rows = (BATCH_BYTES / layout.point_bytes().max(1)).clamp(1, BATCH);
        Self { layout, streams, rows, spare: Mutex::default() }
    }

    /// The first points, which are there. Progress goes through `share`.
    fn batches(&self, n: usize, share: Range<f64>, job: &Job<'_>) -> Result<Vec<Batch>> {
        let n_batches = n.div_ceil(self.rows);
        if n_batches == 1 {
            job.progress(share.end, "");
            return Ok(vec![self.batch(0, n)]);
        }
        // A thread takes `RANGE` items at once; a batch is as much work as many of them, and each is one of its own.
        let of_item = |i: usize| i.is_multiple_of(RANGE).then(|| self.batch(i / RANGE, n));
        let batches = job.map(n_batches * RANGE, share, of_item)?;
        Ok(batches.into_iter().flatten().collect())
    }

    /// One of the batches of the first `n` points.
    fn batch(&self, number: usize, n: usize) -> Batch {
        let spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut batch = spare.unwrap_or_else(|| Batch::new(self.layout));
        let first = number * self.rows;
        batch.decode(self.layout, &self.streams, first, self.rows.min(n - first));
        batch
    }

    fn give_back(&self, batch: Batch) {
        self.spare.lock().unwrap_or_else(PoisonError::into_inner).push(batch);
    }
}
