//! Version 4: a plain header, and a stream of zstd for each attribute behind a table of their lengths.

use super::Attributes;
use super::axes::Axes;
use super::header::{ATTRIBUTES, Attribute, Header, LEN};
use ruzstd::decoding::{FrameDecoder, StreamingDecoder};
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom, Take};
use surfelshop_api::format::{FileSource, FileStream};
use surfelshop_api::prelude::{Error, Result};

/// Bytes of the header.
const HEADER: u64 = 32;

/// Bytes of an entry of the table: length packed, length unpacked.
const ENTRY: u64 = 16;

/// Most bytes of extensions that are looked at.
const MOST_EXTENSIONS: u64 = 1 << 16;

/// Most bytes of positions that are believed to be packed into one, as the original reader has it.
const MOST_RATIO: u64 = 1024;

/// Memory that a stream may look back on: what all decoders grant, and what the original ones grant at most.
const WINDOW: std::ops::RangeInclusive<u64> = 8 << 20..=128 << 20;

/// Where the stream of each attribute lies: its first byte and its length; `None` where there is none.
pub(super) struct Table([Option<(u64, u64)>; 6]);

/// Reads the header, the extensions and the table, which are held against the file's length and each other.
pub(super) fn open(file: &FileSource) -> Result<(Header, Table)> {
    let head = file.bytes_at(0, HEADER)?;
    let (first, rest) = head.split_first_chunk::<LEN>().ok_or_else(|| Error::new("no header"))?;
    let mut header = Header::parse(first, 4..=4)?;
    let n_streams = first[LEN - 1];
    let table = u64::from(rest.first_chunk().map_or(0, |place| u32::from_le_bytes(*place)));
    if table < HEADER {
        return Err(Error::new(format!(
            "expected a table of streams from byte {HEADER} on, found it at byte {table}: the file is damaged"
        )));
    }
    let positions = header.points * header.sizes()[Attribute::Positions as usize] as u64;
    if positions / MOST_RATIO > file.length() {
        return Err(Error::new(format!(
            "expected {} Gaussians, found {} bytes, which cannot hold them: the file is cut short, or its header is \
             damaged",
            header.points,
            file.length()
        )));
    }
    if header.extended {
        let records = file.bytes_at(HEADER, (table - HEADER).min(MOST_EXTENSIONS))?;
        header.axes = Axes::of_extensions(&records);
    }
    let streams = streams(file, &header, n_streams, table)?;
    Ok((header, streams))
}

fn streams(file: &FileSource, header: &Header, n_streams: u8, table: u64) -> Result<Table> {
    let lengths = header.sizes().map(|size| header.points * size as u64);
    let expected = lengths.iter().filter(|length| **length > 0).count();
    if expected != usize::from(n_streams) {
        return Err(Error::new(format!(
            "expected {expected} streams, found {n_streams}: the file is damaged"
        )));
    }
    let entries = file.bytes_at(table, ENTRY * u64::from(n_streams))?;
    let (entries, _) = entries.as_chunks::<{ ENTRY as usize }>();
    let mut entries = entries.iter();
    let mut streams = [None; 6];
    // Within the file, since the table is.
    let mut place = table + ENTRY * u64::from(n_streams);
    for attribute in ATTRIBUTES {
        let length = lengths[attribute as usize];
        if length == 0 {
            continue;
        }
        let words = entries.next().map(|entry| entry.as_chunks::<8>().0);
        let [packed, unpacked] =
            [0, 1].map(|i| words.map_or(0, |words| u64::from_le_bytes(words[i])));
        let name = attribute.name();
        if unpacked != length {
            return Err(Error::new(format!(
                "expected {length} bytes of {name}, found {unpacked} in the table: the file is damaged"
            )));
        }
        let left = file.length() - place;
        if packed > left {
            return Err(Error::new(format!(
                "expected {packed} packed bytes of {name} from byte {place}, found {left}: the file is cut short"
            )));
        }
        streams[attribute as usize] = Some((place, packed));
        place += packed;
    }
    Ok(Table(streams))
}

impl Table {
    /// Begins to unpack the attributes that are wanted.
    pub(super) fn start(
        self,
        file: &FileSource,
        header: &Header,
        wanted: &[bool; 6],
    ) -> Result<Streams> {
        let mut streams = [const { None }; 6];
        for attribute in ATTRIBUTES {
            let i = attribute as usize;
            let Some((place, packed)) = self.0[i].filter(|_| wanted[i]) else { continue };
            let mut stream = file.stream();
            stream.seek(SeekFrom::Start(place))?;
            let stream = BufReader::with_capacity(1 << 16, stream.take(packed));
            let window = header.points.saturating_mul(header.sizes()[i] as u64);
            let window = window.clamp(*WINDOW.start(), *WINDOW.end());
            let decoder = StreamingDecoder::new_with_max_window_size(stream, window);
            streams[i] = Some(decoder.map_err(|error| damaged(attribute, &error))?);
        }
        Ok(Streams(streams))
    }
}

fn damaged(attribute: Attribute, error: &dyn std::fmt::Display) -> Error {
    let error = error.to_string();
    let reason = error.lines().next().unwrap_or_default();
    Error::new(format!(
        "expected a stream of zstd of {}, found damaged bytes: {reason}",
        attribute.name()
    ))
}

type Decoder = StreamingDecoder<BufReader<Take<FileStream>>, FrameDecoder>;

/// Attributes that are unpacked as they are read.
pub(super) struct Streams([Option<Decoder>; 6]);

impl Streams {
    /// Whether the streams end where their last Gaussian does.
    pub(super) fn finish(mut self) -> Result<()> {
        for attribute in ATTRIBUTES {
            let Some(stream) = &mut self.0[attribute as usize] else { continue };
            match stream.read(&mut [0]) {
                Ok(0) => {}
                Ok(_) => {
                    return Err(Error::new(format!(
                        "expected no more {}, found more: the file is damaged",
                        attribute.name()
                    )));
                }
                Err(error) => return Err(damaged(attribute, &error)),
            }
        }
        Ok(())
    }
}

impl Attributes for Streams {
    fn read(&mut self, attribute: Attribute, bytes: &mut [u8]) -> Result<()> {
        let name = attribute.name();
        let stream = self.0[attribute as usize].as_mut();
        let stream = stream.ok_or_else(|| Error::new(format!("expected {name}, found none")))?;
        stream.read_exact(bytes).map_err(|error| match error.kind() {
            ErrorKind::UnexpectedEof => {
                Error::new(format!("expected more {name}, found none: the file is damaged"))
            }
            _ => damaged(attribute, &error),
        })
    }
}
