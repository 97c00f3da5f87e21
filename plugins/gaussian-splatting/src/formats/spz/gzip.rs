//! Versions 1 to 3: one stream of gzip, attribute after attribute.

use super::Attributes;
use super::header::{Attribute, Header, LEN};
use flate2::bufread::GzDecoder;
use std::io::{BufReader, ErrorKind, Read};
use surfelshop_api::format::{FileSource, FileStream};
use surfelshop_api::prelude::{Error, Job, Result};

/// The first bytes of a gzip file.
pub(super) const MAGIC: [u8; 2] = [0x1f, 0x8b];

/// The share of the progress that unpacking has.
pub(super) const SHARE: f64 = 0.8;

/// Most bytes that deflate makes of one.
const MOST_RATIO: u64 = 1032;

/// Bytes that are unpacked at once.
const PIECE: usize = 1 << 20;

/// Bytes behind the points that are unpacked to come to the stream's checksum.
const MOST_BEHIND: usize = 1 << 20;

/// A stream whose header was read.
pub(super) struct Stream(GzDecoder<BufReader<FileStream>>);

/// Unpacks the header, and checks that the file can hold the points that it announces.
pub(super) fn open(file: &FileSource) -> Result<(Header, Stream)> {
    let mut stream = GzDecoder::new(BufReader::with_capacity(1 << 16, file.stream()));
    let mut bytes = [0; LEN];
    stream.read_exact(&mut bytes).map_err(|error| match error.kind() {
        ErrorKind::UnexpectedEof => Error::new(format!(
            "expected a header of {LEN} bytes, found less: the file is cut short"
        )),
        _ => damaged(&error),
    })?;
    let header = Header::parse(&bytes, 1..=3)?;
    let bytes = header.points * header.sizes().iter().sum::<usize>() as u64;
    if bytes / MOST_RATIO > file.length() {
        return Err(Error::new(format!(
            "expected {} Gaussians of {bytes} bytes, found {} bytes of gzip, which cannot hold them: the file is cut \
             short, or its header is damaged",
            header.points,
            file.length()
        )));
    }
    Ok((header, Stream(stream)))
}

fn damaged(error: &std::io::Error) -> Error {
    Error::new(format!("expected a stream of gzip, found damaged bytes: {error}"))
}

impl Stream {
    /// Unpacks the attributes up to the last that is wanted.
    pub(super) fn unpack(
        mut self,
        header: &Header,
        wanted: &[bool; 6],
        job: &Job<'_>,
    ) -> Result<Memory> {
        let points = usize::try_from(header.points)?;
        let sizes = header.sizes();
        let mut places = [0; 6];
        let mut total = 0usize;
        for (i, place) in places.iter_mut().enumerate() {
            *place = total;
            let end = sizes[i].checked_mul(points).and_then(|bytes| total.checked_add(bytes));
            total = end.ok_or_else(|| Error::new("the file is too large for this system"))?;
        }
        let all = total;
        let last = wanted.iter().rposition(|wanted| *wanted).unwrap_or(0);
        let total = places.get(last + 1).copied().unwrap_or(all);
        let mut bytes = Vec::new();
        while bytes.len() < total {
            job.check()?;
            let (start, n) = (bytes.len(), PIECE.min(total - bytes.len()));
            // Memory is taken for what was unpacked and as much again.
            bytes.try_reserve(n)?;
            bytes.resize(start + n, 0);
            self.0.read_exact(&mut bytes[start..]).map_err(|error| match error.kind() {
                ErrorKind::UnexpectedEof => Error::new(format!(
                    "expected {} Gaussians of {all} bytes, found less: the file is cut short, or its header is damaged",
                    header.points
                )),
                _ => damaged(&error),
            })?;
            job.progress(SHARE * bytes.len() as f64 / total as f64, "");
        }
        if total == all {
            self.check_end()?;
        }
        Ok(Memory { bytes, places })
    }

    /// Unpacks what is behind the points, extensions, since the checksum is behind it.
    fn check_end(&mut self) -> Result<()> {
        let (mut rest, mut n) = ([0; 4096], 0);
        while n < MOST_BEHIND {
            match self.0.read(&mut rest) {
                Ok(0) => return Ok(()),
                Ok(found) => n += found,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(damaged(&error)),
            }
        }
        Ok(())
    }
}

/// Attributes in memory.
pub(super) struct Memory {
    bytes: Vec<u8>,
    /// Where the next bytes of each are.
    places: [usize; 6],
}

impl Attributes for Memory {
    fn read(&mut self, attribute: Attribute, bytes: &mut [u8]) -> Result<()> {
        let start = self.places[attribute as usize];
        let end = start + bytes.len();
        let found = self
            .bytes
            .get(start..end)
            .ok_or_else(|| Error::new(format!("expected more {}, found none", attribute.name())))?;
        bytes.copy_from_slice(found);
        self.places[attribute as usize] = end;
        Ok(())
    }
}
