//! Compressed bytes to point records.

use super::{Compression, Order, fields};
use crate::numbers::u32_at;
use laz::DecompressionSelection;
use laz::record::{
    LayeredPointRecordDecompressor, RecordDecompressor as _, SequentialPointRecordDecompressor,
};
use std::io::{self, Cursor, Read};
use std::panic::{AssertUnwindSafe, catch_unwind};
use surfelshop_api::format::FileSource;
use surfelshop_api::{Error, Result};

/// Bytes that a stream reads at once.
const STREAM_BUFFER: usize = 1 << 18;

/// How far records were decoded.
#[derive(Debug, Default)]
pub(crate) struct Decoded {
    /// Records that are right as far as the decoder knows.
    pub(crate) n_records: usize,
    /// Why it went no further.
    pub(crate) fault: Option<String>,
}

/// Decodes the records of a chunk, or of a whole run.
pub(crate) enum Decoder<'a, R: Read> {
    Points(Box<SequentialPointRecordDecompressor<'a, R>>),
    Layers(Box<LayeredPointRecordDecompressor<'a, Cursor<&'a [u8]>>>),
}

impl<'a> Decoder<'a, &'a [u8]> {
    /// One of a chunk in memory; only these fields are decoded, where they can be passed over.
    ///
    /// # Errors
    /// Where the compression is of a version that is unknown, or the chunk is shorter than it says.
    pub(crate) fn of_chunk(
        compression: &Compression,
        chunk: &'a [u8],
        selection: Option<DecompressionSelection>,
    ) -> Result<Self> {
        if compression.order != Order::Layers {
            return Self::of_points(compression, chunk);
        }
        // The decoder takes memory for layers as long as they say they are.
        if !chunk.is_empty() {
            layers(compression, chunk)?;
        }
        let mut decoder = LayeredPointRecordDecompressor::new(Cursor::new(chunk));
        fields::add_layers(&mut decoder, compression.vlr.items())?;
        if let Some(selection) = selection {
            decoder.set_selection(selection);
        }
        Ok(Self::Layers(Box::new(decoder)))
    }
}

impl<R: Read> Decoder<'_, R> {
    /// One of points that follow one another.
    ///
    /// # Errors
    /// Where the compression is of a version that is unknown.
    pub(crate) fn of_points(compression: &Compression, bytes: R) -> Result<Self> {
        let mut decoder = SequentialPointRecordDecompressor::new(bytes);
        fields::add_points(&mut decoder, compression.vlr.items())?;
        Ok(Self::Points(Box::new(decoder)))
    }

    /// What is left of the bytes.
    pub(crate) fn into_bytes(self) -> Option<R> {
        match self {
            Self::Points(decoder) => Some((*decoder).into_inner()),
            Self::Layers(_) => None,
        }
    }

    /// Fills `records` from the beginning, as far as it goes. After a fault nothing more is decoded.
    pub(crate) fn fill(&mut self, records: &mut [u8], record_len: usize) -> Decoded {
        let mut n_records = 0;
        let records = records.chunks_exact_mut(record_len);
        // Damaged bytes make the decoder read outside its tables, which panics.
        let result = catch_unwind(AssertUnwindSafe(|| -> io::Result<()> {
            match self {
                Self::Points(decoder) => {
                    for record in records {
                        decoder.decompress_next(record)?;
                        n_records += 1;
                    }
                }
                Self::Layers(decoder) => {
                    for record in records {
                        decoder.decompress_next(record)?;
                        n_records += 1;
                    }
                }
            }
            Ok(())
        }));
        let fault = match result {
            Ok(Ok(())) => None,
            Ok(Err(error)) if error.kind() == io::ErrorKind::UnexpectedEof => {
                Some("the file is damaged or cut short".to_owned())
            }
            Ok(Err(error)) => Some(error.to_string()),
            Err(_panic) => Some("its bytes are damaged".to_owned()),
        };
        Decoded { n_records, fault }
    }
}

/// The number of points that a chunk of layers says it has, and its length in bytes.
///
/// # Errors
/// Where the chunk is shorter.
pub(super) fn layers(compression: &Compression, chunk: &[u8]) -> Result<(u64, u64)> {
    let head = compression.record_len;
    let n_layers = compression.n_layers();
    let body = head + 4 + 4 * n_layers;
    if chunk.len() < body {
        return Err(Error::new(format!(
            "expected a chunk of at least {body} bytes, found {}",
            chunk.len()
        )));
    }
    let len = body as u64 + layers_len(&chunk[head + 4..body]);
    if len > chunk.len() as u64 {
        return Err(Error::new(format!("expected a chunk of {len} bytes, found {}", chunk.len())));
    }
    Ok((u64::from(u32_at(chunk, head)), len))
}

/// Bytes of layers together, from the list of their lengths.
pub(super) fn layers_len(lengths: &[u8]) -> u64 {
    lengths.chunks_exact(4).map(|length| u64::from(u32_at(length, 0))).sum()
}

/// Bytes of a file, one after the other.
pub(crate) struct Stream {
    file: FileSource,
    at: u64,
    buffer: Vec<u8>,
    place: usize,
}

impl Stream {
    /// The bytes from `at` on.
    pub(crate) fn new(file: &FileSource, at: u64) -> Self {
        Self { file: file.clone(), at, buffer: Vec::new(), place: 0 }
    }

    #[cold]
    fn refill(&mut self) -> io::Result<()> {
        self.buffer.resize(STREAM_BUFFER, 0);
        let found = self.file.read_at(self.at, &mut self.buffer).map_err(|error| {
            self.buffer.clear();
            io::Error::other(error.message().to_owned())
        })?;
        self.buffer.truncate(found);
        self.at += found as u64;
        self.place = 0;
        Ok(())
    }
}

impl Read for Stream {
    #[inline]
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if self.place == self.buffer.len() {
            self.refill()?;
        }
        let rest = &self.buffer[self.place..];
        let n = out.len().min(rest.len());
        out[..n].copy_from_slice(&rest[..n]);
        self.place += n;
        Ok(n)
    }
}
