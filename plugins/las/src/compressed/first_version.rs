//! Colours and extra bytes in the first version of the compression.
//!
//! The decoders of `laz` 0.13 keep bits of the last colour's upper bytes, and take extra bytes for those of the
//! second version.

use super::layers::{integers, symbols};
use crate::numbers::u16_at;
use laz::decoders::ArithmeticDecoder;
use laz::decompressors::IntegerDecompressor;
use laz::models::ArithmeticModel;
use laz::record::FieldDecompressor;
use std::io::{self, Read};

/// The colours of points that are compressed one after the other.
pub(super) struct PointColors {
    last: [u16; 3],
    /// Which of the six bytes change.
    changes: ArithmeticModel,
    bytes: IntegerDecompressor,
}

impl PointColors {
    pub(super) fn new() -> Self {
        Self { last: [0; 3], changes: symbols(64), bytes: integers(8, 6) }
    }
}

impl<R: Read> FieldDecompressor<R> for PointColors {
    fn size_of_field(&self) -> usize {
        6
    }

    fn decompress_first(&mut self, bytes: &mut R, first: &mut [u8]) -> io::Result<()> {
        bytes.read_exact(first)?;
        self.last = [0, 2, 4].map(|at| u16_at(first, at));
        Ok(())
    }

    fn decompress_with(
        &mut self,
        bytes: &mut ArithmeticDecoder<R>,
        color: &mut [u8],
    ) -> io::Result<()> {
        let changes = bytes.decode_symbol(&mut self.changes)?;
        // Bytes lie in the order of their bits: the lower one of red, the upper one, that of green.
        let channels = self.last.iter_mut().zip(color.chunks_exact_mut(2));
        for (context, (channel, out)) in (0..).step_by(2).zip(channels) {
            let mut parts = channel.to_le_bytes();
            for (context, part) in (context..).zip(&mut parts) {
                if changes & (1 << context) != 0 {
                    let guess = i32::from(*part);
                    *part = self.bytes.decompress(bytes, guess, context)? as u8;
                }
            }
            *channel = u16::from_le_bytes(parts);
            out.copy_from_slice(&parts);
        }
        Ok(())
    }
}

/// The extra bytes of points that are compressed one after the other.
pub(super) struct PointBytes {
    last: Vec<u8>,
    bytes: IntegerDecompressor,
}

impl PointBytes {
    /// So many a point.
    pub(super) fn new(n: u16) -> Self {
        Self { last: vec![0; usize::from(n)], bytes: integers(8, u32::from(n)) }
    }
}

impl<R: Read> FieldDecompressor<R> for PointBytes {
    fn size_of_field(&self) -> usize {
        self.last.len()
    }

    fn decompress_first(&mut self, bytes: &mut R, first: &mut [u8]) -> io::Result<()> {
        bytes.read_exact(first)?;
        self.last.copy_from_slice(first);
        Ok(())
    }

    fn decompress_with(
        &mut self,
        bytes: &mut ArithmeticDecoder<R>,
        out: &mut [u8],
    ) -> io::Result<()> {
        for (context, last) in (0..).zip(&mut self.last) {
            *last = self.bytes.decompress(bytes, i32::from(*last), context)? as u8;
        }
        out.copy_from_slice(&self.last);
        Ok(())
    }
}
