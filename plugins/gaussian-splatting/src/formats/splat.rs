//! # `splat`: records of 32 bytes
//!
//! A file has no header. A Gaussian is
//!
//! | bytes | what                                                                |
//! |-------|---------------------------------------------------------------------|
//! | 12    | position, three f32                                                 |
//! | 12    | standard deviations, three f32                                      |
//! | 4     | red, green, blue as they are shown (sRGB), opacity                   |
//! | 4     | rotation w, x, y, z: 128 is 0, 0 is -1                               |
//!
//! least significant byte first. Files do not say which axis points up. What is written is rounded to these numbers;
//! spherical harmonics beyond the constant one have no place.
//!
//! Source: the viewer and the converter of antimatter15/splat.

use super::batch::{Batch, in_batches, resize};
use super::outgoing::{FormatRange, byte};
use super::{Gaussian, SH_0, rotation};
use std::io::{BufWriter, Write};
use surfelshop_api::format::{
    CloudHeader, CloudSink, CloudSource, FileSink, FileSource, FileTypes, UpAxis,
};
use surfelshop_api::prelude::{Error, HostInfo, Job, LimitInfo, Result, UnitInfo};

/// Bytes of a Gaussian.
const RECORD: usize = 32;

const RANGE: FormatRange =
    FormatRange { name: "SPLAT", degree: 0, up: UpAxis::Unknown, antialiased: false };

/// The format.
pub(crate) struct Splat;

impl surfelshop_api::Format for Splat {
    const INFO: UnitInfo = UnitInfo::new(
        "splat",
        "SPLAT",
        "Reads and writes Gaussian splats as records of 32 bytes (.splat).",
    );
    const FILES: FileTypes = FileTypes::new().ending("splat").written();
    type Params = ();
    const LIMITS: &'static [LimitInfo] =
        &[LimitInfo::new("moved", "positions are 32-bit floats from zero in such files")];

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn read(
        &mut self,
        file: &FileSource,
        (): &(),
        clouds: &mut CloudSink<'_>,
        job: &Job<'_>,
    ) -> Result<()> {
        let n = count(file)?;
        let mut batch = Batch::new(clouds, RANGE.degree);
        let header = CloudHeader {
            format: RANGE.name.to_owned(),
            rows: Some(n),
            columns: batch.header(),
            ..CloudHeader::default()
        };
        if !clouds.begin(&header)? {
            return Ok(());
        }
        let mut bytes = Vec::new();
        in_batches(n, 0.0..1.0, job, |first, n| {
            resize(&mut bytes, n * RECORD)?;
            file.read_exact_at(first * RECORD as u64, &mut bytes)?;
            let (records, _) = bytes.as_chunks::<RECORD>();
            for record in records {
                batch.push(&gaussian(record));
            }
            batch.hand_over(clouds)
        })?;
        batch.finish(clouds);
        Ok(())
    }

    fn write(
        &mut self,
        clouds: &mut CloudSource<'_>,
        (): &(),
        file: &FileSink,
        job: &Job<'_>,
    ) -> Result<Vec<String>> {
        let header = clouds.next_cloud()?;
        let header = header.ok_or_else(|| Error::new("expected a cloud to write, found none"))?;
        let mut out = BufWriter::with_capacity(1 << 18, file.stream());
        let n_placeless = RANGE
            .each(&header, clouds, 1.0, job, |gaussian, _| Ok(out.write_all(&record(gaussian))?))?;
        out.flush()?;
        Ok(RANGE.notes(&header, n_placeless))
    }
}

/// How many Gaussians a file has, from its length and a look at the first.
fn count(file: &FileSource) -> Result<u64> {
    let length = file.length();
    if !length.is_multiple_of(RECORD as u64) {
        return Err(Error::new(format!(
            "expected records of {RECORD} bytes, found {length} bytes: this is no .splat file, or it is cut short"
        )));
    }
    if length > 0 {
        let mut first = [0; RECORD];
        file.read_exact_at(0, &mut first)?;
        let Gaussian { position, scale, .. } = gaussian(&first);
        if !position.iter().chain(&scale).all(|number| number.is_finite()) {
            return Err(Error::new(
                "expected the position and the size of a Gaussian, found what is no number: this is no .splat file",
            ));
        }
    }
    Ok(length / RECORD as u64)
}

/// A Gaussian of its bytes.
fn gaussian(record: &[u8; RECORD]) -> Gaussian {
    let (words, _) = record.as_chunks::<4>();
    let float = |i: usize| f32::from_le_bytes(words[i]);
    let [red, green, blue, opacity] = words[6].map(|byte| f32::from(byte) / 255.0);
    let [w, x, y, z] = words[7].map(|byte| (f32::from(byte) - 128.0) / 128.0);
    Gaussian {
        position: [0, 1, 2].map(float),
        opacity,
        scale: [3, 4, 5].map(|i| float(i).abs()),
        rotation: rotation::unit([x, y, z, w]),
        color: [red, green, blue].map(|shown| (shown - 0.5) / SH_0),
        ..Gaussian::default()
    }
}

/// The bytes of a Gaussian.
fn record(gaussian: &Gaussian) -> [u8; RECORD] {
    let Gaussian { position, opacity, scale, rotation: [x, y, z, w], color, .. } = gaussian;
    let mut record = [0; RECORD];
    let (words, _) = record.as_chunks_mut::<4>();
    for (word, number) in words.iter_mut().zip(position.iter().chain(scale)) {
        *word = number.to_le_bytes();
    }
    let [red, green, blue] = color.map(|color| byte(255.0 * (0.5 + SH_0 * color)));
    words[6] = [red, green, blue, byte(255.0 * opacity)];
    words[7] = [w, x, y, z].map(|part| byte(128.0 * part + 128.0));
    record
}
