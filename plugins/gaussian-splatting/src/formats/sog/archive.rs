//! Files on their way into a zip archive, which are not packed further.

use super::zip::{END_MAGIC, ENTRY_MAGIC, MAGIC};
use flate2::Crc;
use std::io::{BufWriter, Write};
use surfelshop_api::format::{FileSink, FileStream};
use surfelshop_api::prelude::{Error, Result};

/// The version of the format that reads such archives, 2.0, and that names are UTF-8.
const VERSION: u16 = 20;
const UTF_8: u16 = 1 << 11;

/// The first day that archives know, 1 January 1980: files that are made alike are alike.
const DAY: u16 = 33;

/// An archive that is written.
pub(super) struct Outgoing {
    out: BufWriter<FileStream>,
    at: u64,
    /// An entry for each file.
    table: Vec<u8>,
    n: u16,
}

impl Outgoing {
    pub(super) fn new(file: &FileSink) -> Self {
        let out = BufWriter::with_capacity(1 << 18, file.stream());
        Self { out, at: 0, table: Vec::new(), n: 0 }
    }

    /// Adds a file.
    ///
    /// # Errors
    /// Where the archive becomes larger than 4 GiB, or the host refuses.
    pub(super) fn add(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        let too_large =
            || Error::new("expected at most 4 GiB, which an archive of images holds, found more");
        let at = u32::try_from(self.at).ok().ok_or_else(too_large)?;
        let len = u32::try_from(bytes.len()).ok().ok_or_else(too_large)?;
        let name_len = u16::try_from(name.len())?;
        let mut crc = Crc::new();
        crc.update(bytes);
        let mut facts: Vec<u8> = Vec::new();
        let shorts = [VERSION, UTF_8, 0, 0, DAY];
        shorts.iter().for_each(|number| facts.extend(number.to_le_bytes()));
        [crc.sum(), len, len].iter().for_each(|number| facts.extend(number.to_le_bytes()));
        facts.extend(name_len.to_le_bytes());
        let head = [MAGIC, &facts, &[0; 2], name.as_bytes()].concat();
        self.out.write_all(&head)?;
        self.out.write_all(bytes)?;
        self.at += (head.len() + bytes.len()) as u64;
        self.table.extend(ENTRY_MAGIC);
        self.table.extend(VERSION.to_le_bytes());
        self.table.extend(facts);
        // No extra field, comment, disk or attributes.
        self.table.extend([0; 12]);
        self.table.extend(at.to_le_bytes());
        self.table.extend(name.as_bytes());
        self.n += 1;
        Ok(())
    }

    /// Ends the archive with its table.
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub(super) fn finish(mut self) -> Result<()> {
        let start = u32::try_from(self.at).ok();
        let start = start.ok_or_else(|| {
            Error::new("expected at most 4 GiB, which an archive of images holds, found more")
        })?;
        let size = u32::try_from(self.table.len())?;
        self.out.write_all(&self.table)?;
        self.out.write_all(&END_MAGIC)?;
        for number in [0, 0, self.n, self.n] {
            self.out.write_all(&number.to_le_bytes())?;
        }
        for number in [size, start] {
            self.out.write_all(&number.to_le_bytes())?;
        }
        self.out.write_all(&[0; 2])?;
        Ok(self.out.flush()?)
    }
}
