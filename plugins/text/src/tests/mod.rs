//! Tests through `Format::read` and `Format::write`, on files in memory.

mod damaged;
mod guesses;
mod pts;
mod ptx;
mod tables;
mod writing;

use crate::xyz::{Settings, Xyz};
use std::sync::{Arc, Mutex};
use surfelshop_api::columns::{ColumnView, Element, POSITION, Values};
use surfelshop_api::format::{
    CloudHeader, CloudSink, CloudSinkHost, CloudSource, CloudSourceHost, Collected, CollectedCloud,
    FileColumn, FileHost, FileSink, FileSource, Format, UpAxis,
};
use surfelshop_api::job::JobHost;
use surfelshop_api::prelude::*;
use surfelshop_api::tool::EditHeader;

/// A host that never stops a job and holds that progress is a fraction.
struct TestJob;

impl JobHost for TestJob {
    fn progress(&self, fraction: f64, message: &str) {
        assert!((0.0..=1.0).contains(&fraction), "{fraction} {message}");
    }

    fn cancelled(&self) -> bool {
        false
    }

    fn stage(&self, _header: &EditHeader, _values: &[&[u8]]) -> Result<()> {
        Err(Error::new("a format stages no edits"))
    }
}

/// Reads a file in memory with settings.
fn read_with<F: Format>(bytes: &[u8], name: &str, params: &F::Params) -> Result<Collected> {
    let mut collected = Collected::default();
    read_into::<F>(bytes, name, params, &mut collected, None)?;
    Ok(collected)
}

fn read_into<F: Format>(
    bytes: &[u8],
    name: &str,
    params: &F::Params,
    host: &mut dyn CloudSinkHost,
    columns: Option<&[String]>,
) -> Result<()> {
    let file = FileSource::of_bytes(bytes.to_vec(), name);
    let mut sink = CloudSink::new(host, columns);
    F::new(&HostInfo::default())?.read(&file, params, &mut sink, &Job::new(&TestJob))
}

/// Reads a table with the usual settings.
fn read(text: &str) -> Result<Collected> {
    read_with::<Xyz>(text.as_bytes(), "table.xyz", &Settings::default())
}

/// Reads a table that is one cloud about which nothing is doubtful; columns of words may be left out.
fn cloud(text: &str) -> CollectedCloud {
    let mut collected = read(text).unwrap_or_else(|error| panic!("{error}: {text}"));
    collected.warnings.retain(|line| !line.contains("is left out: expected numbers"));
    assert_eq!(collected.warnings, Vec::<String>::new(), "{text}");
    assert_eq!(collected.clouds.len(), 1);
    collected.clouds.remove(0)
}

/// A column's type and values.
fn column<'a>(cloud: &'a CollectedCloud, name: &str) -> (Element, &'a [f64]) {
    let found = cloud.header.column(name);
    let (place, column) = found.unwrap_or_else(|| panic!("no column `{name}`: {:?}", cloud.header));
    (column.element, &cloud.columns[place])
}

/// The names of a cloud's columns with components and types: `position 3 f64`.
fn shape(cloud: &CollectedCloud) -> String {
    let column = |c: &FileColumn| format!("{} {} {}", c.name, c.components, c.element.name());
    cloud.header.columns.iter().map(column).collect::<Vec<_>>().join(", ")
}

/// The line that a file is refused with: one line, not empty.
fn refusal(result: Result<Collected>) -> String {
    let line = result.map(|found| found.clouds.len()).unwrap_err().to_string();
    assert!(!line.is_empty() && !line.contains('\n'), "{line}");
    line
}

/// A file in memory that is written.
#[derive(Default)]
struct WrittenFile(Mutex<Vec<u8>>);

impl FileHost for WrittenFile {
    fn length(&self) -> u64 {
        self.0.lock().unwrap().len() as u64
    }

    fn read_at(&self, _offset: u64, _buffer: &mut [u8]) -> std::io::Result<usize> {
        Ok(0)
    }

    fn write_at(&self, offset: u64, bytes: &[u8]) -> std::io::Result<()> {
        let mut all = self.0.lock().unwrap();
        let start = usize::try_from(offset).unwrap();
        let end = start + bytes.len();
        if all.len() < end {
            all.resize(end, 0);
        }
        all[start..end].copy_from_slice(bytes);
        Ok(())
    }
}

/// Values of a column to write.
#[derive(Clone, Debug)]
enum Stored {
    U8(Vec<u8>),
    U16(Vec<u16>),
    I32(Vec<i32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

/// A cloud to write.
#[derive(Clone, Debug, Default)]
struct StoredCloud {
    header: CloudHeader,
    columns: Vec<Stored>,
    n_rows: usize,
}

impl StoredCloud {
    fn new(positions: &[[f64; 3]]) -> Self {
        let n_rows = positions.len();
        let header = CloudHeader { up: UpAxis::Z, ..CloudHeader::default() };
        Self { header, n_rows, ..Self::default() }.with(
            POSITION,
            3,
            Stored::F64(positions.concat()),
        )
    }

    fn with(mut self, name: &str, components: u32, values: Stored) -> Self {
        let element = match values {
            Stored::U8(_) => Element::U8,
            Stored::U16(_) => Element::U16,
            Stored::I32(_) => Element::I32,
            Stored::F32(_) => Element::F32,
            Stored::F64(_) => Element::F64,
        };
        self.header.columns.push(FileColumn::new(name, components, element));
        self.columns.push(values);
        self
    }
}

/// Hands clouds over in batches of a few points.
struct StoredSource {
    clouds: std::vec::IntoIter<StoredCloud>,
    current: StoredCloud,
    n_done: usize,
}

/// Points of a batch.
const FEW: usize = 7;

impl CloudSourceHost for StoredSource {
    fn next_cloud(&mut self) -> Result<Option<CloudHeader>> {
        let Some(next) = self.clouds.next() else { return Ok(None) };
        (self.current, self.n_done) = (next, 0);
        Ok(Some(self.current.header.clone()))
    }

    fn next_batch(&mut self) -> Result<Option<CloudView<'_>>> {
        let range = self.n_done..(self.n_done + FEW).min(self.current.n_rows);
        if range.is_empty() {
            return Ok(None);
        }
        self.n_done = range.end;
        let columns = self.current.header.columns.iter().zip(&self.current.columns);
        let columns = columns.map(|(column, stored)| {
            let n = column.components as usize;
            let part = range.start * n..range.end * n;
            let values = match stored {
                Stored::U8(all) => Values::U8(&all[part]),
                Stored::U16(all) => Values::U16(&all[part]),
                Stored::I32(all) => Values::I32(&all[part]),
                Stored::F32(all) => Values::F32(&all[part]),
                Stored::F64(all) => Values::F64(&all[part]),
            };
            ColumnView { name: &column.name, components: column.components, generation: 1, values }
        });
        let (len, columns) = (range.len(), columns.collect());
        Ok(Some(CloudView { len, columns, ..CloudView::default() }))
    }
}

/// Writes clouds to a file of this name: its text, and the lines about what is left out.
fn write_with<F: Format>(
    clouds: &[StoredCloud],
    name: &str,
    params: &F::Params,
) -> (String, Vec<String>) {
    let host = Arc::new(WrittenFile::default());
    let file = FileSink::new(host.clone(), name);
    let source = (clouds.to_vec(), StoredCloud::default());
    let mut source = StoredSource { clouds: source.0.into_iter(), current: source.1, n_done: 0 };
    let mut format = F::new(&HostInfo::default()).unwrap();
    let mut source = CloudSource::new(&mut source);
    let lines = format.write(&mut source, params, &file, &Job::new(&TestJob)).unwrap();
    let text = String::from_utf8(host.0.lock().unwrap().clone()).unwrap();
    (text, lines)
}

/// Numbers that look random and are the same each time.
struct Seeded(u64);

impl Seeded {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// From 0 to 1.
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}
