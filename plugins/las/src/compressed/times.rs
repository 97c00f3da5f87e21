//! Times of pulses, which are compressed as steps along up to four sequences.
//!
//! The decoder of `laz` calls itself where a time belongs to another sequence than the last one, and damaged bytes
//! make it do so until the stack is full, which ends the program. Here it is a loop that ends.

use laz::decoders::ArithmeticDecoder;
use laz::decompressors::{IntegerDecompressor, IntegerDecompressorBuilder};
use laz::models::{ArithmeticModel, ArithmeticModelBuilder};
use laz::record::FieldDecompressor;
use std::io::{self, Read};

/// Most changes of sequence before a time; writers make one.
const MOST_CHANGES: usize = 8;

/// How times are written: with other fields point by point, or in a layer of their own, where times that stay the
/// same are not written at all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    InPoints,
    InLayer,
}

/// Times that were decoded so far.
pub(super) struct Times {
    kind: Kind,
    /// The sequence of the last time, and the one that was begun last.
    current: usize,
    newest: usize,
    /// Of each sequence the last time, as the bits of its float, the usual step, and how many steps were far from it.
    last: [i64; 4],
    step: [i32; 4],
    n_far: [u8; 4],
    multiple: ArithmeticModel,
    without_step: ArithmeticModel,
    differences: IntegerDecompressor,
}

impl Times {
    /// Times that follow this one.
    pub(super) fn new(first: i64, kind: Kind) -> Self {
        let skipped = u32::from(kind == Kind::InLayer);
        Self {
            kind,
            current: 0,
            newest: 0,
            last: [first, 0, 0, 0],
            step: [0; 4],
            n_far: [0; 4],
            multiple: ArithmeticModelBuilder::new(516 - skipped).build(),
            without_step: ArithmeticModelBuilder::new(6 - skipped).build(),
            differences: IntegerDecompressorBuilder::new().bits(32).contexts(9).build_initialized(),
        }
    }

    /// The last time.
    pub(super) fn last(&self) -> i64 {
        self.last[self.current]
    }

    /// The next time.
    ///
    /// # Errors
    /// Where the bytes end, or are damaged.
    pub(super) fn decode<R: Read>(&mut self, bytes: &mut ArithmeticDecoder<R>) -> io::Result<i64> {
        for _ in 0..MOST_CHANGES {
            let change = if self.step[self.current] == 0 {
                self.first_step(bytes)?
            } else {
                self.next_step(bytes)?
            };
            match change {
                0 => return Ok(self.last()),
                by => self.current = (self.current + by) & 3,
            }
        }
        Err(io::Error::new(io::ErrorKind::InvalidData, "its times of pulses are damaged"))
    }

    /// A time of a sequence that has no step yet; by how many sequences to go on where it is not of this one.
    fn first_step<R: Read>(&mut self, bytes: &mut ArithmeticDecoder<R>) -> io::Result<usize> {
        let code = bytes.decode_symbol(&mut self.without_step)? as usize;
        // In layers there is no code for a time that stays.
        match code + usize::from(self.kind == Kind::InLayer) {
            0 => {}
            1 => {
                let step = self.differences.decompress(bytes, 0, 0)?;
                self.step[self.current] = step;
                self.advance(step);
                self.n_far[self.current] = 0;
            }
            2 => self.begin(bytes)?,
            code => return Ok(code - 2),
        }
        Ok(0)
    }

    /// A time of a sequence with a step: a multiple of it, and a difference from that.
    fn next_step<R: Read>(&mut self, bytes: &mut ArithmeticDecoder<R>) -> io::Result<usize> {
        let mut code = bytes.decode_symbol(&mut self.multiple)? as i32;
        if self.kind == Kind::InLayer && code >= 511 {
            code += 1;
        }
        let step = self.step[self.current];
        let (multiple, context, is_far) = match code {
            0 => (0, 7, true),
            1 => (1, 1, false),
            2..=9 => (code, 2, false),
            10..=499 => (code, 3, false),
            500 => (500, 4, true),
            501..=509 => (500 - code, 5, false),
            510 => (-10, 6, true),
            511 => return Ok(0),
            512 => {
                self.begin(bytes)?;
                return Ok(0);
            }
            _ => return Ok((code - 512) as usize),
        };
        let found = self.differences.decompress(bytes, step.wrapping_mul(multiple), context)?;
        self.advance(found);
        let n_far = &mut self.n_far[self.current];
        if is_far {
            *n_far += 1;
            if *n_far > 3 {
                *n_far = 0;
                self.step[self.current] = found;
            }
        } else if code == 1 {
            *n_far = 0;
        }
        Ok(0)
    }

    fn advance(&mut self, by: i32) {
        let last = &mut self.last[self.current];
        *last = last.wrapping_add(i64::from(by));
    }

    /// Begins a sequence with a time that is far from all others.
    fn begin<R: Read>(&mut self, bytes: &mut ArithmeticDecoder<R>) -> io::Result<()> {
        let upper = (self.last() >> 32) as i32;
        let upper = self.differences.decompress(bytes, upper, 8)?;
        let lower = bytes.read_int()?;
        self.newest = (self.newest + 1) & 3;
        self.current = self.newest;
        self.last[self.current] = i64::from(upper) << 32 | i64::from(lower);
        self.step[self.current] = 0;
        self.n_far[self.current] = 0;
        Ok(())
    }
}

/// The times of points that are compressed one after the other, in the second version.
pub(super) struct PointTimes(Times);

impl PointTimes {
    pub(super) fn new() -> Self {
        Self(Times::new(0, Kind::InPoints))
    }
}

impl<R: Read> FieldDecompressor<R> for PointTimes {
    fn size_of_field(&self) -> usize {
        8
    }

    fn decompress_first(&mut self, bytes: &mut R, first: &mut [u8]) -> io::Result<()> {
        bytes.read_exact(first)?;
        self.0.last[0] = i64::from_le_bytes(crate::numbers::bytes(first, 0));
        Ok(())
    }

    fn decompress_with(
        &mut self,
        bytes: &mut ArithmeticDecoder<R>,
        time: &mut [u8],
    ) -> io::Result<()> {
        time.copy_from_slice(&self.0.decode(bytes)?.to_le_bytes());
        Ok(())
    }
}
