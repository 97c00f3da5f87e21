//! Files from format to format, batch by batch: memory does not grow with the file where neither format needs
//! the whole. Nothing is estimated, and values keep their types; splats as trainers write them become the columns that
//! the host has for them, but from PLY file to PLY file.
//!
//! The reader works on the caller's thread and hands batches over a short queue; the writer takes them on a
//! thread of its own. Points whose coordinates are not finite are left out.

mod check;
mod collect;
mod counts;
mod heads;
mod nodes;
mod select;
mod target;
mod transfer;
mod union;

use crate::assemble::NARROW_COLORS;
use crate::error::{ReadError, ReadFault, WriteError};
use crate::files::replace_at;
use crate::formats::plugins::{FormatCall, SharedSink, WriteFault};
use crate::formats::ply;
use crate::inspect::stream;
use crate::options::{ColorBits, ReadOptions, WriteOptions};
use crate::write::writer;
use heads::Heads;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};
use surfelshop_api::columns::COLOR;
use surfelshop_geometry::{part, silent};
use target::Types;
use transfer::{TransferSink, transfer};

pub use crate::assemble::{SideGuide, narrowed};
pub use check::narrow_colors;
pub use collect::{Collected, Collection, assembled};
pub use nodes::{nodes_of, tree_of};
pub use select::{CropBox, Selection};

/// Why files were not converted.
#[derive(Debug, thiserror::Error)]
pub enum ConvertError {
    /// A file could not be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The file could not be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// Nothing is left of what was selected.
    #[error("{0}")]
    Selection(String),
}

impl ConvertError {
    /// Whether the user asked to stop.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        matches!(self, Self::Read(ReadError { fault: ReadFault::Cancelled, .. }))
    }
}

/// What came of a conversion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Converted {
    /// Points of all files.
    pub n_read: u64,
    /// Points written.
    pub n_written: u64,
    /// Points left out because a coordinate is not finite.
    pub n_not_finite: u64,
    /// Columns of the clouds that were written.
    pub columns: Vec<String>,
    /// What was said of the files that were read.
    pub warnings: Vec<String>,
    /// What the format could not hold.
    pub lost: Vec<String>,
}

/// Reads files and writes their clouds to one, in the format that its ending names.
///
/// Clouds of a file stay apart where the format holds several with their poses, and `merge` does not ask for
/// one; else they become one in common coordinates, with a column `scan`.
///
/// # Errors
/// One line that names the file; what stood there before still does.
pub fn convert(
    inputs: &[PathBuf],
    output: &Path,
    selection: &Selection,
    merge: bool,
    read: &ReadOptions<'_>,
    write: &WriteOptions<'_>,
) -> Result<Converted, ConvertError> {
    // A wrong ending is refused before anything is read.
    let id = writer(output, write)?;
    let several = id.as_ref().is_some_and(|id| write.formats.takes_several(id)) && !merge;
    let heads = Heads::of(inputs, read, id.is_none())?;
    let files = heads.files(inputs);
    let Heads { mut headers, whole, trained_splats, .. } = heads;
    check::selection(&headers, selection).map_err(ConvertError::Selection)?;
    if !several {
        check::one_unit(&headers).map_err(ConvertError::Selection)?;
    }
    let narrow_colors = selection.keeps(COLOR) && check::colors_are_narrow(inputs, &headers, read)?;
    if narrow_colors {
        headers.iter_mut().for_each(check::narrow_colors);
    }
    let remarks = check::remarks((&headers, &files), selection, !several);
    let grids = id.as_ref().is_some_and(|id| write.formats.takes_grids(id));
    let merged = (!several).then(|| union::header(&headers, selection));
    let columns = match &merged {
        Some(header) => header.columns.clone(),
        None => union::header(&headers, selection).columns,
    };
    let types = Types { wide_positions: id.is_some(), narrow_colors, trained_splats, grids };
    let (sender, source) = transfer(merged.clone(), selection.clone(), types);
    let counts = Arc::clone(&source.counts);
    let ended = std::thread::scope(|scope| {
        // Progress is told by the reader, on this thread.
        let (formats, ascii, values) = (write.formats, write.ascii, write.values);
        let id = id.as_deref();
        let writing = scope.spawn(move || {
            let options = WriteOptions { formats, ascii, values, ..WriteOptions::default() };
            write_clouds(output, id, source, &options)
        });
        let read = send(inputs, &whole, sender, read);
        let written = writing.join().unwrap_or_else(|_panicked| {
            let error = io::Error::other("the writer ended before it was done");
            Err(WriteError::Io { path: output.to_owned(), error })
        });
        (read, written)
    });
    let (n_read, n_written) =
        (counts.read.load(Ordering::Relaxed), counts.written.load(Ordering::Relaxed));
    let (mut warnings, mut lost) = match ended {
        (Err(fault), Err(_)) if !matches!(fault, Sending::WriterGone) => match fault {
            Sending::Read(error) => return Err(error.into()),
            Sending::WriterGone => return Err(refused(output).into()),
        },
        (_, Err(error)) => return Err(error.into()),
        (Err(Sending::Read(error)), Ok(_)) => return Err(error.into()),
        (Err(Sending::WriterGone), Ok(lost)) => (Vec::new(), lost),
        (Ok(warnings), Ok(lost)) => (warnings, lost),
    };
    if narrow_colors && read.color_bits == ColorBits::Told {
        warnings.push(NARROW_COLORS.to_owned());
    }
    lost.extend(remarks);
    Ok(Converted {
        n_read,
        n_written,
        n_not_finite: counts.not_finite.load(Ordering::Relaxed),
        columns: columns.into_iter().map(|column| column.name).collect(),
        warnings,
        lost,
    })
}

fn refused(output: &Path) -> WriteError {
    let error = io::Error::other("the writer took no more");
    WriteError::Io { path: output.to_owned(), error }
}

/// Why a file was not sent to its end.
enum Sending {
    Read(ReadError),
    /// The writer has ended, and says why.
    WriterGone,
}

/// Sends the clouds of all files, of those that are `whole` with all columns.
fn send(
    inputs: &[PathBuf],
    whole: &[bool],
    sender: TransferSink,
    options: &ReadOptions<'_>,
) -> Result<Vec<String>, Sending> {
    let state = sender.state();
    let columns = sender.columns();
    let sender = Arc::new(Mutex::new(sender));
    let sink: SharedSink = sender.clone();
    let ended = inputs.iter().enumerate().try_for_each(|(i, input)| {
        let share = |i: usize| i as f64 / inputs.len() as f64;
        let progress = part(options.progress, share(i)..share(i + 1));
        let options = ReadOptions { progress: &progress, ..*options };
        let is_whole = whole.get(i).copied().unwrap_or_default();
        stream(input, &options, columns.as_deref().filter(|_| !is_whole), &sink)
    });
    match ended {
        Ok(()) => {
            sender.lock().unwrap_or_else(PoisonError::into_inner).end_cloud();
            state.finish();
            Ok(state.warnings())
        }
        Err(_) if state.writer_is_gone() => Err(Sending::WriterGone),
        Err(error) => {
            state.fail(&error);
            Err(Sending::Read(error))
        }
    }
}

/// Writes what comes out of a queue.
fn write_clouds(
    output: &Path,
    id: Option<&str>,
    source: transfer::TransferSource,
    options: &WriteOptions<'_>,
) -> Result<Vec<String>, WriteError> {
    let failed = |error: io::Error| WriteError::Io { path: output.to_owned(), error };
    let Some(id) = id else {
        return replace_at(
            output,
            |file| ply::write_batches(&*file, output, source, options.ascii),
            failed,
        );
    };
    let name = output.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let call = FormatCall { name: &name, values: options.values, ..FormatCall::default() };
    let write = |file| {
        options.formats.write(id, Box::new(source), file, call, &silent).map_err(
            |fault| match fault {
                WriteFault::Line(line) => {
                    WriteError::Format { path: output.to_owned(), format: id.to_owned(), line }
                }
                WriteFault::Cancelled => WriteError::Cancelled { path: output.to_owned() },
            },
        )
    };
    replace_at(output, write, failed)
}
