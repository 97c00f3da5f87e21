//! # `pts`: a count, then a line for each point
//!
//! The first line is the number of points; each of the others is x y z, x y z and intensity, or x y z, intensity
//! and a colour of 8 bits. Behind these may come another count and its points, which are another cloud; a file
//! without a count is one cloud. Intensity is kept as it is, which programs write from -2048 to 2047, to 255 or
//! to 1. What other columns hold is guessed by their values, as in files `xyz`.
//!
//! Written are positions, intensity and colour, the colour of 8 bits; nothing else has a place.
//!
//! ```text
//! surfelshop bake scan.las -t normals -o scan.pts
//! ```

use crate::announced::{Announced, MOST_CLOUDS, Reading};
use crate::layout::{Found, noted};
use crate::output::{FixedFormat, write_fixed};
use crate::rows::{Options, Unreadable};
use crate::text::{LineReader, count, start_of};
use surfelshop_api::format::{
    CloudHeader, CloudSink, CloudSource, FileSink, FileSource, FileTypes,
};
use surfelshop_api::prelude::{Error, HostInfo, Job, Result, UnitInfo};

/// The format.
pub(crate) struct Pts;

impl surfelshop_api::Format for Pts {
    const INFO: UnitInfo = UnitInfo::new(
        "pts",
        "PTS",
        "Points as lines of text behind their number: x y z, intensity, colour.",
    );
    const FILES: FileTypes = FileTypes::new().ending("pts").written();
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
        for number in 0.. {
            let Some((place, line)) = next else { break };
            if number == MOST_CLOUDS {
                return Err(Error::new(format!(
                    "expected at most {MOST_CLOUDS} clouds, found more"
                )));
            }
            job.check()?;
            let mut reader = LineReader::new(file, place, line);
            let Some(first) = reader.next()? else { break };
            let announced = match count(&first.text) {
                Some(lines) => {
                    Announced { lines: Some(lines), start: reader.place, line: reader.number }
                }
                None => Announced { lines: None, start: first.place, line: first.number },
            };
            let announced = announced.checked(file)?;
            let taken = reading.cloud(&announced, complete, |_| Ok(true))?;
            next = taken.next;
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
        write_fixed(FixedFormat::Pts, clouds, file, job)
    }
}

fn complete(found: Option<&Found>, header: CloudHeader) -> (CloudHeader, Options) {
    let note = found.map_or_else(String::new, |found| format!(", {}", noted(found)));
    (CloudHeader { format: format!("PTS text{note}"), ..header }, Options::default())
}
