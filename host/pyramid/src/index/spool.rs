//! Points on the disk, cell by cell: what is read once from the sources, and from then on by place.

use super::cells::{Cell, Cube};
use crate::error::PyramidError;
use glam::DVec3;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use surfelshop_api::CloudView;
use surfelshop_api::columns::{POSITION, Values};
use surfelshop_api::format::{CloudHeader, FileColumn};
use surfelshop_cloud::{Buffer, files};

/// Points of one cell that lie together in a file: column after column.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Segment {
    pub(super) cell: Cell,
    pub(super) offset: u64,
    pub(super) rows: u32,
    /// Smallest and largest coordinates: points beyond the cube lie in cells at its border.
    pub(super) bounds: [DVec3; 2],
}

/// A file of segments.
#[derive(Clone, Debug)]
pub(super) struct Spool {
    pub(super) path: PathBuf,
    pub(super) segments: Vec<Segment>,
}

/// Writes points into segments.
pub(super) struct Spooler<'a> {
    header: &'a CloudHeader,
    cube: Cube,
    level: u32,
    path: PathBuf,
    file: File,
    written: u64,
    waiting: BTreeMap<Cell, Waiting>,
    n_bytes: usize,
    budget: usize,
    segments: Vec<Segment>,
}

/// Points of a cell that are not written yet: the bytes of each column.
struct Waiting {
    rows: u32,
    columns: Vec<Vec<u8>>,
    bounds: [DVec3; 2],
}

impl Waiting {
    fn nothing(n_columns: usize) -> Self {
        let bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        Self { rows: 0, columns: vec![Vec::new(); n_columns], bounds }
    }
}

impl<'a> Spooler<'a> {
    /// Begins a file of cells of a level; so many bytes wait in memory at most.
    pub(super) fn new(
        header: &'a CloudHeader,
        cube: Cube,
        level: u32,
        path: &Path,
        budget: usize,
    ) -> Result<Self, PyramidError> {
        let file = File::create(path).map_err(PyramidError::io(path))?;
        let (written, waiting, n_bytes, segments) = Default::default();
        let path = path.to_owned();
        Ok(Self { header, cube, level, path, file, written, waiting, n_bytes, budget, segments })
    }

    /// Takes points with the columns of the header.
    pub(super) fn take(&mut self, batch: &CloudView<'_>) -> Result<(), PyramidError> {
        let mut columns: Vec<&[u8]> = Vec::with_capacity(batch.columns.len());
        let mut positions: &[f64] = &[];
        let bytes: Vec<Vec<u8>> =
            batch.columns.iter().map(|column| little_endian(&column.values)).collect();
        for (column, bytes) in batch.columns.iter().zip(&bytes) {
            columns.push(bytes);
            if let (POSITION, Values::F64(values)) = (column.name, column.values) {
                positions = values;
            }
        }
        self.rows(positions.as_chunks::<3>().0, &columns)
    }

    /// Takes points by their positions and the bytes of all their columns.
    pub(super) fn rows(
        &mut self,
        positions: &[[f64; 3]],
        columns: &[&[u8]],
    ) -> Result<(), PyramidError> {
        let sizes: Vec<usize> = self.header.columns.iter().map(FileColumn::point_bytes).collect();
        let row_bytes: usize = sizes.iter().sum();
        let mut last: Option<(Cell, &mut Waiting)> = None;
        for (row, position) in positions.iter().enumerate() {
            let place = DVec3::from_array(*position);
            let cell = Cell::of(self.cube.code(place), self.level);
            let waiting = match last.take() {
                Some((known, waiting)) if known == cell => waiting,
                _ => self.waiting.entry(cell).or_insert_with(|| Waiting::nothing(sizes.len())),
            };
            let [low, high] = waiting.bounds;
            waiting.bounds = [low.min(place), high.max(place)];
            for ((out, bytes), &size) in waiting.columns.iter_mut().zip(columns).zip(&sizes) {
                out.extend_from_slice(&bytes[row * size..(row + 1) * size]);
            }
            waiting.rows += 1;
            last = Some((cell, waiting));
        }
        self.n_bytes += row_bytes * positions.len();
        if self.n_bytes > self.budget { self.flush() } else { Ok(()) }
    }

    /// Writes what waits, cell after cell.
    fn flush(&mut self) -> Result<(), PyramidError> {
        for (cell, waiting) in std::mem::take(&mut self.waiting) {
            let bytes = waiting.columns.concat();
            self.file.write_all(&bytes).map_err(PyramidError::io(&self.path))?;
            let Waiting { rows, bounds, .. } = waiting;
            self.segments.push(Segment { cell, offset: self.written, rows, bounds });
            self.written += bytes.len() as u64;
        }
        self.n_bytes = 0;
        Ok(())
    }

    /// Ends the file.
    pub(super) fn finish(mut self) -> Result<Spool, PyramidError> {
        self.flush()?;
        self.file.sync_data().map_err(PyramidError::io(&self.path))?;
        Ok(Spool { path: self.path, segments: self.segments })
    }
}

fn little_endian(values: &Values<'_>) -> Vec<u8> {
    macro_rules! bytes {
        ($($variant:ident),*) => {
            match values {
                $(Values::$variant(values) => {
                    values.iter().flat_map(|value| value.to_le_bytes()).collect()
                })*
            }
        };
    }
    bytes!(I8, U8, I16, U16, I32, U32, F32, F64)
}

impl Spool {
    /// The list of segments beside the file, which is written last: where it is there, the file is whole.
    fn list(path: &Path) -> PathBuf {
        path.with_extension("json")
    }

    /// Says that the file is whole.
    pub(super) fn seal<T: serde::Serialize>(&self, more: &T) -> Result<(), PyramidError> {
        let list = Self::list(&self.path);
        let text = serde_json::to_vec(&(&self.segments, more))
            .map_err(|error| PyramidError::Points(error.to_string()))?;
        files::write_whole(&list, &text).map_err(PyramidError::io(&list))
    }

    /// A file that an earlier run made whole, with what it said besides.
    pub(super) fn sealed<T: serde::de::DeserializeOwned>(path: &Path) -> Option<(Self, T)> {
        let text = std::fs::read(Self::list(path)).ok()?;
        let (segments, more) = serde_json::from_slice(&text).ok()?;
        path.exists().then_some((Self { path: path.to_owned(), segments }, more))
    }
}

/// Reads segments of one file.
pub(super) struct SpoolReader<'a> {
    path: &'a Path,
    file: File,
    header: &'a CloudHeader,
    bytes: Vec<u8>,
}

/// The points of a segment.
pub(super) struct Rows<'a> {
    pub(super) positions: Vec<[f64; 3]>,
    /// The bytes of each column.
    pub(super) columns: Vec<&'a [u8]>,
}

impl<'a> SpoolReader<'a> {
    pub(super) fn open(path: &'a Path, header: &'a CloudHeader) -> Result<Self, PyramidError> {
        let file = File::open(path).map_err(PyramidError::io(path))?;
        Ok(Self { path, file, header, bytes: Vec::new() })
    }

    pub(super) fn read(&mut self, segment: &Segment) -> Result<Rows<'_>, PyramidError> {
        let rows = segment.rows as usize;
        let sizes: Vec<usize> = self.header.columns.iter().map(FileColumn::point_bytes).collect();
        self.bytes.resize(rows * sizes.iter().sum::<usize>(), 0);
        let read = self.file.seek(SeekFrom::Start(segment.offset));
        read.and_then(|_| self.file.read_exact(&mut self.bytes))
            .map_err(PyramidError::io(self.path))?;
        let mut columns = Vec::with_capacity(sizes.len());
        let mut rest = self.bytes.as_slice();
        for size in sizes {
            let (column, more) = rest.split_at(rows * size);
            columns.push(column);
            rest = more;
        }
        let place = self.header.column(POSITION).map(|(place, _)| place);
        let positions = place.and_then(|place| columns.get(place)).copied().unwrap_or_default();
        let number = |bytes: &[u8; 8]| f64::from_le_bytes(*bytes);
        let numbers = positions.as_chunks::<8>().0.iter().map(number).collect::<Vec<_>>();
        Ok(Rows { positions: numbers.as_chunks::<3>().0.to_vec(), columns })
    }
}

/// Bytes of columns as values.
pub(super) fn buffers(header: &CloudHeader, bytes: &[Vec<u8>]) -> Vec<Buffer> {
    let columns = header.columns.iter().zip(bytes);
    columns.map(|(column, bytes)| Buffer::from_little_endian(column.element, bytes)).collect()
}
