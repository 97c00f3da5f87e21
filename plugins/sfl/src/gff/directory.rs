//! Directories as they are read. Nothing that they say is believed: places are checked against the file's length, links
//! are followed once, and entries are counted.

use super::{kind, tags};
use crate::big_endian::{f32_at, f64_at, u16_at, u32_at};
use std::collections::BTreeSet;
use surfelshop_api::format::FileSource;
use surfelshop_api::{Error, Result};

/// Most children of a directory that are read; the original library reads as many.
pub(crate) const MAX_CHILDREN: u32 = 1024;

/// Most entries of a directory; those of real files have about twenty.
const MAX_ENTRIES: usize = 4096;

/// Most entries of a whole file: as many as a file with hundreds of sets in a hundred resolutions has.
const MAX_TOTAL_ENTRIES: usize = 1 << 20;

/// Most bytes of a text.
const MAX_TEXT_BYTES: u32 = 1 << 16;

/// An entry of a directory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Entry {
    pub(crate) tag: u16,
    pub(crate) kind: u16,
    pub(crate) count: u32,
    value: [u8; 4],
}

impl Entry {
    fn of(bytes: &[u8; 12]) -> Self {
        let [.., a, b, c, d] = *bytes;
        let (tag, kind, count) = (u16_at(bytes, 0), u16_at(bytes, 2), u32_at(bytes, 4));
        Self { tag, kind, count, value: [a, b, c, d] }
    }

    /// The value as an offset.
    pub(crate) fn offset(&self) -> u32 {
        u32::from_be_bytes(self.value)
    }
}

/// How a directory is linked to others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Uplink,
    Link { next: u32 },
    Down { next: u32, child: u32 },
}

/// A directory.
#[derive(Clone, Debug)]
pub(crate) struct Directory {
    entries: Vec<Entry>,
    end: End,
}

impl Directory {
    /// Whether the directory only closes a list of siblings.
    pub(crate) fn is_closing(&self) -> bool {
        self.entries.is_empty() && self.end == End::Uplink
    }

    /// Where the next sibling is said to be; `None` where none is.
    pub(crate) fn next(&self) -> Option<u32> {
        match self.end {
            End::Uplink => None,
            End::Link { next } | End::Down { next, .. } => Some(next).filter(|&next| next != 0),
        }
    }

    /// Where the first child is said to be.
    pub(crate) fn first_child(&self) -> Option<u32> {
        match self.end {
            End::Down { child, .. } => Some(child),
            _ => None,
        }
    }

    /// The entry of a tag, the first of several.
    pub(crate) fn entry(&self, tag: u16) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.tag == tag)
    }
}

/// Where the header says that the root directory is.
///
/// # Errors
/// Where the file is no SFL file, or of a version that is not known.
pub(crate) fn root_offset(file: &FileSource) -> Result<u32> {
    let mut header = [0; 20];
    file.read_exact_at(0, &mut header)?;
    for (place, magic) in [(0, b"GFLF"), (8, b"SFLF")] {
        let found = &header[place..place + 4];
        if found != magic {
            let (expected, found) = (magic.escape_ascii(), found.escape_ascii());
            return Err(Error::new(format!(
                "expected `{expected}` at byte {place}, found `{found}`: this is no SFL file"
            )));
        }
    }
    for (place, name) in [(4, "the container"), (12, "the file")] {
        let version = u32_at(&header, place);
        // The low byte counts changes that older readers need not know.
        if version & 0xff00 != 0 {
            return Err(Error::new(format!(
                "expected version 0 of {name}, found {}: it is newer than what is known",
                version >> 8
            )));
        }
    }
    Ok(u32_at(&header, 16))
}

/// A container that is read.
pub(crate) struct Gff<'a> {
    file: &'a FileSource,
    /// How many bytes later everything lies than offsets say.
    shift: u64,
    entries_left: usize,
    visited: BTreeSet<u64>,
}

impl<'a> Gff<'a> {
    /// A container where everything lies so many bytes later than offsets say.
    pub(crate) fn new(file: &'a FileSource, shift: u64) -> Self {
        Self { file, shift, entries_left: MAX_TOTAL_ENTRIES, visited: BTreeSet::new() }
    }

    /// The file.
    pub(crate) fn file(&self) -> &'a FileSource {
        self.file
    }

    /// Where an offset leads.
    pub(crate) fn place(&self, offset: u32) -> u64 {
        u64::from(offset) + self.shift
    }

    /// Reads a directory; each is read only once.
    ///
    /// # Errors
    /// Where the file ends before the directory does, or the directory was read before.
    pub(crate) fn directory(&mut self, offset: u32) -> Result<Directory> {
        let start = self.place(offset);
        if !self.visited.insert(start) {
            return Err(Error::new(format!(
                "the directory at byte {start} is linked twice: links run in a circle"
            )));
        }
        let mut entries = Vec::new();
        let mut place = start;
        loop {
            let mut bytes = [0; 12];
            self.file.read_exact_at(place, &mut bytes)?;
            place += 12;
            let entry = Entry::of(&bytes);
            let end = match (entry.tag, entry.kind) {
                (tags::UPLINK, kind::OFFSET) => End::Uplink,
                (tags::LINK, kind::OFFSET) => End::Link { next: entry.offset() },
                (tags::DOWNLINK, kind::OFFSETS) => {
                    End::Down { next: entry.count, child: entry.offset() }
                }
                (tag @ (tags::UPLINK | tags::LINK | tags::DOWNLINK), kind) => {
                    return Err(Error::new(format!(
                        "the directory at byte {start} ends with tag {tag} of type {kind}, which is none of the links"
                    )));
                }
                _ => {
                    self.entries_left = self.entries_left.saturating_sub(1);
                    if entries.len() == MAX_ENTRIES || self.entries_left == 0 {
                        return Err(Error::new(format!(
                            "expected the directory at byte {start} to end after at most {MAX_ENTRIES} entries, found more"
                        )));
                    }
                    entries.push(entry);
                    continue;
                }
            };
            return Ok(Directory { entries, end });
        }
    }

    /// Reads a child of a directory, counted from 0.
    ///
    /// # Errors
    /// Where there are not so many, or a directory on the way is damaged.
    pub(crate) fn child(&mut self, parent: &Directory, index: u32) -> Result<Directory> {
        let few = |n: u32| {
            Error::new(format!("expected child {index} of a directory, found {n} children"))
        };
        if index >= MAX_CHILDREN {
            return Err(Error::new(format!(
                "expected one of at most {MAX_CHILDREN} children of a directory, found number {index}"
            )));
        }
        let mut next = parent.first_child();
        for n in 0..=index {
            let child = self.directory(next.ok_or_else(|| few(n))?)?;
            if child.is_closing() {
                return Err(few(n));
            }
            if n == index {
                return Ok(child);
            }
            next = child.next();
        }
        Err(few(index))
    }

    /// The bytes of an entry's values, of which at most so many are taken.
    fn bytes(&self, entry: &Entry, most: u32) -> Result<Vec<u8>> {
        let (tag, kind, count) = (entry.tag, entry.kind, entry.count);
        let size = kind::size(kind).ok_or_else(|| {
            Error::new(format!("tag {tag:04x}: expected values, found type {kind}"))
        })?;
        if count > most {
            return Err(Error::new(format!(
                "tag {tag:04x}: expected at most {most} values, found {count}"
            )));
        }
        let len = size * u64::from(count);
        if len <= 4 {
            let len = usize::try_from(len)?;
            return Ok(entry.value[..len].to_vec());
        }
        self.file
            .bytes_at(self.place(entry.offset()), len)
            .map_err(|error| Error::new(format!("tag {tag:04x}: {error}")))
    }

    /// The values of a tag as numbers of any kind, at most so many; `None` where there is no such tag.
    ///
    /// # Errors
    /// Where they are no numbers, too many, or behind the file's end.
    pub(crate) fn numbers(
        &self,
        directory: &Directory,
        tag: u16,
        most: u32,
    ) -> Result<Option<Vec<f64>>> {
        let Some(entry) = directory.entry(tag) else { return Ok(None) };
        let bytes = self.bytes(entry, most)?;
        let of =
            |size: usize, number: fn(&[u8]) -> f64| bytes.chunks_exact(size).map(number).collect();
        Ok(Some(match entry.kind {
            kind::U8 => of(1, |bytes| f64::from(bytes[0])),
            kind::I8 => of(1, |bytes| f64::from(i8::from_be_bytes([bytes[0]]))),
            kind::U16 => of(2, |bytes| f64::from(u16_at(bytes, 0))),
            kind::I16 => of(2, |bytes| f64::from(u16_at(bytes, 0).cast_signed())),
            kind::U32 => of(4, |bytes| f64::from(u32_at(bytes, 0))),
            kind::I32 => of(4, |bytes| f64::from(u32_at(bytes, 0).cast_signed())),
            kind::F32 => of(4, |bytes| f64::from(f32_at(bytes, 0))),
            kind::F64 => of(8, |bytes| f64_at(bytes, 0)),
            kind => {
                return Err(Error::new(format!(
                    "tag {tag:04x}: expected numbers, found type {kind}"
                )));
            }
        }))
    }

    /// The values of a tag as whole numbers, at most so many; `None` where there is no such tag.
    ///
    /// # Errors
    /// As [`numbers`](Self::numbers), and where one is negative, broken or does not fit.
    pub(crate) fn whole_numbers(
        &self,
        directory: &Directory,
        tag: u16,
        most: u32,
    ) -> Result<Option<Vec<u32>>> {
        let Some(numbers) = self.numbers(directory, tag, most)? else { return Ok(None) };
        let whole = |number: f64| {
            let rounded = number as u32;
            (f64::from(rounded) == number).then_some(rounded).ok_or_else(|| {
                Error::new(format!(
                    "tag {tag:04x}: expected a whole number of 32 bits, found {number}"
                ))
            })
        };
        numbers.into_iter().map(whole).collect::<Result<_>>().map(Some)
    }

    /// The whole number of a tag; `None` where there is no such tag.
    ///
    /// # Errors
    /// As [`whole_numbers`](Self::whole_numbers), and where it has no value.
    pub(crate) fn whole_number(&self, directory: &Directory, tag: u16) -> Result<Option<u32>> {
        let Some(numbers) = self.whole_numbers(directory, tag, 1)? else { return Ok(None) };
        let none = || Error::new(format!("tag {tag:04x}: expected a number, found none"));
        numbers.first().copied().ok_or_else(none).map(Some)
    }

    /// The text of a tag up to its first zero, with spaces for control characters; `None` where there is none, or
    /// an empty one.
    ///
    /// # Errors
    /// Where it is no text, very long, or behind the file's end.
    pub(crate) fn text(&self, directory: &Directory, tag: u16) -> Result<Option<String>> {
        let Some(entry) = directory.entry(tag) else { return Ok(None) };
        if entry.kind != kind::ASCII {
            let found = entry.kind;
            return Err(Error::new(format!("tag {tag:04x}: expected text, found type {found}")));
        }
        let bytes = self.bytes(entry, MAX_TEXT_BYTES)?;
        let bytes = bytes.split(|&byte| byte == 0).next().unwrap_or_default();
        // Before UTF-8, bytes above 127 were mostly Latin-1.
        let text = std::str::from_utf8(bytes).map_or_else(
            |_latin_1| bytes.iter().map(|&byte| char::from(byte)).collect(),
            str::to_owned,
        );
        let words: Vec<&str> = text
            .split(|c: char| c.is_whitespace() || c.is_control())
            .filter(|word| !word.is_empty())
            .collect();
        Ok(Some(words.join(" ")).filter(|text| !text.is_empty()))
    }
}
