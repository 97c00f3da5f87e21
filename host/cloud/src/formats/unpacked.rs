//! Archives that somebody unpacked: a folder with an index that names the files beside it, as its format reads it
//! packed.
//!
//! Formats are lent one file. Some keep images in an archive with `meta.json`, and such a folder is handed over as that
//! archive, with what the index names and nothing else. No byte is copied but those of the archive's own.
//!
//! Source: PKWARE, "APPNOTE.TXT: .ZIP File Format Specification".

use super::positioned::read_at;
use crate::error::ReadFault;
use crate::files::{self, OpenFault};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use surfelshop_api::format::FileHost;

/// The index of such folders.
const INDEX: &str = "meta.json";
/// Most bytes of an index.
const MOST_INDEX: u64 = 16 << 20;
/// Most files that are named in one.
const MOST_FILES: usize = 256;
/// Most bytes of an archive with numbers of 32 bits.
const MOST_BYTES: u64 = u32::MAX as u64;

/// How much of a file is looked at at once.
const PIECE: usize = 1 << 18;

/// Bytes of the archive, from one on.
struct Part {
    start: u64,
    contents: Contents,
}

enum Contents {
    Own(Vec<u8>),
    Of(File, u64),
}

/// A folder as an archive.
pub(crate) struct UnpackedArchive {
    parts: Vec<Part>,
    length: u64,
}

/// The index of a folder, or of the folder that an index lies in; `None` where there is none.
fn index_of(path: &Path) -> Option<PathBuf> {
    let index = match path.file_name() {
        Some(name) if name == INDEX => path.to_owned(),
        _ if path.is_dir() => path.join(INDEX),
        _ => return None,
    };
    index.is_file().then_some(index)
}

/// The archive that a folder or its index stands for; `None` where a path leads to neither.
///
/// # Errors
/// Where a file that the index names cannot be read, or all are too large for an archive.
pub(crate) fn open(path: &Path) -> Result<Option<UnpackedArchive>, ReadFault> {
    let Some(index) = index_of(path) else { return Ok(None) };
    let text = files::read(&index, MOST_INDEX)?;
    let text = String::from_utf8_lossy(&text);
    let folder = index.parent().unwrap_or(Path::new(""));
    let mut archive = UnpackedArchive { parts: Vec::new(), length: 0 };
    let mut table = Vec::new();
    let mut n = 0u16;
    for name in std::iter::once(INDEX.to_owned()).chain(named(folder, &text)?) {
        archive.add(&folder.join(&name), &name, &mut table)?;
        n += 1;
    }
    archive.end(table, n)?;
    Ok(Some(archive))
}

/// The files of a folder that a text names between quotes, in the order of their names.
fn named(folder: &Path, text: &str) -> Result<Vec<String>, ReadFault> {
    let mut names = Vec::new();
    for found in folder.read_dir().map_err(OpenFault::Io)? {
        let found = found.map_err(OpenFault::Io)?;
        let Ok(name) = found.file_name().into_string() else { continue };
        let is_named = name != INDEX && text.contains(&format!("\"{name}\""));
        if is_named && names.len() < MOST_FILES && found.path().is_file() {
            names.push(name);
        }
    }
    names.sort_unstable();
    Ok(names)
}

impl UnpackedArchive {
    /// Its first bytes.
    pub(crate) fn head(&self) -> &[u8] {
        match self.parts.first() {
            Some(Part { contents: Contents::Own(bytes), .. }) => bytes,
            _ => &[],
        }
    }

    fn push(&mut self, contents: Contents) -> Result<(), ReadFault> {
        let length = match &contents {
            Contents::Own(bytes) => bytes.len() as u64,
            Contents::Of(_, length) => *length,
        };
        let start = self.length;
        self.length = start.saturating_add(length);
        if self.length > MOST_BYTES {
            return Err(OpenFault::TooLong { most: MOST_BYTES, found: self.length }.into());
        }
        self.parts.push(Part { start, contents });
        Ok(())
    }

    /// Adds a file, and its entry to the table.
    fn add(&mut self, path: &Path, name: &str, table: &mut Vec<u8>) -> Result<(), ReadFault> {
        let (file, metadata) = files::open(path)?;
        let (length, at) = (metadata.len(), self.length as u32);
        if length > MOST_BYTES {
            return Err(OpenFault::TooLong { most: MOST_BYTES, found: length }.into());
        }
        let sum = checksum(&file, length).map_err(OpenFault::Io)?;
        // Version 2.0, names in UTF-8, stored, on the first day that archives know.
        let mut facts = [20u16, 1 << 11, 0, 0, 33].map(u16::to_le_bytes).concat();
        facts.extend([sum, length as u32, length as u32].map(u32::to_le_bytes).concat());
        facts.extend((name.len() as u16).to_le_bytes());
        self.push(Contents::Own([b"PK\x03\x04", &facts[..], &[0; 2], name.as_bytes()].concat()))?;
        self.push(Contents::Of(file, length))?;
        let entry = [b"PK\x01\x02\x14\0", &facts[..], &[0; 12], &at.to_le_bytes(), name.as_bytes()];
        table.extend(entry.concat());
        Ok(())
    }

    fn end(&mut self, mut table: Vec<u8>, n: u16) -> Result<(), ReadFault> {
        let (size, start) = (table.len() as u32, self.length as u32);
        table.extend(b"PK\x05\x06\0\0\0\0");
        table.extend([n, n].map(u16::to_le_bytes).concat());
        table.extend([size, start].map(u32::to_le_bytes).concat());
        table.extend([0; 2]);
        self.push(Contents::Own(table))
    }
}

impl FileHost for UnpackedArchive {
    fn length(&self) -> u64 {
        self.length
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        let first = self.parts.partition_point(|part| part.start <= offset).saturating_sub(1);
        let mut done = 0;
        for part in &self.parts[first..] {
            let within = (offset + done as u64).saturating_sub(part.start);
            let rest = &mut buffer[done..];
            done += match &part.contents {
                Contents::Own(bytes) => {
                    let bytes = usize::try_from(within).ok().and_then(|at| bytes.get(at..));
                    let bytes = bytes.unwrap_or_default();
                    let n = bytes.len().min(rest.len());
                    rest[..n].copy_from_slice(&bytes[..n]);
                    n
                }
                Contents::Of(file, length) => {
                    let left = length.saturating_sub(within);
                    let n = usize::try_from(left).unwrap_or(usize::MAX).min(rest.len());
                    let found = read_at(file, within, &mut rest[..n])?;
                    if found < n {
                        return Err(io::ErrorKind::UnexpectedEof.into());
                    }
                    n
                }
            };
            if done == buffer.len() {
                break;
            }
        }
        Ok(done)
    }
}

/// The checksum of so many bytes of a file, as archives have it.
fn checksum(file: &File, length: u64) -> io::Result<u32> {
    let steps: [u32; 256] = std::array::from_fn(|byte| {
        (0..8).fold(byte as u32, |sum, _| (sum >> 1) ^ if sum & 1 == 1 { 0xedb8_8320 } else { 0 })
    });
    let (mut sum, mut at, mut piece) = (u32::MAX, 0, vec![0; PIECE]);
    while at < length {
        let n = usize::try_from(length - at).unwrap_or(PIECE).min(PIECE);
        let found = read_at(file, at, &mut piece[..n])?;
        if found == 0 {
            break;
        }
        for byte in &piece[..found] {
            sum = (sum >> 8) ^ steps[usize::from(sum as u8 ^ byte)];
        }
        at += found as u64;
    }
    Ok(!sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::write;

    fn bytes(archive: &UnpackedArchive, piece: usize) -> Vec<u8> {
        let mut all = vec![0; archive.length as usize];
        let mut at = 0;
        for part in all.chunks_mut(piece) {
            assert_eq!(archive.read_at(at, part).unwrap(), part.len());
            at += part.len() as u64;
        }
        assert_eq!(archive.read_at(archive.length, &mut [0; 9]).unwrap(), 0);
        all
    }

    #[test]
    fn a_folder_is_an_archive_of_what_its_index_names() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        assert!(open(folder.path()).unwrap().is_none());
        write(at("meta.json"), r#"{ "files": ["b.webp", "a.webp", "none.webp"] }"#).unwrap();
        write(at("a.webp"), b"123456789").unwrap();
        write(at("b.webp"), []).unwrap();
        write(at("c.webp"), b"nobody names it").unwrap();
        let archive = open(folder.path()).unwrap().unwrap();
        let all = bytes(&archive, 7);
        assert_eq!(all, bytes(&open(&at("meta.json")).unwrap().unwrap(), 1000));
        assert!(all.starts_with(archive.head()) && all.starts_with(b"PK\x03\x04"));
        let found = |text: &[u8]| all.windows(text.len()).filter(|window| *window == text).count();
        assert_eq!((found(b"PK\x03\x04"), found(b"PK\x01\x02"), found(b"c.webp")), (3, 3, 0));
        // The checksum of these digits is known; it stands before them and in the table.
        assert_eq!((found(b"a.webp123456789"), found(&0xcbf4_3926u32.to_le_bytes())), (1, 2));
        assert!(open(&at("a.webp")).unwrap().is_none());
    }
}
