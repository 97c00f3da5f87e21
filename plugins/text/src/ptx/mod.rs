//! # `ptx`: scans with their grids and poses
//!
//! Each scan has ten lines: columns and rows of its grid, place and axes of the scanner, and four lines of a
//! matrix, the last of which is where the scanner stands. Then comes a line for each place of the grid, column by
//! column: x y z in the scanner's axes, intensity from 0 to 1, and perhaps a colour of 8 bits. `0 0 0` stands for
//! a place where nothing came back: of a grid of several columns and rows it is a point at NaN, so that the grid is
//! kept, and else it is left out and counted. A column of the file is a row of the cloud's grid.
//!
//! The matrix is the scan's pose, and the scanner stands at zero of the scan's axes, unless all points are so far
//! away that this cannot be. A matrix that is no rotation moves the points instead, and a warning says so.
//!
//! Written are positions, intensity, colour and poses. A scan without a grid becomes one column. Points that are
//! not finite become `0 0 0`. Whole numbers of intensity become fractions of the largest.
//!
//! ```text
//! surfelshop render scans.ptx -r flat -o scans.png
//! ```

mod header;

use crate::announced::{Announced, MOST_CLOUDS, Reading};
use crate::layout::{Found, noted};
use crate::output::{FixedFormat, write_fixed};
use crate::rows::{NoReturn, Options, Unreadable};
use crate::text::{LineReader, count, start_of};
use header::ScanHeader;
use surfelshop_api::columns::POSITION;
use surfelshop_api::format::{
    CloudHeader, CloudSink, CloudSource, FileSink, FileSource, FileTypes,
};
use surfelshop_api::glam::DVec3;
use surfelshop_api::prelude::{Error, HostInfo, Job, Result, UnitInfo};

/// The format.
pub(crate) struct Ptx;

impl surfelshop_api::Format for Ptx {
    const INFO: UnitInfo = UnitInfo::new(
        "ptx",
        "PTX",
        "Scans as lines of text, each with a grid and a pose: x y z, intensity, colour.",
    );
    const FILES: FileTypes = FileTypes::new().ending("ptx").written().several().grid();
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
        let mut next = Some((start_of(file)?, 1));
        let mut reading = Reading { file, clouds, job, unreadable: Unreadable::default() };
        let mut n_none = 0;
        for number in 1.. {
            let Some((place, line)) = next else { break };
            if number > MOST_CLOUDS {
                return Err(Error::new(format!(
                    "expected at most {MOST_CLOUDS} scans, found more"
                )));
            }
            job.check()?;
            let mut reader = LineReader::new(file, place, line);
            let scan = ScanHeader::read(&mut reader)?;
            let lines = Some(scan.columns.saturating_mul(scan.rows));
            let announced = Announced { lines, start: reader.place, line: reader.number };
            let announced = announced.checked(file)?;
            say_of_matrix(&scan, number, reading.clouds);
            let is_header = |mark: &crate::rows::Mark| begins_scan(file, mark.place);
            let taken = reading.cloud(
                &announced,
                |found, header| complete(&scan, number, found, header),
                is_header,
            )?;
            n_none += taken.none;
            next = taken.next;
        }
        if n_none > 0 {
            let places = if n_none == 1 { "place" } else { "places" };
            reading.clouds.warn(&format!(
                "nothing came back from {n_none} {places} of the grids, which are left out"
            ));
        }
        reading.finish()
    }

    fn write(
        &mut self,
        clouds: &mut CloudSource<'_>,
        _params: &(),
        file: &FileSink,
        job: &Job<'_>,
    ) -> Result<Vec<String>> {
        write_fixed(FixedFormat::Ptx, clouds, file, job)
    }
}

/// Whether a scan begins at a line with a count: another follows.
fn begins_scan(file: &FileSource, place: u64) -> Result<bool> {
    let mut reader = LineReader::new(file, place, 1);
    let lines = [reader.next()?, reader.next()?];
    Ok(lines.iter().all(|line| line.as_ref().is_some_and(|line| count(&line.text).is_some())))
}

fn say_of_matrix(scan: &ScanHeader, number: usize, clouds: &mut CloudSink<'_>) {
    if scan.transposed {
        clouds.warn(&format!(
            "the matrix of scan {number} has its place in the last column: it is turned round"
        ));
    }
    if scan.pose().is_none() {
        clouds.warn(&format!(
            "the matrix of scan {number} is no rotation: its points are moved by it as it is"
        ));
    }
}

fn complete(
    scan: &ScanHeader,
    number: usize,
    found: Option<&Found>,
    header: CloudHeader,
) -> (CloudHeader, Options) {
    let pose = scan.pose();
    let matrix = if pose.is_some() { None } else { Some(scan.matrix) };
    let points: Vec<DVec3> = found.map(sampled).unwrap_or_default();
    let returned: Vec<DVec3> =
        points.iter().copied().filter(|point| *point != DVec3::ZERO).collect();
    let grid = header.rows.and(scan.grid());
    // Where the sample has places without a return, the number of points is less than what is announced.
    let rows = header.rows.filter(|_| grid.is_some() || returned.len() == points.len());
    let scanner = is_near_zero(&returned).then(|| match matrix {
        None => DVec3::ZERO,
        Some(matrix) => matrix.w_axis.truncate(),
    });
    let note = found.map_or_else(String::new, |found| format!(", {}", noted(found)));
    let (columns, lines) = (scan.columns, scan.rows);
    let header = CloudHeader {
        format: format!("PTX text{note}; grid of {columns} columns and {lines} rows"),
        name: format!("scan {number}"),
        rows,
        grid,
        pose: pose.unwrap_or_default(),
        scanner: scanner.filter(|place| place.is_finite()),
        ..header
    };
    let no_return = if grid.is_some() { NoReturn::Nan } else { NoReturn::LeftOut };
    (header, Options { has_marks: true, no_return, matrix })
}

/// The points of a sample.
fn sampled(found: &Found) -> Vec<DVec3> {
    let place = |component| {
        found.typed.iter().position(|(target, _)| {
            target.as_ref().is_some_and(|t| t.column == POSITION && t.component == component)
        })
    };
    let (Some(x), Some(y), Some(z)) = (place(0), place(1), place(2)) else { return Vec::new() };
    let points = found.numbers.rows().map(|row| DVec3::new(row[x], row[y], row[z]));
    points.filter(|point| point.is_finite()).collect()
}

/// Whether a scanner can stand at zero: points are no farther away than ten times what they span.
fn is_near_zero(points: &[DVec3]) -> bool {
    let (low, high) =
        points.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &point| {
            (low.min(point), high.max(point))
        });
    points.is_empty() || ((low + high) / 2.0).length() <= 10.0 * (high - low).length()
}
