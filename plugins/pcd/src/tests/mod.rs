//! Tests through `Format`, with files in memory.

mod damage;
mod header;
mod reading;
mod round_trips;
mod text;

use crate::{Encoding, Pcd, Settings, ViewpointMeaning};
use std::io;
use std::sync::{Arc, Mutex};
use surfelshop_api::columns::{ColumnView, Element, Values};
use surfelshop_api::format::{
    CloudHeader, CloudSink, CloudSource, CloudSourceHost, Collected, FileColumn, FileHost,
    FileSink, FileSource,
};
use surfelshop_api::job::JobHost;
use surfelshop_api::prelude::{Error, HostInfo, Job, Result};
use surfelshop_api::tool::EditHeader;
use surfelshop_api::{CloudView, Format};

/// A host whose loops run one after the other.
struct SerialHost;

impl JobHost for SerialHost {
    fn progress(&self, fraction: f64, _message: &str) {
        assert!((0.0..=1.0).contains(&fraction), "{fraction}");
    }

    fn cancelled(&self) -> bool {
        false
    }

    fn stage(&self, _header: &EditHeader, _values: &[&[u8]]) -> Result<()> {
        Err(Error::new("formats stage nothing"))
    }
}

/// A file that is written in memory.
#[derive(Default)]
struct WrittenFile(Mutex<Vec<u8>>);

impl FileHost for WrittenFile {
    fn length(&self) -> u64 {
        self.0.lock().unwrap().len() as u64
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        let bytes = self.0.lock().unwrap();
        let rest = &bytes[(offset as usize).min(bytes.len())..];
        let n = rest.len().min(buffer.len());
        buffer[..n].copy_from_slice(&rest[..n]);
        Ok(n)
    }

    fn write_at(&self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        let mut file = self.0.lock().unwrap();
        let end = offset as usize + bytes.len();
        if file.len() < end {
            file.resize(end, 0);
        }
        file[offset as usize..end].copy_from_slice(bytes);
        Ok(())
    }
}

/// A column in memory.
#[derive(Clone)]
enum Owned {
    I8(Vec<i8>),
    U8(Vec<u8>),
    I16(Vec<i16>),
    U16(Vec<u16>),
    I32(Vec<i32>),
    U32(Vec<u32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

impl Owned {
    fn slice(&self, from: usize, to: usize) -> Values<'_> {
        match self {
            Self::I8(v) => Values::I8(&v[from..to]),
            Self::U8(v) => Values::U8(&v[from..to]),
            Self::I16(v) => Values::I16(&v[from..to]),
            Self::U16(v) => Values::U16(&v[from..to]),
            Self::I32(v) => Values::I32(&v[from..to]),
            Self::U32(v) => Values::U32(&v[from..to]),
            Self::F32(v) => Values::F32(&v[from..to]),
            Self::F64(v) => Values::F64(&v[from..to]),
        }
    }

    fn all(&self) -> Values<'_> {
        let len = match self {
            Self::I8(v) => v.len(),
            Self::U8(v) => v.len(),
            Self::I16(v) => v.len(),
            Self::U16(v) => v.len(),
            Self::I32(v) => v.len(),
            Self::U32(v) => v.len(),
            Self::F32(v) => v.len(),
            Self::F64(v) => v.len(),
        };
        self.slice(0, len)
    }
}

/// A cloud that is written.
#[derive(Clone, Default)]
struct TestCloud {
    header: CloudHeader,
    columns: Vec<Owned>,
    faces: Vec<[u32; 3]>,
    /// Points of a batch.
    batch: usize,
    n_done: usize,
    begun: bool,
}

impl TestCloud {
    fn column(mut self, name: &str, components: u32, values: Owned) -> Self {
        let element: Element = values.all().element();
        self.header.columns.push(FileColumn::new(name, components, element));
        self.columns.push(values);
        self
    }

    fn n_rows(&self) -> usize {
        self.columns[0].all().len() / self.header.columns[0].components as usize
    }
}

impl CloudSourceHost for TestCloud {
    fn next_cloud(&mut self) -> Result<Option<CloudHeader>> {
        let first = !std::mem::replace(&mut self.begun, true);
        Ok(first.then(|| self.header.clone()))
    }

    fn next_batch(&mut self) -> Result<Option<CloudView<'_>>> {
        let (from, n_rows) = (self.n_done, self.n_rows());
        if from >= n_rows {
            return Ok(None);
        }
        self.n_done = (from + self.batch.max(1)).min(n_rows);
        let columns = self.header.columns.iter().zip(&self.columns).map(|(column, values)| {
            let c = column.components as usize;
            let values = values.slice(from * c, self.n_done * c);
            ColumnView { name: &column.name, components: column.components, generation: 1, values }
        });
        let columns = columns.collect();
        let faces = if self.n_done == n_rows { &self.faces[..] } else { &[] };
        Ok(Some(CloudView { len: self.n_done - from, columns, faces, ..CloudView::default() }))
    }
}

/// Writes a cloud; the file, and what it cannot hold.
fn write(mut cloud: TestCloud, encoding: Encoding) -> Result<(Vec<u8>, Vec<String>)> {
    let file = Arc::new(WrittenFile::default());
    let settings = Settings { encoding, ..Settings::default() };
    let lines = Pcd::new(&HostInfo::default())?.write(
        &mut CloudSource::new(&mut cloud),
        &settings,
        &FileSink::new(file.clone(), "a.pcd"),
        &Job::new(&SerialHost),
    )?;
    let bytes = file.0.lock().unwrap().clone();
    Ok((bytes, lines))
}

/// Reads a file with these columns, or all.
fn read_columns(
    bytes: &[u8],
    columns: Option<&[String]>,
    viewpoint: ViewpointMeaning,
) -> Result<Collected> {
    let mut found = Collected::default();
    let settings = Settings { viewpoint, ..Settings::default() };
    Pcd::new(&HostInfo::default())?.read(
        &FileSource::of_bytes(bytes.to_vec(), "a.pcd"),
        &settings,
        &mut CloudSink::new(&mut found, columns),
        &Job::new(&SerialHost),
    )?;
    Ok(found)
}

fn read(bytes: &[u8]) -> Result<Collected> {
    read_columns(bytes, None, ViewpointMeaning::Scanner)
}

/// The line that a file is refused with.
fn refusal(bytes: &[u8]) -> String {
    let line = read(bytes).map(|found| found.warnings.len()).unwrap_err().to_string();
    assert!(!line.contains('\n'), "{line}");
    line
}

/// A column that was read.
fn values<'a>(found: &'a Collected, name: &str) -> &'a [f64] {
    let cloud = &found.clouds[0];
    let (place, _) = cloud.header.column(name).unwrap_or_else(|| panic!("no column `{name}`"));
    &cloud.columns[place]
}

/// The bits of numbers, so that what is no number can be compared.
fn bits<'a>(values: impl IntoIterator<Item = &'a f64>) -> Vec<u64> {
    let canonical = |v: &f64| if v.is_nan() { u64::MAX } else { v.to_bits() };
    values.into_iter().map(canonical).collect()
}

/// The bytes of a file with a header and a body.
fn file(header: &str, body: &[u8]) -> Vec<u8> {
    [header.as_bytes(), body].concat()
}
