//! Tests through `Format`, with files in memory.

mod compressed_ply;
mod compressed_ply_writing;
mod packed;
mod sog;
mod sog_file;
mod sog_writing;
mod splat;
mod spz;
mod spz_damage;
mod spz_writing;

use crate::formats::{CompressedPly, Sog, Splat, Spz};
use std::io;
use std::sync::{Arc, Mutex};
use surfelshop_api::columns::{ColumnView, Values};
use surfelshop_api::format::{
    CloudHeader, CloudSink, CloudSource, CloudSourceHost, Collected, FileColumn, FileHost,
    FileSink, FileSource,
};
use surfelshop_api::job::{CANCELLED, JobHost};
use surfelshop_api::prelude::{Error, HostInfo, Job, Result};
use surfelshop_api::tool::EditHeader;
use surfelshop_api::{CloudView, Format};

/// A host of a job that nobody watches, or that the user stops.
pub(crate) struct Host {
    stopped: bool,
}

pub(crate) const HOST: Host = Host { stopped: false };

impl JobHost for Host {
    fn progress(&self, fraction: f64, _message: &str) {
        assert!((0.0..=1.0).contains(&fraction), "{fraction}");
    }

    fn cancelled(&self) -> bool {
        self.stopped
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

    fn read_at(&self, _offset: u64, _buffer: &mut [u8]) -> io::Result<usize> {
        Err(io::Error::other("it is only written"))
    }

    fn write_at(&self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        let mut file = self.0.lock().unwrap();
        assert_eq!(offset, file.len() as u64);
        file.extend(bytes);
        Ok(())
    }
}

/// A column in memory.
#[derive(Clone)]
enum Owned {
    U8(Vec<u8>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

impl Owned {
    fn slice(&self, from: usize, to: usize) -> Values<'_> {
        match self {
            Self::U8(v) => Values::U8(&v[from..to]),
            Self::F32(v) => Values::F32(&v[from..to]),
            Self::F64(v) => Values::F64(&v[from..to]),
        }
    }
}

/// A cloud that is written, in batches of two points.
#[derive(Clone, Default)]
struct TestCloud {
    header: CloudHeader,
    columns: Vec<Owned>,
    n: usize,
    n_done: usize,
    begun: bool,
}

impl TestCloud {
    fn at(positions: Vec<f64>) -> Self {
        let n = positions.len() / 3;
        Self { n, ..Self::default() }.column("position", 3, Owned::F64(positions))
    }

    fn column(mut self, name: &str, components: u32, values: Owned) -> Self {
        let element = values.slice(0, self.n * components as usize).element();
        self.header.columns.push(FileColumn::new(name, components, element));
        self.columns.push(values);
        self
    }

    /// A cloud of columns that were read.
    fn of(found: &Collected) -> Self {
        let cloud = &found.clouds[0];
        let mut made = Self::at(values(found, "position").to_vec());
        made.header.comments.clone_from(&cloud.header.comments);
        for (column, values) in cloud.header.columns.iter().zip(&cloud.columns).skip(1) {
            let values = values.iter().map(|value| *value as f32).collect();
            made = made.column(&column.name, column.components, Owned::F32(values));
        }
        made
    }
}

impl CloudSourceHost for TestCloud {
    fn next_cloud(&mut self) -> Result<Option<CloudHeader>> {
        let first = !std::mem::replace(&mut self.begun, true);
        Ok(first.then(|| self.header.clone()))
    }

    fn next_batch(&mut self) -> Result<Option<CloudView<'_>>> {
        let from = self.n_done;
        if from >= self.n {
            return Ok(None);
        }
        self.n_done = (from + 2).min(self.n);
        let columns = self.header.columns.iter().zip(&self.columns).map(|(column, values)| {
            let c = column.components as usize;
            let values = values.slice(from * c, self.n_done * c);
            ColumnView { name: &column.name, components: column.components, generation: 1, values }
        });
        let columns = columns.collect();
        Ok(Some(CloudView { len: self.n_done - from, columns, ..CloudView::default() }))
    }
}

/// Writes a cloud; the file, and what it does not hold.
fn write<F: Format<Params = ()>>(mut cloud: TestCloud) -> Result<(Vec<u8>, Vec<String>)> {
    let file = Arc::new(WrittenFile::default());
    let lines = F::new(&HostInfo::default())?.write(
        &mut CloudSource::new(&mut cloud),
        &(),
        &FileSink::new(file.clone(), "a"),
        &Job::new(&HOST),
    )?;
    let bytes = std::mem::take(&mut *file.0.lock().unwrap());
    Ok((bytes, lines))
}

/// Reads a file with these columns, or all.
fn read_columns<F: Format<Params = ()>>(bytes: &[u8], columns: &[&str]) -> Result<Collected> {
    let columns: Vec<String> = columns.iter().map(|name| (*name).to_owned()).collect();
    let mut found = Collected::default();
    F::new(&HostInfo::default())?.read(
        &FileSource::of_bytes(bytes.to_vec(), "a"),
        &(),
        &mut CloudSink::new(&mut found, (!columns.is_empty()).then_some(&columns)),
        &Job::new(&HOST),
    )?;
    Ok(found)
}

fn read<F: Format<Params = ()>>(bytes: &[u8]) -> Result<Collected> {
    read_columns::<F>(bytes, &[])
}

/// The line that a file is refused with.
fn refusal<F: Format<Params = ()>>(bytes: &[u8]) -> String {
    let line = read::<F>(bytes).map(|found| found.clouds[0].header.rows).unwrap_err().to_string();
    assert!(!line.contains('\n') && line.contains("expected"), "{line}");
    line
}

/// Reads what may be damaged: a line, or a cloud of numbers. Whether it was read.
fn survives<F: Format<Params = ()>>(bytes: &[u8]) -> bool {
    let found = match read::<F>(bytes) {
        Ok(found) => found,
        Err(error) => {
            let line = error.to_string();
            assert!(!line.is_empty() && !line.contains('\n'), "{line}");
            return false;
        }
    };
    let cloud = &found.clouds[0];
    for (column, values) in cloud.header.columns.iter().zip(&cloud.columns) {
        // The host drops points without places.
        let finite = values.iter().all(|value| value.is_finite());
        assert!(finite || column.name == "position", "{}", column.name);
        if column.name == "splat_rotation" {
            let (rotations, _) = values.as_chunks::<4>();
            let lengths = rotations.iter().map(|q| q.iter().map(|c| c * c).sum::<f64>());
            assert!(lengths.into_iter().all(|length| (length - 1.0).abs() < 1e-5));
        }
    }
    true
}

/// Cuts a file short everywhere, and changes each of its bytes in some ways. How many could be read all the same.
fn damage<F: Format<Params = ()>>(file: &[u8]) -> (usize, usize) {
    let cut = (0..file.len()).filter(|len| survives::<F>(&file[..*len])).count();
    let mut n_read = 0;
    for i in 0..file.len() {
        for change in [0xff, 1, 0x10, 0x80] {
            let mut damaged = file.to_vec();
            damaged[i] ^= change;
            n_read += usize::from(survives::<F>(&damaged));
        }
    }
    (cut, n_read)
}

/// A column that was read.
fn values<'a>(found: &'a Collected, name: &str) -> &'a [f64] {
    let cloud = &found.clouds[0];
    let (place, _) = cloud.header.column(name).unwrap_or_else(|| panic!("no column `{name}`"));
    &cloud.columns[place]
}

/// That a column has these values, nearly.
#[track_caller]
fn near(found: &Collected, name: &str, expected: &[f64]) {
    let values = values(found, name);
    let off = values.iter().zip(expected).map(|(a, b)| (a - b).abs() / b.abs().max(1.0));
    let off = off.fold(0.0, f64::max);
    assert!(values.len() == expected.len() && off < 1e-5, "{name}: {values:?}, not {expected:?}");
}

/// The bytes of a file of many numbers that look random.
fn noise(len: usize, seed: u64) -> Vec<u8> {
    let mut state = seed | 1;
    let mut next = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 24) as u8
    };
    (0..len).map(|_| next()).collect()
}

#[test]
fn work_that_is_stopped_ends_in_a_line() {
    fn stopped<F: Format<Params = ()>>(bytes: Vec<u8>) {
        let mut found = Collected::default();
        let job = Job::new(&Host { stopped: true });
        let mut format = F::new(&HostInfo::default()).unwrap();
        let file = FileSource::of_bytes(bytes, "a");
        let line = format.read(&file, &(), &mut CloudSink::new(&mut found, None), &job);
        assert_eq!(line.unwrap_err().message(), CANCELLED);
    }
    for version in 1..=4 {
        stopped::<Spz>(packed::Packed::noise(version, 1, 5).file());
    }
    stopped::<Splat>(vec![0; 64]);
    stopped::<Sog>(sog_file::Pixels::noise(5, 1).file());
    stopped::<CompressedPly>(compressed_ply::file(1, true));
}
