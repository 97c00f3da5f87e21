//! Tests over files that are made here, byte by byte or by the writer.

mod compressed;
mod damage;
mod extra_bytes;
mod first_version;
mod handmade;
mod hierarchy;
mod reading;
mod writing;

use crate::{Las, Settings};
use std::io;
use std::ops::Range;
use std::sync::{Arc, Mutex};
use surfelshop_api::columns::Values;
use surfelshop_api::format::{
    CloudHeader, CloudSink, CloudSource, CloudSourceHost, Collected, FileColumn, FileHost,
    FileSink, FileSource, Format as _, UpAxis,
};
use surfelshop_api::job::{CANCELLED, JobHost};
use surfelshop_api::tool::EditHeader;
use surfelshop_api::{CloudView, ColumnView, HostInfo, Job, Result};

/// A job that nobody watches.
pub(crate) struct Alone;

/// A job that the user stops.
struct Stopped;

impl JobHost for Stopped {
    fn progress(&self, _fraction: f64, _message: &str) {}

    fn cancelled(&self) -> bool {
        true
    }

    fn stage(&self, _header: &EditHeader, _values: &[&[u8]]) -> Result<()> {
        Ok(())
    }
}

#[test]
fn work_that_is_stopped_ends_in_a_line() {
    let made = handmade::Handmade::new(4, 6).with_walk(500, 0);
    for bytes in [made.las(), made.usual_laz(&[100])] {
        let file = FileSource::of_bytes(bytes, "a.las");
        let mut collected = Collected::default();
        let mut sink = CloudSink::new(&mut collected, None);
        let mut format = Las::new(&HostInfo::default()).unwrap();
        let read = format.read(&file, &Settings::default(), &mut sink, &Job::new(&Stopped));
        assert_eq!(read.unwrap_err().message(), CANCELLED);
        let file = FileSink::new(Arc::new(Written::default()), "a.laz");
        let mut cloud = Cloud::at(vec![0.0; 30]);
        let mut source = CloudSource::new(&mut cloud);
        let write = format.write(&mut source, &Settings::default(), &file, &Job::new(&Stopped));
        assert_eq!(write.unwrap_err().message(), CANCELLED);
    }
}

impl JobHost for Alone {
    fn progress(&self, fraction: f64, _message: &str) {
        assert!((0.0..=1.0).contains(&fraction), "progress {fraction}");
    }

    fn cancelled(&self) -> bool {
        false
    }

    fn stage(&self, _header: &EditHeader, _values: &[&[u8]]) -> Result<()> {
        Ok(())
    }
}

fn read(bytes: Vec<u8>) -> Result<Collected> {
    read_columns(bytes, None)
}

/// Reads a file; only these columns are wanted, where they are named.
fn read_columns(bytes: Vec<u8>, columns: Option<&[String]>) -> Result<Collected> {
    let file = FileSource::of_bytes(bytes, "test.las");
    let mut collected = Collected::default();
    let mut sink = CloudSink::new(&mut collected, columns);
    let mut format = Las::new(&HostInfo::default())?;
    format.read(&file, &Settings::default(), &mut sink, &Job::new(&Alone))?;
    Ok(collected)
}

/// The values of a column of the only cloud.
fn column<'a>(found: &'a Collected, name: &str) -> &'a [f64] {
    let cloud = &found.clouds[0];
    let names = || cloud.header.columns.iter().map(|column| &column.name).collect::<Vec<_>>();
    let (i, _) = cloud.header.column(name).unwrap_or_else(|| panic!("{name} in {:?}", names()));
    &cloud.columns[i]
}

fn has(found: &Collected, name: &str) -> bool {
    found.clouds[0].header.column(name).is_some()
}

/// A file in memory that is written.
#[derive(Default)]
struct Written(Mutex<Vec<u8>>);

impl FileHost for Written {
    fn length(&self) -> u64 {
        self.0.lock().unwrap().len() as u64
    }

    fn read_at(&self, _offset: u64, _buffer: &mut [u8]) -> io::Result<usize> {
        Ok(0)
    }

    fn write_at(&self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        let mut file = self.0.lock().unwrap();
        let start = usize::try_from(offset).unwrap();
        let end = start + bytes.len();
        let len = file.len().max(end);
        file.resize(len, 0);
        file[start..end].copy_from_slice(bytes);
        Ok(())
    }
}

/// Values of a column of any type.
pub(crate) enum Owned {
    U8(Vec<u8>),
    I16(Vec<i16>),
    U16(Vec<u16>),
    I32(Vec<i32>),
    U32(Vec<u32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

impl Owned {
    fn values(&self, range: Range<usize>) -> Values<'_> {
        match self {
            Self::U8(vec) => Values::U8(&vec[range]),
            Self::I16(vec) => Values::I16(&vec[range]),
            Self::U16(vec) => Values::U16(&vec[range]),
            Self::I32(vec) => Values::I32(&vec[range]),
            Self::U32(vec) => Values::U32(&vec[range]),
            Self::F32(vec) => Values::F32(&vec[range]),
            Self::F64(vec) => Values::F64(&vec[range]),
        }
    }
}

/// A cloud that is written, in batches of a few points.
#[derive(Default)]
pub(crate) struct Cloud {
    header: CloudHeader,
    columns: Vec<Owned>,
    batch: usize,
    n_clouds: usize,
    n_done: usize,
}

impl Cloud {
    /// One of these positions.
    pub(crate) fn at(positions: Vec<f64>) -> Self {
        let header = CloudHeader { up: UpAxis::Z, ..CloudHeader::default() };
        Self { header, batch: 7, n_clouds: 1, ..Self::default() }.with(
            "position",
            3,
            Owned::F64(positions),
        )
    }

    pub(crate) fn with(mut self, name: &str, components: u32, values: Owned) -> Self {
        let element = values.values(0..0).element();
        self.header.columns.push(FileColumn::new(name, components, element));
        self.columns.push(values);
        self
    }

    fn len(&self) -> usize {
        match &self.columns[0] {
            Owned::F64(positions) => positions.len() / 3,
            _ => 0,
        }
    }
}

impl CloudSourceHost for Cloud {
    fn next_cloud(&mut self) -> Result<Option<CloudHeader>> {
        self.n_done = 0;
        self.n_clouds = self.n_clouds.wrapping_sub(1);
        Ok((self.n_clouds < 10).then(|| self.header.clone()))
    }

    fn next_batch(&mut self) -> Result<Option<CloudView<'_>>> {
        let rows = self.n_done..(self.n_done + self.batch).min(self.len());
        self.n_done = rows.end;
        if rows.is_empty() {
            return Ok(None);
        }
        let columns = self.header.columns.iter().zip(&self.columns).map(|(column, values)| {
            let n = column.components as usize;
            let values = values.values(rows.start * n..rows.end * n);
            let (name, components) = (column.name.as_str(), column.components);
            ColumnView { name, components, generation: 0, values }
        });
        let columns = columns.collect();
        Ok(Some(CloudView { len: rows.len(), columns, ..CloudView::default() }))
    }
}

/// Writes a cloud to a file of this name; its bytes, and what could not be held.
fn write(mut cloud: Cloud, settings: &Settings, name: &str) -> Result<(Vec<u8>, Vec<String>)> {
    let written = Arc::new(Written::default());
    let file = FileSink::new(written.clone(), name);
    let mut format = Las::new(&HostInfo::default())?;
    let mut source = CloudSource::new(&mut cloud);
    let lines = format.write(&mut source, settings, &file, &Job::new(&Alone))?;
    let bytes = std::mem::take(&mut *written.0.lock().unwrap());
    Ok((bytes, lines))
}

/// Numbers that look random and are the same each time.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// A number below `n`.
    fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }
}
