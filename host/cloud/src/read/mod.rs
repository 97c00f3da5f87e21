//! Reading a cloud: the format is recognised by content, then by name.

pub(crate) mod preview;

use crate::assemble;
use crate::cloud::source::Source;
use crate::error::{ReadError, ReadFault, quoted};
use crate::files;
use crate::formats::beside::with_files_beside;
use crate::formats::lent_table::LentTable;
use crate::formats::plugins::FormatCall;
use crate::formats::positioned::SystemFile;
use crate::formats::table_sink::TableSink;
use crate::formats::{Body, obj, off, ply, unpacked};
use crate::options::ReadOptions;
use crate::summary::Loaded;
use crate::table::Table;
use preview::Previews;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;
use surfelshop_api::format::FileHost;
use surfelshop_geometry::{Progress, part};

/// How pyramids begin, which are drawn and not read.
pub const PYRAMID: &[u8; 8] = b"\x89SURFEL\n";

/// Bytes shown of a file whose format is unknown.
const MAGIC: usize = 64;

/// Reads a cloud from a file, recognising the format by content, and by name where the content does not tell.
///
/// # Errors
/// One line that names the file, what was expected and what was found.
pub fn read(path: impl AsRef<Path>, options: &ReadOptions<'_>) -> Result<Loaded, ReadError> {
    let path = path.as_ref();
    let started = Instant::now();
    let load = || -> Result<Loaded, ReadFault> {
        let file = open(path, options)?;
        let reading = file.share_of_reading(options);
        let (table, source) = file.read(options, &part(options.progress, 0.0..reading))?;
        if let Some(previews) = Previews::of(options) {
            let progress = part(options.progress, reading..reading);
            previews.show_some(&table, &source, &ReadOptions { progress: &progress, ..*options });
        }
        let options = ReadOptions { progress: &part(options.progress, reading..1.0), ..*options };
        let loaded = assemble::cloud(table, source, &options)?;
        if (options.progress)(1.0).is_break() { Err(ReadFault::Cancelled) } else { Ok(loaded) }
    };
    let mut loaded = load().map_err(|fault| ReadError { path: path.to_owned(), fault })?;
    loaded.summary.file = path.display().to_string();
    loaded.summary.seconds = started.elapsed().as_secs_f64();
    Ok(loaded)
}

/// A file whose format is known.
pub(crate) enum SourceFile {
    Ply(Box<ply::File<BufReader<File>>>),
    Obj(Body<BufReader<File>>),
    Off(Body<BufReader<File>>),
    Plugin {
        /// The format's id.
        id: String,
        file: Arc<dyn FileHost>,
        /// The file's name, without its folder.
        name: String,
    },
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
            // Scans have neither normals nor radii, as a rule.
            Self::Plugin { .. } => 0.2,
        }
    }

    fn read(
        self,
        options: &ReadOptions<'_>,
        progress: Progress<'_>,
    ) -> Result<(Table, Source), ReadFault> {
        let table = match self {
            Self::Ply(file) => {
                let header = file.facts(None);
                let table = file.read(options, progress)?;
                return Ok((table, Source::of_headers([&header].into_iter())));
            }
            Self::Obj(body) => obj::read(body, progress),
            Self::Off(body) => off::read(body, progress),
            Self::Plugin { id, file, name } => {
                let sink = LentTable::new(TableSink::with_previews(Previews::of(options)));
                let call =
                    FormatCall { name: &name, values: options.values, ..FormatCall::default() };
                let read = options.formats.read(&id, file, call, sink.shared(), progress);
                let table = sink.take();
                // What ran out is said in the words of all reads.
                if let Some(fault) = table.memory_fault() {
                    return Err(fault);
                }
                read?;
                return table.finish();
            }
        };
        Ok((table?, Source::default()))
    }
}

/// What a PLY file of packed splats is called, whatever it is called.
const PACKED_PLY: &str = "splats.compressed.ply";

/// Opens a file and finds out what format it has.
pub(crate) fn open(path: &Path, options: &ReadOptions<'_>) -> Result<SourceFile, ReadFault> {
    // Plugins at work may take the program to another folder.
    let path = &files::absolute(path);
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    if let Some(archive) = unpacked::open(path)?
        && let Some(id) = options.formats.by_bytes(archive.head())
    {
        return Ok(SourceFile::Plugin { id, file: Arc::new(archive), name });
    }
    let in_folder = index_in(path, options);
    let path = in_folder.as_deref().unwrap_or(path);
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
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
    if head.starts_with(PYRAMID) {
        return Err(ReadFault::Pyramid);
    }
    let length = metadata.len();
    let of_plugin = |id: String, reader: BufReader<File>| {
        let file = SystemFile::new(reader.into_inner(), length);
        let file = with_files_beside(path, file, options.formats.beside(&id));
        SourceFile::Plugin { id, file, name: name.clone() }
    };
    match options.format {
        Some("ply") => return Ok(SourceFile::Ply(Box::new(ply::File::open(reader, length)?))),
        Some("obj") => return Ok(SourceFile::Obj(Body::new(reader, length))),
        Some("off") => return Ok(SourceFile::Off(Body::new(reader, length))),
        Some(id) => return Ok(of_plugin(id.to_owned(), reader)),
        None => {}
    }
    // Packed splats are in PLY files, too, which say nothing to those who read a value a property.
    if ply::is_packed(head)
        && let Some(id) = options.formats.by_name(PACKED_PLY, false)
    {
        return Ok(of_plugin(id, reader));
    }
    if ply::is_ply(head) {
        return Ok(SourceFile::Ply(Box::new(ply::File::open(reader, length)?)));
    }
    if off::is_off(head) {
        return Ok(SourceFile::Off(Body::new(reader, length)));
    }
    if let Some(id) = options.formats.by_bytes(head) {
        return Ok(of_plugin(id, reader));
    }
    let is_named_obj = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("obj"));
    if !is_named_obj && let Some(id) = options.formats.by_name(&name, false) {
        return Ok(of_plugin(id, reader));
    }
    if obj::is_obj(head, is_named_obj) {
        return Ok(SourceFile::Obj(Body::new(reader, length)));
    }
    let found = quoted(&head[..head.len().min(MAGIC)]);
    Err(ReadFault::UnknownFormat { known: known(&options.formats.endings(false)), found })
}

/// The file of a folder that a format knows by its whole name, such as `metadata.json`: the folder is named for it.
fn index_in(path: &Path, options: &ReadOptions<'_>) -> Option<PathBuf> {
    if !path.is_dir() {
        return None;
    }
    let endings = options.formats.endings(false).into_iter();
    let mut names = endings.filter(|ending| ending.contains('.')).map(|name| path.join(name));
    names.find(|path| path.is_file())
}

/// All formats by their endings, for messages: `PLY, OBJ or OFF`.
pub(crate) fn known(endings: &[String]) -> String {
    let built_in = ["ply", "obj", "off"].into_iter();
    let mut names: Vec<String> =
        built_in.chain(endings.iter().map(String::as_str)).map(str::to_uppercase).collect();
    let last = names.pop().unwrap_or_default();
    format!("{} or {last}", names.join(", "))
}
