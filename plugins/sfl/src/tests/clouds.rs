//! Clouds and hosts for tests, and the calls on the format.

use crate::Sfl;
use crate::read::Buffer;
use crate::settings::Settings;
use std::sync::{Arc, Mutex};
use surfelshop_api::columns::{COLOR, CloudView, ColumnView, NORMAL, POSITION, RADIUS};
use surfelshop_api::format::{
    CloudHeader, CloudSink, CloudSource, CloudSourceHost, Collected, CollectedCloud, FileColumn,
    FileHost, FileSink, FileSource, UpAxis,
};
use surfelshop_api::job::JobHost;
use surfelshop_api::tool::EditHeader;
use surfelshop_api::{Format, HostInfo, Job, Result};

/// A host of jobs that only checks what it is told.
pub(super) struct QuietHost;

impl JobHost for QuietHost {
    fn progress(&self, fraction: f64, message: &str) {
        assert!((0.0..=1.0).contains(&fraction), "{fraction} {message}");
    }

    fn cancelled(&self) -> bool {
        false
    }

    fn stage(&self, _header: &EditHeader, _values: &[&[u8]]) -> Result<()> {
        unreachable!("formats stage nothing")
    }
}

fn format() -> Sfl {
    Sfl::new(&HostInfo::default()).unwrap()
}

/// Reads a file whole.
pub(super) fn read(bytes: &[u8]) -> Result<Collected> {
    read_columns(bytes, None)
}

/// Reads these columns of a file.
pub(super) fn read_columns(bytes: &[u8], columns: Option<&[String]>) -> Result<Collected> {
    let mut collected = Collected::default();
    let file = FileSource::of_bytes(bytes.to_vec(), "test.sfl");
    let mut sink = CloudSink::new(&mut collected, columns);
    format().read(&file, &Settings::default(), &mut sink, &Job::new(&QuietHost))?;
    Ok(collected)
}

/// The values of a column; empty where there is none.
pub(super) fn column(cloud: &CollectedCloud, name: &str) -> Vec<f64> {
    cloud.header.column(name).map(|(i, _)| cloud.columns[i].clone()).unwrap_or_default()
}

/// A cloud that is written.
#[derive(Clone)]
pub(super) struct TestCloud {
    pub(super) header: CloudHeader,
    pub(super) columns: Vec<(FileColumn, Buffer)>,
    pub(super) len: usize,
    /// Surfels of a batch.
    pub(super) batch: usize,
}

impl TestCloud {
    /// A cloud with positions.
    pub(super) fn new(positions: &[[f64; 3]]) -> Self {
        let header =
            CloudHeader { name: "test".to_owned(), up: UpAxis::Y, ..CloudHeader::default() };
        let cloud = Self { header, columns: Vec::new(), len: positions.len(), batch: 7 };
        cloud.with(POSITION, 3, Buffer::F64(positions.as_flattened().to_vec()))
    }

    /// The same with a column.
    pub(super) fn with(mut self, name: &str, components: u32, values: Buffer) -> Self {
        assert_eq!(values.values().len(), self.len * components as usize, "{name}");
        let column = FileColumn::new(name, components, values.values().element());
        self.header.columns.push(column.clone());
        self.columns.push((column, values));
        self
    }
}

/// What has clouds for the format.
struct TestSource<'a> {
    clouds: &'a [TestCloud],
    /// The cloud after the current one, and surfels of that which were handed over.
    next: usize,
    done: usize,
}

impl CloudSourceHost for TestSource<'_> {
    fn next_cloud(&mut self) -> Result<Option<CloudHeader>> {
        self.next += 1;
        self.done = 0;
        Ok(self.clouds.get(self.next - 1).map(|cloud| cloud.header.clone()))
    }

    fn next_batch(&mut self) -> Result<Option<CloudView<'_>>> {
        let cloud = &self.clouds[self.next - 1];
        let end = cloud.len.min(self.done + cloud.batch);
        if self.done == end {
            return Ok(None);
        }
        let rows = self.done..end;
        self.done = end;
        let columns = cloud.columns.iter().map(|(column, values)| ColumnView {
            name: &column.name,
            components: column.components,
            generation: 0,
            values: values.slice(
                rows.start * column.components as usize..rows.end * column.components as usize,
            ),
        });
        let columns = columns.collect();
        Ok(Some(CloudView { len: rows.len(), columns, ..CloudView::default() }))
    }
}

/// A file that is written, without gaps.
#[derive(Default)]
struct WrittenFile(Mutex<Vec<u8>>);

impl FileHost for WrittenFile {
    fn length(&self) -> u64 {
        self.0.lock().unwrap().len() as u64
    }

    fn read_at(&self, _offset: u64, _buffer: &mut [u8]) -> std::io::Result<usize> {
        Err(std::io::Error::other("the file is only written"))
    }

    fn write_at(&self, offset: u64, bytes: &[u8]) -> std::io::Result<()> {
        let mut file = self.0.lock().unwrap();
        let start = usize::try_from(offset).unwrap();
        assert!(start <= file.len(), "a gap of {} bytes", start - file.len());
        let end = start + bytes.len();
        let len = file.len().max(end);
        file.resize(len, 0);
        file[start..end].copy_from_slice(bytes);
        Ok(())
    }
}

/// Writes clouds; the file and what was said of it.
pub(super) fn write_with(
    clouds: &[TestCloud],
    settings: &Settings,
) -> Result<(Vec<u8>, Vec<String>)> {
    let file = Arc::new(WrittenFile::default());
    let mut source = TestSource { clouds, next: 0, done: 0 };
    let mut source = CloudSource::new(&mut source);
    let sink = FileSink::new(file.clone(), "test.sfl");
    let lines = format().write(&mut source, settings, &sink, &Job::new(&QuietHost))?;
    let bytes = file.0.lock().unwrap().clone();
    Ok((bytes, lines))
}

/// Writes clouds with the usual settings.
pub(super) fn write(clouds: &[TestCloud]) -> (Vec<u8>, Vec<String>) {
    write_with(clouds, &Settings::default()).unwrap()
}

/// Numbers that look random, the same for the same seed.
pub(super) struct Numbers(pub(super) u64);

impl Numbers {
    /// The next number. Source: Steele et al. 2014, `SplitMix64`.
    pub(super) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A whole number below another.
    pub(super) fn below(&mut self, end: usize) -> usize {
        usize::try_from(self.next() % end as u64).unwrap()
    }

    /// A number from -1 to 1 that 32-bit floats hold.
    pub(super) fn single(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 23) as f32 - 1.0
    }
}

/// A cloud of discs as `Pointshop3D` usually has them, on a sphere.
pub(super) fn discs(len: usize) -> TestCloud {
    let mut numbers = Numbers(len as u64);
    let mut of = |n: usize| (0..n * len).map(|_| numbers.single()).collect::<Vec<_>>();
    let positions: Vec<[f64; 3]> = of(3)
        .chunks_exact(3)
        .map(|p| [f64::from(p[0]), f64::from(p[1]), f64::from(p[2])])
        .collect();
    let normals = of(3)
        .chunks_exact(3)
        .flat_map(|n| surfelshop_api::glam::Vec3::from_slice(n).normalize_or_zero().to_array())
        .collect();
    let radii = of(1).iter().map(|r| r.abs()).collect();
    let colors = of(3).iter().map(|c| (c.abs() * 255.0) as u8).collect();
    TestCloud::new(&positions)
        .with(NORMAL, 3, Buffer::F32(normals))
        .with(RADIUS, 1, Buffer::F32(radii))
        .with(COLOR, 3, Buffer::U8(colors))
}
