//! File formats: what files a plugin recognises, and how their clouds are read and written.
//!
//! A format touches no file system. The host lends bytes ([`FileSource`]) and takes batches of columns
//! ([`CloudSink`]); to write, it lends batches ([`CloudSource`]) and takes bytes ([`FileSink`]). So files larger
//! than memory pass through, and a damaged file or a faulty format harms nothing.

mod clouds;
mod file;
mod file_beside;
pub(crate) mod file_types;
mod header;
mod names;
mod support;
mod tree;

pub use clouds::{
    BATCH, CloudSink, CloudSinkHost, CloudSource, CloudSourceHost, Collected, CollectedCloud,
    check_batch,
};
pub use file::{FileHost, FileSink, FileSource, FileStream};
pub use file_beside::{FileBeside, WithFilesBeside};
pub use file_types::{FileTypes, HEAD_LEN, MAX_ENDING_LEN, Magic, Recognition};
pub use header::{
    CLASSIFICATION, CloudHeader, FileColumn, GPS_TIME, INTENSITY, N_RETURNS, POINT_SOURCE, Pose,
    RETURN_NUMBER, SCAN, SCAN_ANGLE, UpAxis,
};
pub use names::ColumnNames;
pub use support::{HeaderSupport, UpSupport};

pub use tree::{PointNode, PointTree};

use crate::error::{Error, Result};
use crate::frame::HostInfo;
use crate::job::Job;
use crate::params::ParamSet;
use crate::unit::LimitInfo;
use crate::unit_info::UnitInfo;

/// A file format: reads clouds out of files, and may write them.
///
/// ABI 3.8.
pub trait Format: Send + Sized + 'static {
    /// How the format is called.
    const INFO: UnitInfo;
    /// The files it recognises.
    const FILES: FileTypes;
    /// Its parameters, such as the names of columns that a text file does not have; `()` for none.
    type Params: ParamSet;
    /// What it cannot do: cases of `surfelshop check`, and why; see [`LimitInfo`].
    const LIMITS: &'static [LimitInfo] = &[];

    /// Makes an instance; one per file.
    ///
    /// # Errors
    /// Where the host lacks something the format cannot do without.
    fn new(host: &HostInfo) -> Result<Self>;

    /// Reads the clouds of a file: for each [`CloudSink::begin`] and, where its points are wanted,
    /// [`CloudSink::batch`] until all are handed over.
    ///
    /// Numbers in a file are not to be trusted: memory is taken for what is there, not for what is announced. The
    /// host drops points that are not finite, estimates normals and radii that are missing, and moves clouds by
    /// their poses.
    ///
    /// # Errors
    /// Where the file is damaged: one line, what was expected and what was found. Batches that were handed
    /// over before are dropped; where they can stand alone, the format says so with [`CloudSink::warn`] and
    /// returns `Ok`.
    fn read(
        &mut self,
        file: &FileSource,
        params: &Self::Params,
        clouds: &mut CloudSink<'_>,
        job: &Job<'_>,
    ) -> Result<()>;

    /// Writes clouds to a file. Called only where [`FileTypes::written`] says so.
    ///
    /// Returns lines for people, of what the format cannot hold: columns left out, values rounded.
    ///
    /// # Errors
    /// Where the clouds cannot be written like this, or the system refuses; nothing is left behind.
    fn write(
        &mut self,
        clouds: &mut CloudSource<'_>,
        params: &Self::Params,
        file: &FileSink,
        job: &Job<'_>,
    ) -> Result<Vec<String>> {
        let _unused = (clouds, params, file, job);
        Err(Error::new("this format is only read"))
    }
}
