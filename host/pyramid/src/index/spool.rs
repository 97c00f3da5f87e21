//! Points on the disk, cell by cell: what is read once from the sources, and from then on by place.

use super::cells::{Cell, Cube};
use crate::codec::bytes_of;
use crate::error::PyramidError;
use glam::DVec3;
use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use surfelshop_api::CloudView;
use surfelshop_api::columns::{POSITION, Values};
use surfelshop_api::format::{CloudHeader, FileColumn};
use surfelshop_cloud::{Buffer, files};

/// Points of one cell that lie together in a file: column after column.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Segment {
    pub(crate) cell: Cell,
    pub(crate) offset: u64,
    pub(crate) rows: u32,
    /// Smallest and largest coordinates: points beyond the cube lie in cells at its border.
    pub(crate) bounds: [DVec3; 2],
}

/// A file of segments.
#[derive(Clone, Debug)]
pub(crate) struct Spool {
    pub(crate) path: PathBuf,
    pub(crate) segments: Vec<Segment>,
}

/// Writes points into segments.
pub(crate) struct Spooler<'a> {
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
    pub(crate) fn new(
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
    pub(crate) fn take(&mut self, batch: &CloudView<'_>) -> Result<(), PyramidError> {
        let mut columns: Vec<&[u8]> = Vec::with_capacity(batch.columns.len());
        let mut positions: &[f64] = &[];
        let bytes: Vec<Vec<u8>> =
            batch.columns.iter().map(|column| bytes_of(&column.values)).collect();
        for (column, bytes) in batch.columns.iter().zip(&bytes) {
            columns.push(bytes);
            if let (POSITION, Values::F64(values)) = (column.name, column.values) {
                positions = values;
            }
        }
        self.rows(positions.as_chunks::<3>().0, &columns)
    }

    /// Takes points by their positions and the bytes of all their columns.
    pub(crate) fn rows(
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
    pub(crate) fn finish(mut self) -> Result<Spool, PyramidError> {
        self.flush()?;
        self.file.sync_data().map_err(PyramidError::io(&self.path))?;
        Ok(Spool { path: self.path, segments: self.segments })
    }
}

impl Spool {
    /// The list of segments beside the file, which is written last: where it is there, the file is whole.
    fn list(path: &Path) -> PathBuf {
        path.with_extension("json")
    }

    /// Says that the file is whole.
    pub(crate) fn seal<T: serde::Serialize>(&self, more: &T) -> Result<(), PyramidError> {
        let list = Self::list(&self.path);
        let text = serde_json::to_vec(&(&self.segments, more))
            .map_err(|error| PyramidError::Points(error.to_string()))?;
        files::write_whole(&list, &text).map_err(PyramidError::io(&list))
    }

    /// A file that an earlier run made whole, with what it said besides.
    pub(crate) fn sealed<T: serde::de::DeserializeOwned>(path: &Path) -> Option<(Self, T)> {
        let text = std::fs::read(Self::list(path)).ok()?;
        let (segments, more) = serde_json::from_slice(&text).ok()?;
        path.exists().then_some((Self { path: path.to_owned(), segments }, more))
    }
}

/// Files that are open at a time: systems allow some hundreds.
const MOST_OPEN: usize = 64;

/// Files that are read at many places, each opened when it is first read.
#[derive(Default)]
pub(crate) struct OpenFiles(HashMap<PathBuf, File>);

impl OpenFiles {
    /// Reads as many bytes as there is room for.
    pub(crate) fn read(
        &mut self,
        path: &Path,
        offset: u64,
        bytes: &mut [u8],
    ) -> Result<(), PyramidError> {
        if self.0.len() >= MOST_OPEN && !self.0.contains_key(path) {
            self.0.clear();
        }
        let failed = PyramidError::io(path);
        let file = match self.0.entry(path.to_owned()) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(place) => place.insert(File::open(path).map_err(&failed)?),
        };
        let found = file.seek(SeekFrom::Start(offset));
        found.and_then(|_| file.read_exact(bytes)).map_err(failed)
    }
}

/// Reads segments.
pub(crate) struct SpoolReader<'a> {
    header: &'a CloudHeader,
    files: OpenFiles,
    bytes: Vec<u8>,
}

/// The points of a segment.
pub(crate) struct Rows<'a> {
    pub(crate) positions: Vec<[f64; 3]>,
    /// The bytes of each column.
    pub(crate) columns: Vec<&'a [u8]>,
}

impl<'a> SpoolReader<'a> {
    pub(crate) fn new(header: &'a CloudHeader) -> Self {
        Self { header, files: OpenFiles::default(), bytes: Vec::new() }
    }

    /// The positions alone, which is all that is read.
    pub(crate) fn positions(
        &mut self,
        path: &Path,
        segment: &Segment,
    ) -> Result<Vec<[f64; 3]>, PyramidError> {
        let Some((place, column)) = self.header.column(POSITION) else { return Ok(Vec::new()) };
        let before =
            self.header.columns[..place].iter().map(FileColumn::point_bytes).sum::<usize>();
        let rows = segment.rows as usize;
        self.bytes.resize(rows * column.point_bytes(), 0);
        let offset = segment.offset + (rows * before) as u64;
        self.files.read(path, offset, &mut self.bytes)?;
        Ok(places(&self.bytes))
    }

    pub(crate) fn read(
        &mut self,
        path: &Path,
        segment: &Segment,
    ) -> Result<Rows<'_>, PyramidError> {
        let rows = segment.rows as usize;
        let sizes: Vec<usize> = self.header.columns.iter().map(FileColumn::point_bytes).collect();
        self.bytes.resize(rows * sizes.iter().sum::<usize>(), 0);
        self.files.read(path, segment.offset, &mut self.bytes)?;
        let mut columns = Vec::with_capacity(sizes.len());
        let mut rest = self.bytes.as_slice();
        for size in sizes {
            let (column, more) = rest.split_at(rows * size);
            columns.push(column);
            rest = more;
        }
        let place = self.header.column(POSITION).map(|(place, _)| place);
        let positions = place.and_then(|place| columns.get(place)).copied().unwrap_or_default();
        Ok(Rows { positions: places(positions), columns })
    }
}

/// The bytes of positions as numbers.
fn places(bytes: &[u8]) -> Vec<[f64; 3]> {
    let number = |bytes: &[u8; 8]| f64::from_le_bytes(*bytes);
    let numbers = bytes.as_chunks::<8>().0.iter().map(number).collect::<Vec<_>>();
    numbers.as_chunks::<3>().0.to_vec()
}

/// Bytes of columns as values.
pub(crate) fn buffers(header: &CloudHeader, bytes: &[Vec<u8>]) -> Vec<Buffer> {
    let columns = header.columns.iter().zip(bytes);
    columns.map(|(column, bytes)| Buffer::from_little_endian(column.element, bytes)).collect()
}
