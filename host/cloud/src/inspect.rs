//! What is in a file, told without keeping its points: heads where they say it, else one pass over the positions.

use crate::error::{ReadError, ReadFault};
use crate::formats::lent_table::LentTable;
use crate::formats::plugins::{FormatCall, SharedSink};
use crate::formats::stream::emit_table;
use crate::formats::table_sink::{TableSink, check_count, check_header};
use crate::formats::{obj, off};
use crate::options::ReadOptions;
use crate::read::{SourceFile, open};
use glam::DVec3;
use serde::Serialize;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;
use surfelshop_api::columns::{POSITION, Values};
use surfelshop_api::format::{CloudHeader, CloudSinkHost, PointNode, check_batch};
use surfelshop_geometry::{Bounds, Progress};

/// One cloud of a file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CloudContents {
    /// What the file says of it.
    pub header: CloudHeader,
    /// Number of points.
    pub n_points: u64,
    /// Points whose coordinates are not finite; 0 where only the head was read.
    pub n_not_finite: u64,
    /// Smallest and largest coordinates in the file's common coordinates: of the corners of the announced box
    /// where only the head was read. None where there are no points.
    pub bounds: Option<[DVec3; 2]>,
}

/// What is in a file.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Contents {
    /// The file.
    pub file: String,
    /// The clouds in their order.
    pub clouds: Vec<CloudContents>,
    /// Whether points were read, since the heads do not say how many there are or where.
    pub points_read: bool,
    /// What was said of the file.
    pub warnings: Vec<String>,
    /// Time it took, seconds.
    pub seconds: f64,
}

/// Tells what is in a file. Nothing is estimated, and no points are kept.
///
/// # Errors
/// One line that names the file, what was expected and what was found.
pub fn inspect(path: impl AsRef<Path>, options: &ReadOptions<'_>) -> Result<Contents, ReadError> {
    let path = path.as_ref();
    let started = Instant::now();
    let look = || -> Result<Contents, ReadFault> {
        let heads = LentTable::new(TableSink::of_heads());
        send(path, options, (None, None), &heads.shared(), options.progress)?;
        let heads = heads.take();
        let says_all = |header: &CloudHeader| header.rows.is_some() && header.bounds.is_some();
        let mut contents = Contents { warnings: heads.warnings().to_vec(), ..Contents::default() };
        if heads.headers().all(says_all) {
            contents.clouds = heads.headers().map(of_head).collect();
            return Ok(contents);
        }
        let counted = Arc::new(Mutex::new(BoundsSink::default()));
        let sink: SharedSink = Arc::new(Mutex::new(SharedBounds(Arc::clone(&counted))));
        let columns = [POSITION.to_owned()];
        send(path, options, (Some(&columns), None), &sink, options.progress)?;
        let counted = std::mem::take(&mut *locked(&counted));
        contents.points_read = true;
        contents
            .warnings
            .extend(counted.warnings.into_iter().filter(|line| !heads.warnings().contains(line)));
        let headers = heads.headers().cloned();
        contents.clouds =
            headers.zip(counted.clouds).map(|(header, count)| count.of(header)).collect();
        Ok(contents)
    };
    let mut contents = look().map_err(|fault| ReadError { path: path.to_owned(), fault })?;
    contents.file = path.display().to_string();
    contents.seconds = started.elapsed().as_secs_f64();
    Ok(contents)
}

/// What the heads of a file's clouds say: counts and boxes only where they are there. For text and meshes the file is
/// read.
///
/// # Errors
/// One line that names the file, what was expected and what was found.
pub fn heads(
    path: impl AsRef<Path>,
    options: &ReadOptions<'_>,
) -> Result<Vec<CloudHeader>, ReadError> {
    heads_of(path.as_ref(), options, None)
}

/// The same, with the octree that the points lie in where `nodes` is a list.
pub(crate) fn heads_of(
    path: &Path,
    options: &ReadOptions<'_>,
    nodes: Option<&[PointNode]>,
) -> Result<Vec<CloudHeader>, ReadError> {
    let failed = |fault| ReadError { path: path.to_owned(), fault };
    // As text it would be read to the end.
    if let SourceFile::Ply(file) = open(path, options).map_err(failed)? {
        return Ok(vec![file.facts(None)]);
    }
    let heads = LentTable::new(TableSink::of_heads());
    send(path, options, (None, nodes), &heads.shared(), options.progress).map_err(failed)?;
    let headers: Vec<CloudHeader> = heads.take().headers().cloned().collect();
    match headers.is_empty() {
        true => Err(ReadError { path: path.to_owned(), fault: ReadFault::NoClouds }),
        false => Ok(headers),
    }
}

/// Reads a file's clouds into a sink batch by batch, only these columns where they are named.
///
/// # Errors
/// One line that names the file, what was expected and what was found.
pub fn stream(
    path: impl AsRef<Path>,
    options: &ReadOptions<'_>,
    columns: Option<&[String]>,
    sink: &SharedSink,
) -> Result<(), ReadError> {
    let path = path.as_ref();
    send(path, options, (columns, None), sink, options.progress)
        .map_err(|fault| ReadError { path: path.to_owned(), fault })
}

pub(crate) fn send(
    path: &Path,
    options: &ReadOptions<'_>,
    (columns, nodes): (Option<&[String]>, Option<&[PointNode]>),
    sink: &SharedSink,
    progress: Progress<'_>,
) -> Result<(), ReadFault> {
    let file = open(path, options)?;
    let table = match file {
        SourceFile::Plugin { id, file, name } => {
            let call = FormatCall { name: &name, values: options.values, columns, nodes };
            return options.formats.read(&id, file, call, Arc::clone(sink), progress);
        }
        SourceFile::Ply(file) => {
            return file.stream(options, columns, &mut *locked(sink), progress);
        }
        SourceFile::Obj(body) => obj::read(body, progress)?,
        SourceFile::Off(body) => off::read(body, progress)?,
    };
    emit_table(&table, columns, &mut *locked(sink), progress)
}

fn locked<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // What is in there is only ever changed whole.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn of_head(header: &CloudHeader) -> CloudContents {
    let n_points = header.rows.unwrap_or(0);
    let corners = |[low, high]: [DVec3; 2]| {
        let corner = |i: usize| {
            let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
            header.pose.place(DVec3::new(pick(0), pick(1), pick(2)))
        };
        Bounds::of((0..8).map(corner)).map(|bounds| [bounds.min, bounds.max])
    };
    let bounds = header.bounds.filter(|_| n_points > 0).and_then(corners);
    CloudContents { header: header.clone(), n_points, n_not_finite: 0, bounds }
}

/// Counts and bounds of a cloud, as far as it was read.
struct Count {
    header: CloudHeader,
    n_points: u64,
    n_not_finite: u64,
    bounds: Option<[DVec3; 2]>,
}

impl Count {
    /// The same of the whole header.
    fn of(self, header: CloudHeader) -> CloudContents {
        let Self { n_points, n_not_finite, bounds, .. } = self;
        CloudContents { header, n_points, n_not_finite, bounds }
    }
}

/// Counts points and finds their bounds.
#[derive(Default)]
struct BoundsSink {
    clouds: Vec<Count>,
    warnings: Vec<String>,
}

impl CloudSinkHost for BoundsSink {
    fn begin(&mut self, header: &CloudHeader) -> surfelshop_api::Result<bool> {
        check_header(header)?;
        let header = header.clone();
        self.clouds.push(Count { header, n_points: 0, n_not_finite: 0, bounds: None });
        Ok(true)
    }

    fn batch(&mut self, values: &[Values<'_>]) -> surfelshop_api::Result<()> {
        let Some(count) = self.clouds.last_mut() else {
            return Err(surfelshop_api::Error::new("a batch came before its header"));
        };
        let rows = check_batch(&count.header, values)?;
        count.n_points += rows as u64;
        check_count(&count.header, count.n_points)?;
        let Some((place, _)) = count.header.column(POSITION) else { return Ok(()) };
        let pose = count.header.pose;
        let mut take = |point: DVec3| {
            let point = pose.place(point);
            if !point.is_finite() {
                count.n_not_finite += 1;
                return;
            }
            let [low, high] = count.bounds.get_or_insert([point; 2]);
            (*low, *high) = (low.min(point), high.max(point));
        };
        match values[place] {
            Values::F64(values) => {
                values.as_chunks::<3>().0.iter().for_each(|p| take(DVec3::from_array(*p)));
            }
            Values::F32(values) => {
                let points = values.as_chunks::<3>().0.iter();
                points.for_each(|p| take(DVec3::from_array(p.map(f64::from))));
            }
            _ => {}
        }
        Ok(())
    }

    fn faces(&mut self, _triangles: &[[u32; 3]]) -> surfelshop_api::Result<()> {
        Ok(())
    }

    fn warn(&mut self, line: &str) {
        const MOST: usize = 100;
        if self.warnings.len() < MOST {
            self.warnings.push(line.to_owned());
        }
    }
}

/// The counts, shared with a format's thread.
struct SharedBounds(Arc<Mutex<BoundsSink>>);

impl CloudSinkHost for SharedBounds {
    fn begin(&mut self, header: &CloudHeader) -> surfelshop_api::Result<bool> {
        locked(&self.0).begin(header)
    }

    fn batch(&mut self, values: &[Values<'_>]) -> surfelshop_api::Result<()> {
        locked(&self.0).batch(values)
    }

    fn faces(&mut self, triangles: &[[u32; 3]]) -> surfelshop_api::Result<()> {
        locked(&self.0).faces(triangles)
    }

    fn warn(&mut self, line: &str) {
        locked(&self.0).warn(line);
    }
}
