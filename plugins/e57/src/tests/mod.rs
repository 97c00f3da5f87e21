//! Tests through `Format::read` and `Format::write`, on files in memory.

mod damage;
mod foreign;
mod round_trip;

use crate::E57;
use crate::element::Buffer;
use std::collections::VecDeque;
use std::io;
use std::sync::{Arc, Mutex};
use surfelshop_api::Format as _;
use surfelshop_api::columns::Values;
use surfelshop_api::format::{
    CloudHeader, CloudSink, CloudSinkHost, CloudSource, CloudSourceHost, Collected, FileColumn,
    FileHost, FileSink, FileSource, UpAxis,
};
use surfelshop_api::job::JobHost;
use surfelshop_api::prelude::*;
use surfelshop_api::tool::EditHeader;

/// A host without threads, which holds that progress is a fraction.
struct PlainHost;

impl JobHost for PlainHost {
    fn progress(&self, fraction: f64, message: &str) {
        assert!((0.0..=1.0).contains(&fraction), "{fraction} {message}");
    }

    fn cancelled(&self) -> bool {
        false
    }

    fn stage(&self, _header: &EditHeader, _values: &[&[u8]]) -> Result<()> {
        Err(Error::new("formats stage nothing"))
    }
}

/// A file in memory that is written.
#[derive(Default)]
struct WrittenFile(Mutex<Vec<u8>>);

impl FileHost for WrittenFile {
    fn length(&self) -> u64 {
        self.0.lock().unwrap().len() as u64
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        let bytes = self.0.lock().unwrap();
        let first = (offset as usize).min(bytes.len());
        let len = buffer.len().min(bytes.len() - first);
        buffer[..len].copy_from_slice(&bytes[first..first + len]);
        Ok(len)
    }

    fn write_at(&self, offset: u64, added: &[u8]) -> io::Result<()> {
        let mut bytes = self.0.lock().unwrap();
        let end = offset as usize + added.len();
        let len = bytes.len().max(end);
        bytes.resize(len, 0);
        bytes[offset as usize..end].copy_from_slice(added);
        Ok(())
    }
}

/// A cloud that a test writes: its columns are those of its header.
#[derive(Clone)]
struct TestCloud {
    header: CloudHeader,
    columns: Vec<Buffer>,
    faces: Vec<[u32; 3]>,
}

impl Default for TestCloud {
    fn default() -> Self {
        let header = CloudHeader { up: UpAxis::Z, ..CloudHeader::default() };
        Self { header, columns: Vec::new(), faces: Vec::new() }
    }
}

impl TestCloud {
    fn with(mut self, name: &str, components: u32, values: Buffer) -> Self {
        let element = values.values().element();
        self.header.columns.push(FileColumn::new(name, components, element));
        self.columns.push(values);
        self
    }

    fn len(&self) -> usize {
        let column = self.header.columns.iter().zip(&self.columns).next();
        column.map_or(0, |(column, values)| values.values().len() / column.components as usize)
    }
}

/// Hands over clouds in batches of a number of points.
struct TestSource {
    clouds: VecDeque<TestCloud>,
    current: TestCloud,
    next: usize,
    rows: usize,
}

impl CloudSourceHost for TestSource {
    fn next_cloud(&mut self) -> Result<Option<CloudHeader>> {
        let Some(cloud) = self.clouds.pop_front() else { return Ok(None) };
        (self.current, self.next) = (cloud, 0);
        Ok(Some(self.current.header.clone()))
    }

    fn next_batch(&mut self) -> Result<Option<CloudView<'_>>> {
        let (first, cloud) = (self.next, &self.current);
        let end = cloud.len().min(first + self.rows);
        if first == end {
            return Ok(None);
        }
        self.next = end;
        let columns = cloud.header.columns.iter().zip(&cloud.columns);
        let columns = columns.map(|(column, values)| {
            let n = column.components as usize;
            let range = n * first..n * end;
            let values = match values.values() {
                Values::I8(values) => Values::I8(&values[range]),
                Values::U8(values) => Values::U8(&values[range]),
                Values::I16(values) => Values::I16(&values[range]),
                Values::U16(values) => Values::U16(&values[range]),
                Values::I32(values) => Values::I32(&values[range]),
                Values::U32(values) => Values::U32(&values[range]),
                Values::F32(values) => Values::F32(&values[range]),
                Values::F64(values) => Values::F64(&values[range]),
            };
            ColumnView { name: &column.name, components: column.components, generation: 1, values }
        });
        let columns = columns.collect();
        let faces = if end == cloud.len() { cloud.faces.as_slice() } else { &[] };
        Ok(Some(CloudView { len: end - first, columns, faces, ..CloudView::default() }))
    }
}

/// The bytes of a file of clouds, and what was said of it.
fn written(clouds: &[TestCloud]) -> (Vec<u8>, Vec<String>) {
    let file = Arc::new(WrittenFile::default());
    let clouds = clouds.iter().cloned().collect();
    let mut source = TestSource { clouds, current: TestCloud::default(), next: 0, rows: 700 };
    let mut format = E57::new(&HostInfo::default()).unwrap();
    let (mut source, sink) = (CloudSource::new(&mut source), FileSink::new(file.clone(), "a.e57"));
    let lines = format.write(&mut source, &(), &sink, &Job::new(&PlainHost)).unwrap();
    (std::mem::take(&mut *file.0.lock().unwrap()), lines)
}

/// Reads a file into a host.
fn read_into(
    bytes: Vec<u8>,
    host: &mut dyn CloudSinkHost,
    wanted: Option<&[String]>,
) -> Result<()> {
    let file = FileSource::of_bytes(bytes, "a.e57");
    let mut format = E57::new(&HostInfo::default()).unwrap();
    format.read(&file, &(), &mut CloudSink::new(host, wanted), &Job::new(&PlainHost))
}

/// What is in a file.
fn read(bytes: Vec<u8>) -> Result<Collected> {
    let mut collected = Collected::default();
    read_into(bytes, &mut collected, None)?;
    Ok(collected)
}

/// The values of a column of a cloud.
fn column<'a>(collected: &'a Collected, cloud: usize, name: &str) -> &'a [f64] {
    let cloud = &collected.clouds[cloud];
    let (place, _) = cloud.header.column(name).unwrap_or_else(|| panic!("no column `{name}`"));
    &cloud.columns[place]
}

/// Random numbers of a seed.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ mixed >> 31
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// In [-1, 1).
    fn float(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}
