//! LZF, the compression of PCD: runs of literal bytes, and copies of earlier output at most 8192 bytes back.
//!
//! A byte below 32 announces one more literal bytes than it says. Any other has a length in its upper three bits,
//! 7 standing for 7 plus the next byte, and the upper five bits of a distance, the rest of which is in the byte
//! after it; length plus 2 bytes are copied from distance plus 1 back. Compressed pieces can be put one behind the
//! other.

use std::ops::Range;
use surfelshop_api::format::FileSource;
use surfelshop_api::prelude::{Error, Job, Result};

/// Most bytes that one byte of compressed data can stand for: 264 in three.
const MAX_RATIO: usize = 88;

const MAX_LITERALS: usize = 32;
const MAX_DISTANCE: usize = 1 << 13;
const MAX_COPY: usize = 264;
const HASH_BITS: u32 = 15;

/// Bytes of output between two questions whether to go on.
const ASK: usize = 1 << 20;

fn damaged(at: u64) -> Error {
    Error::new(format!(
        "expected compressed points, found damage at their byte {at}; take an undamaged copy of the file"
    ))
}

/// Refuses so few compressed bytes that no data of this length is in them.
///
/// # Errors
/// Where that is so.
pub(crate) fn check_size(packed: usize, len: usize) -> Result<()> {
    if len > packed.saturating_mul(MAX_RATIO) {
        return Err(Error::new(format!(
            "expected compressed points of {len} bytes, found {packed} bytes, which cannot hold them: the header is wrong or the file cut short"
        )));
    }
    Ok(())
}

/// Decompresses to exactly `len` bytes. `goes_on` is asked every million bytes, with how many there are.
///
/// # Errors
/// Where the data is damaged, memory runs out, or `goes_on` fails.
pub(crate) fn decompress(
    input: &[u8],
    len: usize,
    mut goes_on: impl FnMut(usize) -> Result<()>,
) -> Result<Vec<u8>> {
    let damaged = |at: usize| damaged(at as u64);
    check_size(input.len(), len)?;
    let mut out = Vec::new();
    out.try_reserve_exact(len)?;
    let (mut at, mut next_question) = (0, ASK);
    while let Some(&control) = input.get(at) {
        at += 1;
        let control = usize::from(control);
        if control < MAX_LITERALS {
            let literals = input.get(at..at + control + 1).ok_or_else(|| damaged(at))?;
            if literals.len() > len - out.len() {
                return Err(damaged(at));
            }
            out.extend_from_slice(literals);
            at += literals.len();
        } else {
            let mut copied = control >> 5;
            if copied == 7 {
                copied += usize::from(*input.get(at).ok_or_else(|| damaged(at))?);
                at += 1;
            }
            let low = usize::from(*input.get(at).ok_or_else(|| damaged(at))?);
            at += 1;
            let distance = ((control & 31) << 8) + low + 1;
            if distance > out.len() || copied + 2 > len - out.len() {
                return Err(damaged(at));
            }
            copy_back(&mut out, distance, copied + 2);
        }
        if out.len() >= next_question {
            goes_on(out.len())?;
            next_question = out.len() + ASK;
        }
    }
    if out.len() == len {
        return Ok(out);
    }
    Err(Error::new(format!("expected {len} bytes of decompressed points, found {}", out.len())))
}

/// Bytes of a file that a decoder reads at once.
const BLOCK: usize = 1 << 14;

/// Bytes of output at which a decoder lets go of those that no copy reaches.
const MOST_HELD: usize = 1 << 16;

/// Decompresses a part of a file piece by piece; a clone goes on from where the other is.
#[derive(Clone)]
pub(crate) struct Decoder<'a> {
    file: &'a FileSource,
    /// What of the file is still to be read, and the offset of the first compressed byte.
    left: Range<u64>,
    start: u64,
    input: Vec<u8>,
    input_at: usize,
    /// Output that later copies may reach, and how much of it was taken.
    out: Vec<u8>,
    taken: usize,
}

impl<'a> Decoder<'a> {
    /// Of these bytes of a file.
    pub(crate) fn new(file: &'a FileSource, bytes: Range<u64>) -> Self {
        let start = bytes.start;
        let (input, out) = (Vec::new(), Vec::new());
        Self { file, left: bytes, start, input, input_at: 0, out, taken: 0 }
    }

    /// Appends the next bytes of output.
    ///
    /// # Errors
    /// Where the data is damaged, memory runs out, or the system refuses.
    pub(crate) fn read(&mut self, mut n: usize, into: &mut Vec<u8>) -> Result<()> {
        into.try_reserve(n)?;
        while n > 0 {
            let held = self.held(n)?;
            into.extend_from_slice(held);
            n -= held.len();
        }
        Ok(())
    }

    /// Passes over the next bytes of output.
    ///
    /// # Errors
    /// As [`read`](Self::read), and where the user asked to stop.
    pub(crate) fn skip(&mut self, mut n: usize, job: &Job<'_>) -> Result<()> {
        let mut next_question = n.saturating_sub(ASK);
        while n > 0 {
            n -= self.held(n)?.len();
            if n <= next_question {
                job.check()?;
                next_question = n.saturating_sub(ASK);
            }
        }
        Ok(())
    }

    /// Some of the next bytes of output, at least one and at most `n`.
    fn held(&mut self, n: usize) -> Result<&[u8]> {
        if self.taken == self.out.len() {
            if self.out.len() > MOST_HELD {
                self.out.drain(..self.out.len() - MAX_DISTANCE);
            }
            self.taken = self.out.len();
            while self.out.len() < self.taken + BLOCK && self.step()? {}
            if self.out.len() == self.taken {
                return Err(Error::new(
                    "expected more decompressed points, found the end of the compressed ones: the file is damaged",
                ));
            }
        }
        let from = self.taken;
        self.taken = self.out.len().min(from + n);
        Ok(&self.out[from..self.taken])
    }

    /// Decodes a run or a copy; `false` at the end.
    fn step(&mut self) -> Result<bool> {
        let Some(control) = self.byte()? else { return Ok(false) };
        let control = usize::from(control);
        if control < MAX_LITERALS {
            for _ in 0..=control {
                let byte = self.needed()?;
                self.out.push(byte);
            }
            return Ok(true);
        }
        let mut copied = control >> 5;
        if copied == 7 {
            copied += usize::from(self.needed()?);
        }
        let distance = ((control & 31) << 8) + usize::from(self.needed()?) + 1;
        if distance > self.out.len() {
            return Err(damaged(self.place()));
        }
        copy_back(&mut self.out, distance, copied + 2);
        Ok(true)
    }

    /// Where the next byte lies among the compressed ones.
    fn place(&self) -> u64 {
        self.left.start - self.start - (self.input.len() - self.input_at) as u64
    }

    fn needed(&mut self) -> Result<u8> {
        let byte = self.byte()?;
        byte.ok_or_else(|| damaged(self.place()))
    }

    fn byte(&mut self) -> Result<Option<u8>> {
        if self.input_at == self.input.len() {
            let n = (self.left.end - self.left.start).min(BLOCK as u64);
            if n == 0 {
                return Ok(None);
            }
            // At most a block.
            self.input.resize(n as usize, 0);
            self.file.read_exact_at(self.left.start, &mut self.input)?;
            self.left.start += n;
            self.input_at = 0;
        }
        let byte = self.input[self.input_at];
        self.input_at += 1;
        Ok(Some(byte))
    }
}

/// Appends `n` bytes from `distance` back, which may be among those that are appended.
fn copy_back(out: &mut Vec<u8>, distance: usize, n: usize) {
    let start = out.len() - distance;
    if distance == 1 {
        let byte = out[start];
        out.resize(out.len() + n, byte);
        return;
    }
    let mut left = n;
    // What is appended repeats with this period, so that the source can stay where it is.
    while left > 0 {
        let part = left.min(distance);
        out.extend_from_within(start..start + part);
        left -= part;
    }
}

fn hash(bytes: [u8; 3]) -> usize {
    let [a, b, c] = bytes.map(u32::from);
    let word = a | b << 8 | c << 16;
    (word.wrapping_mul(0x9e37_79b1) >> (32 - HASH_BITS)) as usize
}

/// Compresses bytes; incompressible ones grow by a 32nd.
pub(crate) fn compress(input: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(input.len() / 2);
    // Where three bytes of this hash were last, plus one.
    let mut last = vec![0usize; 1 << HASH_BITS];
    let (mut at, mut literals_from) = (0, 0);
    while let Some(&three) = input.get(at..).and_then(<[u8]>::first_chunk::<3>) {
        let place = &mut last[hash(three)];
        let before = std::mem::replace(place, at + 1);
        let candidate = before
            .checked_sub(1)
            .filter(|&from| at - from <= MAX_DISTANCE && input[from..].starts_with(&three));
        let Some(from) = candidate else {
            at += 1;
            continue;
        };
        let most = (input.len() - at).min(MAX_COPY);
        let same = input[from..].iter().zip(&input[at..at + most]).take_while(|(a, b)| a == b);
        let n = same.count();
        literals(&mut out, &input[literals_from..at]);
        copy(&mut out, at - from - 1, n - 2);
        // The places in the copy are found by later ones, too; a few are enough.
        for inner in (at + 1..at + n).step_by(n.div_ceil(8)) {
            if let Some(&three) = input[inner..].first_chunk::<3>() {
                last[hash(three)] = inner + 1;
            }
        }
        at += n;
        literals_from = at;
    }
    literals(&mut out, &input[literals_from..]);
    out
}

fn literals(out: &mut Vec<u8>, bytes: &[u8]) {
    for run in bytes.chunks(MAX_LITERALS) {
        out.push((run.len() - 1) as u8);
        out.extend_from_slice(run);
    }
}

/// A copy of `n` plus 2 bytes, `n` from 1, from `back` plus 1 bytes back.
fn copy(out: &mut Vec<u8>, back: usize, n: usize) {
    let (high, low) = ((back >> 8) as u8, back as u8);
    if n < 7 {
        out.extend([(n as u8) << 5 | high, low]);
    } else {
        out.extend([7 << 5 | high, (n - 7) as u8, low]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round_trip(bytes: &[u8]) -> usize {
        let compressed = compress(bytes);
        assert!(compressed.len() <= bytes.len() + bytes.len() / 32 + 1);
        assert_eq!(decompress(&compressed, bytes.len(), |_| Ok(())).unwrap(), bytes);
        compressed.len()
    }

    #[test]
    fn what_was_compressed_comes_back() {
        let mut state = 1u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        let noise: Vec<u8> = (0..100_000).map(|_| random()).collect();
        round_trip(&noise);
        let steps: Vec<u8> = (0..300_000u32).map(|i| (i / 700) as u8).collect();
        assert!(round_trip(&steps) < 6000);
        for period in [1, 2, 3, 5, 263, 264, 265, 8191, 8192, 8193] {
            let repeated: Vec<u8> =
                noise.iter().copied().take(period).cycle().take(30_000).collect();
            let found = round_trip(&repeated);
            assert!(found < 2 * period + 1000 || period > 8192, "{period} {found}");
        }
        for n in 0..70 {
            assert!(round_trip(&noise[..n]) >= n);
        }
    }

    #[test]
    fn liblzf_streams_are_understood() {
        // "abcabcabcabc", then 300 times "x": literals, a copy that overlaps itself, a long one.
        let stream = [2, b'a', b'b', b'c', 7 << 5, 0, 2, 0, b'x', 7 << 5, 255, 0, 7 << 5, 26, 0];
        let expected = [b"abc".repeat(4), b"x".repeat(300)].concat();
        assert_eq!(decompress(&stream, expected.len(), |_| Ok(())).unwrap(), expected);
    }

    #[test]
    fn damaged_streams_are_refused() {
        for stream in
            [&[5, 1, 2][..], &[0, 7, 32, 1], &[0, 7, 7 << 5], &[0, 7, 7 << 5, 1], &[0, 7, 32]]
        {
            let line = decompress(stream, 20, |_| Ok(())).unwrap_err().to_string();
            assert!(line.contains("damage"), "{line}");
        }
        assert!(decompress(&[0, 7], 2, |_| Ok(())).unwrap_err().to_string().contains("found 1"));
        assert!(decompress(&[1, 7, 7], 1, |_| Ok(())).is_err());
        let line = decompress(&[0, 7], usize::MAX, |_| Ok(())).unwrap_err().to_string();
        assert!(line.contains("cannot hold"), "{line}");
    }
}
