//! Reading a cloud: the format is recognised by content.

use crate::assemble;
use crate::error::{ReadError, ReadFault, quoted};
use crate::files;
use crate::formats::Body;
use crate::formats::{obj, off, ply};
use crate::options::ReadOptions;
use crate::summary::Loaded;
use crate::table::Table;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::time::Instant;
use surfelshop_geometry::{Progress, part};

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
enum SourceFile {
    Ply(Box<ply::File<BufReader<File>>>),
    Obj(Body<BufReader<File>>),
    Off(Body<BufReader<File>>),
}

impl SourceFile {
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
fn open(path: &Path) -> Result<SourceFile, ReadFault> {
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
        return Ok(SourceFile::Ply(Box::new(ply::File::open(reader, length)?)));
    }
    if off::is_off(head) {
        return Ok(SourceFile::Off(Body::new(reader, length)));
    }
    let ending = path.extension().unwrap_or_default();
    if obj::is_obj(head, ending.eq_ignore_ascii_case("obj")) {
        return Ok(SourceFile::Obj(Body::new(reader, length)));
    }
    Err(ReadFault::UnknownFormat { found: quoted(&head[..head.len().min(MAGIC)]) })
}
