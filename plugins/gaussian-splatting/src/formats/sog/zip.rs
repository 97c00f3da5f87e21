//! The files in an archive, each found in its table before a byte is taken out.
//!
//! Source: PKWARE, "APPNOTE.TXT: .ZIP File Format Specification".

use flate2::Crc;
use flate2::read::DeflateDecoder;
use std::io::{ErrorKind, Read};
use surfelshop_api::format::FileSource;
use surfelshop_api::prelude::{Error, Result};

/// The first bytes of an archive that is not empty.
pub(super) const MAGIC: &[u8] = b"PK\x03\x04";

/// Bytes of the record at the end, without the comment behind it, and how it begins.
const END: usize = 22;
pub(super) const END_MAGIC: [u8; 4] = *b"PK\x05\x06";

/// Longest comment behind the record at the end.
const MOST_COMMENT: u64 = u16::MAX as u64;

/// Bytes of an entry of the table and of a file's own header, without names, and how they begin.
const ENTRY: usize = 46;
pub(super) const ENTRY_MAGIC: [u8; 4] = *b"PK\x01\x02";
const LOCAL: u64 = 30;

/// Most bytes of the table that are read.
const MOST_TABLE: u64 = 1 << 20;

/// Most bytes that one byte of Deflate stands for.
const MOST_RATIO: u64 = 1032;

const STORED: u16 = 0;
const DEFLATED: u16 = 8;

/// A file in the archive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Entry {
    pub(super) name: String,
    method: u16,
    is_encrypted: bool,
    crc: u32,
    packed: u64,
    length: u64,
    /// Where its own header lies.
    start: u64,
}

/// An archive.
pub(super) struct Archive<'a> {
    file: &'a FileSource,
    entries: Vec<Entry>,
}

fn short(bytes: &[u8], place: usize) -> u16 {
    let bytes = bytes.get(place..).and_then(<[u8]>::first_chunk);
    bytes.map_or(0, |bytes| u16::from_le_bytes(*bytes))
}

fn long(bytes: &[u8], place: usize) -> u32 {
    let bytes = bytes.get(place..).and_then(<[u8]>::first_chunk);
    bytes.map_or(0, |bytes| u32::from_le_bytes(*bytes))
}

impl<'a> Archive<'a> {
    /// Reads the table of an archive.
    pub(super) fn open(file: &'a FileSource) -> Result<Self> {
        let length = file.length();
        let tail = length.min(END as u64 + MOST_COMMENT);
        let bytes = file.bytes_at(length - tail, tail)?;
        let is_end = |place: &usize| {
            let rest = &bytes[*place..];
            rest.starts_with(&END_MAGIC) && END + usize::from(short(rest, 20)) == rest.len()
        };
        let end = (0..(bytes.len() + 1).saturating_sub(END)).rev().find(is_end);
        let end = &bytes[end.ok_or_else(|| {
            Error::new(
                "expected the table of a zip archive at the end, found none: the file is cut short",
            )
        })?..];
        let (count, size, start) = (short(end, 10), long(end, 12), long(end, 16));
        if count == u16::MAX || size == u32::MAX || start == u32::MAX {
            return Err(Error::new(
                "expected a zip archive of at most 4 GiB, found a larger one (ZIP64)",
            ));
        }
        let (size, start) = (u64::from(size), u64::from(start));
        if size > MOST_TABLE {
            return Err(Error::new(format!(
                "expected a table of at most {MOST_TABLE} bytes in the zip archive, found {size}"
            )));
        }
        let table = file.bytes_at(start, size)?;
        Ok(Self { file, entries: entries(&table, count)? })
    }

    /// The files in it.
    pub(super) fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The bytes of a file, of which there may be at most so many.
    pub(super) fn bytes(&self, name: &str, most: u64) -> Result<Vec<u8>> {
        let shown = name.escape_debug();
        let entry = self.entries.iter().find(|entry| entry.name == name);
        let entry = entry.ok_or_else(|| {
            Error::new(format!("expected a file `{shown}` in the archive, found none"))
        })?;
        let wrong = |line: String| Error::new(format!("`{shown}` in the archive: {line}"));
        if entry.is_encrypted {
            return Err(wrong("expected a file that is not encrypted, found one that is".into()));
        }
        if entry.length > most {
            return Err(wrong(format!("expected at most {most} bytes, found {}", entry.length)));
        }
        let head = self.file.bytes_at(entry.start, LOCAL)?;
        if !head.starts_with(MAGIC) {
            return Err(wrong("expected its header, found something else".into()));
        }
        let names = u64::from(short(&head, 26)) + u64::from(short(&head, 28));
        let packed = self.file.bytes_at(entry.start + LOCAL + names, entry.packed)?;
        let bytes = match entry.method {
            STORED if entry.packed == entry.length => packed,
            DEFLATED if entry.length / MOST_RATIO <= entry.packed => {
                inflated(&packed, entry.length).map_err(|error| wrong(error.message().into()))?
            }
            STORED | DEFLATED => {
                let (packed, length) = (entry.packed, entry.length);
                return Err(wrong(format!(
                    "expected {length} bytes in {packed}, which cannot hold them"
                )));
            }
            other => {
                return Err(wrong(format!(
                    "expected a file that is stored or deflated, found method {other}; pack the archive again"
                )));
            }
        };
        let mut crc = Crc::new();
        crc.update(&bytes);
        if crc.sum() != entry.crc {
            return Err(wrong("expected the checksum of the table, found another".into()));
        }
        Ok(bytes)
    }
}

/// The entries of a table that says that it has so many.
fn entries(mut table: &[u8], count: u16) -> Result<Vec<Entry>> {
    let damaged =
        || Error::new("expected a table of files in the zip archive, found a damaged one");
    let mut entries = Vec::new();
    for _ in 0..count {
        let (head, rest) = table.split_at_checked(ENTRY).ok_or_else(damaged)?;
        if !head.starts_with(&ENTRY_MAGIC) {
            return Err(damaged());
        }
        let [name, extra, comment] = [28, 30, 32].map(|place| usize::from(short(head, place)));
        let (name, rest) = rest.split_at_checked(name).ok_or_else(damaged)?;
        entries.push(Entry {
            name: String::from_utf8_lossy(name).into_owned(),
            is_encrypted: short(head, 8) & 1 != 0,
            method: short(head, 10),
            crc: long(head, 16),
            packed: long(head, 20).into(),
            length: long(head, 24).into(),
            start: long(head, 42).into(),
        });
        table = rest.get(extra + comment..).ok_or_else(damaged)?;
    }
    Ok(entries)
}

/// What Deflate packed, so many bytes.
fn inflated(packed: &[u8], length: u64) -> Result<Vec<u8>> {
    let length = usize::try_from(length)?;
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(length)?;
    bytes.resize(length, 0);
    let mut decoder = DeflateDecoder::new(packed);
    decoder.read_exact(&mut bytes).map_err(|error| match error.kind() {
        ErrorKind::UnexpectedEof => Error::new(format!("expected {length} bytes, found fewer")),
        _ => Error::new(format!("expected what Deflate packed, found damage: {error}")),
    })?;
    Ok(bytes)
}
