//! Several files as one cloud, handed over batch by batch: for who keeps the points elsewhere than in memory.

use super::heads::Heads;
use super::select::Selection;
use super::target::Types;
use super::transfer::transfer;
use super::{ConvertError, Sending, check, send, union};
use crate::assemble::{self, SideGuide};
use crate::cloud::buffer::Buffer;
use crate::cloud::source::Source;
use crate::error::ReadFault;
use crate::formats::table_sink::TableSink;
use crate::options::ReadOptions;
use crate::summary::Loaded;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use surfelshop_api::CloudView;
use surfelshop_api::columns::{Element, POSITION};
use surfelshop_api::format::{CloudHeader, CloudSinkHost as _, CloudSourceHost as _};

/// Files whose points are one cloud.
#[derive(Clone, Debug)]
pub struct Collection {
    /// The columns that all points have: positions in `f64`, in the common coordinates of the files.
    pub header: CloudHeader,
    /// What the files say besides.
    pub source: Source,
    /// For each file the number of its first scan.
    first_scans: Vec<u16>,
    narrow_colors: bool,
    /// Columns that every cloud of every file has.
    common: Vec<String>,
}

/// Points of a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Collected {
    /// Points of the file.
    pub n_read: u64,
    /// Of these, those left out since their coordinates are not finite.
    pub n_not_finite: u64,
    /// What was said of the file.
    pub warnings: Vec<String>,
}

impl Collection {
    /// Looks at the heads of files. Where colours have 16 bits, the colours are read until one is seen that needs
    /// them.
    ///
    /// # Errors
    /// One line that names the file, what was expected and what was found.
    pub fn of(inputs: &[PathBuf], read: &ReadOptions<'_>) -> Result<Self, ConvertError> {
        let Heads { mut headers, first, .. } = Heads::of(inputs, read, false)?;
        let scan = |first: usize| u16::try_from(first).unwrap_or(u16::MAX);
        let first_scans = first.into_iter().map(scan).collect();
        let narrow_colors = check::colors_are_narrow(inputs, &headers, read)?;
        if narrow_colors {
            headers.iter_mut().for_each(check::narrow_colors);
        }
        let names = headers.first().into_iter().flat_map(|header| &header.columns);
        let is_common = |name: &&String| headers.iter().all(|other| other.column(name).is_some());
        let common = names.map(|column| &column.name).filter(is_common).cloned().collect();
        let mut header = union::header(&headers, &Selection::default());
        header.has_faces = false;
        for column in header.columns.iter_mut().filter(|column| column.name == POSITION) {
            column.element = Element::F64;
        }
        let source = Source::of_headers(headers.iter());
        Ok(Self { header, source, first_scans, narrow_colors, common })
    }

    /// Whether every cloud of every file has a column.
    #[must_use]
    pub fn all_have(&self, column: &str) -> bool {
        self.common.iter().any(|name| name == column)
    }

    /// Whether every cloud of every file consists of Gaussian splats, of which nothing is estimated.
    #[must_use]
    pub fn are_splats(&self) -> bool {
        let columns = self.header.columns.iter().filter(|column| self.all_have(&column.name));
        assemble::are_splats(columns)
    }

    /// Hands over the points of a file, in its order, with the columns of the header.
    ///
    /// # Errors
    /// One line that names the file; or that of `take`.
    pub fn read(
        &self,
        (number, path): (usize, &Path),
        read: &ReadOptions<'_>,
        take: &mut (dyn FnMut(&CloudView<'_>) -> Result<(), String> + Send),
    ) -> Result<Collected, ConvertError> {
        let types = Types {
            wide_positions: true,
            narrow_colors: self.narrow_colors,
            trained_splats: false,
            grids: false,
        };
        let (sender, mut source) = transfer(Some(self.header.clone()), Selection::default(), types);
        source.count_scans_from(self.first_scans.get(number).copied().unwrap_or(0));
        let counts = Arc::clone(&source.counts);
        let inputs = [path.to_owned()];
        let ended = std::thread::scope(|scope| {
            let taking = scope.spawn(move || -> Result<(), String> {
                while source.next_cloud().map_err(|error| error.to_string())?.is_some() {
                    while let Some(batch) =
                        source.next_batch().map_err(|error| error.to_string())?
                    {
                        take(&batch)?;
                    }
                }
                Ok(())
            });
            let sent = send(&inputs, &[], sender, read);
            let taken = taking.join().unwrap_or_else(|_panicked| {
                Err("the work on the points ended before it was done".to_owned())
            });
            (sent, taken)
        });
        let warnings = match ended {
            (Err(Sending::Read(error)), _) => return Err(error.into()),
            (_, Err(line)) => return Err(ConvertError::Selection(line)),
            (Err(Sending::WriterGone), Ok(())) => Vec::new(),
            (Ok(warnings), Ok(())) => warnings,
        };
        Ok(Collected {
            n_read: counts.read.load(Ordering::Relaxed),
            n_not_finite: counts.not_finite.load(Ordering::Relaxed),
            warnings,
        })
    }
}

/// Makes a cloud of a part of the points, with what they lack estimated: as [`read`](crate::read()) does of a file's.
/// Colours keep their type, and nobody looks around for the sides that can be seen, since other parts may hide them:
/// normals face what the `guide` says of the whole cloud.
///
/// # Errors
/// Where columns do not fit the header, or memory runs out.
pub fn assembled(
    header: &CloudHeader,
    columns: Vec<Buffer>,
    source: Source,
    guide: Option<&SideGuide>,
    options: &ReadOptions<'_>,
) -> Result<Loaded, ReadFault> {
    let mut sink = TableSink::default();
    let refused = |error: surfelshop_api::Error| ReadFault::Value {
        place: "columns".to_owned(),
        expected: "columns as the header has them".to_owned(),
        found: error.to_string(),
    };
    sink.begin(header).map_err(refused)?;
    let values: Vec<_> = columns.iter().map(Buffer::as_values).collect();
    if let Err(error) = sink.batch(&values) {
        return Err(sink.memory_fault().unwrap_or_else(|| refused(error)));
    }
    drop(columns);
    let (mut table, _) = sink.finish()?;
    table.is_part = true;
    assemble::guided(table, source, guide, options)
}
