//! Packets of a scan's section, which bring some bytes of every field.

use crate::read::pages::{Pages, in_file, place};
use crate::read::streams::Streams;
use surfelshop_api::format::FileSource;
use surfelshop_api::{Error, Result};

/// Bytes of a section's header.
const SECTION_HEADER: usize = 32;

/// Reads a section packet by packet.
pub(crate) struct Packets<'a> {
    pages: Pages<'a>,
    /// Where the bytes of each field end in the packet.
    ends: Vec<usize>,
}

impl<'a> Packets<'a> {
    /// The section at a place in the file.
    ///
    /// # Errors
    /// Where there is none, or a page is damaged.
    pub(crate) fn open(file: &'a FileSource, offset: u64) -> Result<Self> {
        let start = place(offset)?;
        let mut pages = Pages::new(file, start, u64::MAX);
        let header = pages.take(SECTION_HEADER)?;
        let word = |first: usize| {
            let bytes = header[first..].first_chunk::<8>().copied().unwrap_or_default();
            u64::from_le_bytes(bytes)
        };
        if header[0] != 1 {
            return Err(Error::new(format!(
                "expected a section of points at byte {offset}, found one of type {}: the file is damaged",
                header[0]
            )));
        }
        let (len, first_packet) = (word(8), place(word(16))?);
        let pages = Pages::new(file, first_packet, start.saturating_add(len));
        Ok(Self { pages, ends: Vec::new() })
    }

    /// Adds the bytes of the next packet to the fields; false at the end of the section.
    ///
    /// # Errors
    /// Where the packet cannot be right, or a page is damaged.
    pub(crate) fn next(&mut self, streams: &mut Streams) -> Result<bool> {
        // Every packet has at least four bytes, so that this comes to an end.
        if self.pages.left() < 4 {
            return Ok(false);
        }
        let at = in_file(self.pages.place());
        let head = self.pages.take(4)?;
        let (kind, len) = (head[0], usize::from(u16::from_le_bytes([head[2], head[3]])) + 1);
        if len % 4 != 0 {
            return Err(Error::new(format!(
                "expected a packet of whole words at byte {at}, found {len} bytes: the file is damaged"
            )));
        }
        match kind {
            // Packets of the index, and empty ones.
            0 | 2 => self.pages.skip(len - 4)?,
            1 => self.data(at, len, streams)?,
            _ => {
                return Err(Error::new(format!(
                    "expected a packet at byte {at}, found one of type {kind}: the file is damaged"
                )));
            }
        }
        Ok(true)
    }

    fn data(&mut self, at: u64, len: usize, streams: &mut Streams) -> Result<()> {
        let body = self.pages.take(len - 4)?;
        let size = |i: usize| {
            let bytes = body.get(2 * i..).and_then(<[u8]>::first_chunk::<2>);
            bytes.map(|bytes| usize::from(u16::from_le_bytes(*bytes)))
        };
        let (n_fields, expected) = (size(0).unwrap_or(0), streams.len());
        if n_fields != expected {
            return Err(Error::new(format!(
                "expected values of {expected} fields in the packet at byte {at}, found {n_fields}: the file is damaged"
            )));
        }
        self.ends.clear();
        let mut end = 2 + 2 * n_fields;
        for i in 1..=n_fields {
            end += size(i).unwrap_or(len);
            self.ends.push(end);
        }
        if end > body.len() {
            return Err(Error::new(format!(
                "expected {} bytes of values in the packet at byte {at}, found {}: the file is damaged",
                end,
                body.len()
            )));
        }
        let mut first = 2 + 2 * n_fields;
        for (field, &end) in self.ends.iter().enumerate() {
            streams.append(field, &body[first..end])?;
            first = end;
        }
        Ok(())
    }
}
