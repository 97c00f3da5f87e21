//! # E57: terrestrial scans
//!
//! Reads and writes ASTM E2807 files (`.e57`), one cloud for each scan, in the scan's own axes with its pose.
//!
//! | in the file | column |
//! |---|---|
//! | `cartesianX/Y/Z`, or `sphericalRange/Azimuth/Elevation` | `position`; invalid points are left out |
//! | `colorRed/Green/Blue` | `color`, `u8` or `u16`, scaled from the file's limits |
//! | `nor:normalX/Y/Z` | `normal` |
//! | `intensity` | `intensity`, in the file's own values |
//! | `rowIndex`, `columnIndex` | `row_index`, `column_index` |
//! | `returnIndex`, `returnCount` | `return_number`, counted from 1, and `n_returns` |
//! | `timeStamp` | `time_stamp`, seconds since the scan began |
//! | fields of other extensions | a column of the field's name |
//!
//! What a file says of its scans is parsed by the crate `e57`. Points are decoded here, whole packets into typed
//! columns: the crate hands over a point at a time, each in memory of its own, which takes four times as long.
//! Files are written by the crate.

mod element;
mod read;
#[cfg(test)]
mod tests;
mod time;
mod write;

use surfelshop_api::format::{CloudSink, CloudSource, FileSink, FileSource, FileTypes};
use surfelshop_api::{Error, Format, HostInfo, Job, Result, UnitInfo, export_plugin};

/// The format E57.
pub struct E57;

impl Format for E57 {
    const INFO: UnitInfo = UnitInfo::new(
        "e57",
        "E57",
        "Terrestrial scans with poses, colours and intensity (ASTM E2807)",
    );
    const FILES: FileTypes =
        FileTypes::new().ending("e57").magic(0, b"ASTM-E57").written().several();
    type Params = ();

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn read(
        &mut self,
        file: &FileSource,
        _params: &(),
        clouds: &mut CloudSink<'_>,
        job: &Job<'_>,
    ) -> Result<()> {
        read::read(file, clouds, job)
    }

    fn write(
        &mut self,
        clouds: &mut CloudSource<'_>,
        _params: &(),
        file: &FileSink,
        job: &Job<'_>,
    ) -> Result<Vec<String>> {
        write::write(clouds, file, job)
    }
}

/// An error of the crate `e57` in one line; its text has the causes already.
fn refused(error: &e57::Error) -> Error {
    let text = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    // What the standard library says of a file that ends within a read.
    let text = text.replace("failed to fill whole buffer", "the file is cut short");
    let fault = text.strip_prefix("Invalid E57 content: ");
    Error::new(match fault {
        Some(fault) => format!("expected a file as E57 wants it, found a fault: {fault}"),
        None => text,
    })
}

export_plugin! {
    id: "org.surfelshop.e57",
    formats: [E57],
}
