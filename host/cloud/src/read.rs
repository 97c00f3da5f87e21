use crate::assemble;
use crate::body::Body;
use crate::cloud::Cloud;
use crate::error::{ReadError, ReadFault, quoted};
use crate::summary::Summary;
use crate::table::Table;
use crate::{files, obj, off, ply};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::time::Instant;
use surfelshop_geometry::{Progress, normals, part, silent};

/// How a file is read.
#[derive(Clone, Copy)]
pub struct ReadOptions<'a> {
    /// Neighbours that missing normals are fitted to.
    pub n_neighbours: usize,
    /// The radius of every point of a file that gives none, counted as given; where it is `None`
    /// or not positive, radii are estimated.
    pub radius: Option<f32>,
    /// Takes how far the work is, in [0, 1], and may ask it to stop.
    pub progress: Progress<'a>,
}

impl Default for ReadOptions<'_> {
    fn default() -> Self {
        Self { n_neighbours: normals::DEFAULT_NEIGHBOURS, radius: None, progress: &silent }
    }
}

/// A cloud and how it came to be.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The cloud: at least `position`, `normal` and `radius`.
    pub cloud: Cloud,
    /// What was dropped, repaired and estimated.
    pub summary: Summary,
}

/// Bytes shown of a file whose format is unknown.
const MAGIC: usize = 64;

/// Reads a cloud from a file, recognising the format by content.
///
/// # Errors
/// One line that names the file, what was expected and what was found.
pub fn read(path: impl AsRef<Path>, options: &ReadOptions<'_>) -> Result<Loaded, ReadError> {
    let path = path.as_ref();
    let started = Instant::now();
    let load = || -> Result<Loaded, ReadFault> {
        let file = open(path)?;
        let reading = file.share_of_reading(options);
        let table = file.read(options, &part(options.progress, 0.0..reading))?;
        let options = ReadOptions { progress: &part(options.progress, reading..1.0), ..*options };
        let loaded = assemble::cloud(table, &options)?;
        if (options.progress)(1.0).is_break() { Err(ReadFault::Cancelled) } else { Ok(loaded) }
    };
    let mut loaded = load().map_err(|fault| ReadError { path: path.to_owned(), fault })?;
    loaded.summary.file = path.display().to_string();
    loaded.summary.seconds = started.elapsed().as_secs_f64();
    Ok(loaded)
}

/// A file whose format is known.
enum Opened {
    Ply(Box<ply::File<BufReader<File>>>),
    Obj(Body<BufReader<File>>),
    Off(Body<BufReader<File>>),
}

impl Opened {
    /// Share of the work that is reading rather than estimating.
    fn share_of_reading(&self, options: &ReadOptions<'_>) -> f64 {
        match self {
            Self::Ply(file) => assemble::share_of_reading(file.names(), file.has_faces(), options),
            // What is in them shows when they are read; they are meshes, as a rule.
            Self::Obj(_) | Self::Off(_) => {
                assemble::share_of_reading(std::iter::empty(), true, options)
            }
        }
    }

    fn read(self, options: &ReadOptions<'_>, progress: Progress<'_>) -> Result<Table, ReadFault> {
        match self {
            Self::Ply(file) => file.read(options, progress),
            Self::Obj(body) => obj::read(body, progress),
            Self::Off(body) => off::read(body, progress),
        }
    }
}

/// Opens a file and finds out what points it has.
fn open(path: &Path) -> Result<Opened, ReadFault> {
    // Counts are checked against the length, which a pipe or a device does not have.
    let (file, metadata) = files::open(path)?;
    let mut reader = BufReader::with_capacity(1 << 16, file);
    let head = reader.fill_buf()?;
    if head.is_empty() {
        return Err(ReadFault::Empty);
    }
    if head.starts_with(b"version https://git-lfs") {
        return Err(ReadFault::LfsPointer);
    }
    let length = metadata.len();
    if ply::is_ply(head) {
        return Ok(Opened::Ply(Box::new(ply::File::open(reader, length)?)));
    }
    if off::is_off(head) {
        return Ok(Opened::Off(Body::new(reader, length)));
    }
    let ending = path.extension().unwrap_or_default();
    if obj::is_obj(head, ending.eq_ignore_ascii_case("obj")) {
        return Ok(Opened::Obj(Body::new(reader, length)));
    }
    Err(ReadFault::UnknownFormat { found: quoted(&head[..head.len().min(MAGIC)]) })
}
