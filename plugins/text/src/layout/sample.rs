//! Lines from the beginning of a body of lines and from all over it.

use crate::text::{Lines, MAX_LINE, count, is_comment, line_end, long_line};
use surfelshop_api::Result;
use surfelshop_api::format::FileSource;

/// Lines of the beginning that are looked at.
const HEAD_LINES: usize = 1000;
/// Bytes of the beginning that are looked at, where lines are long.
const HEAD_BYTES: usize = 256 << 10;
/// Places behind the beginning that are looked at, and the bytes of each.
const PIECES: u64 = 15;
const PIECE_BYTES: usize = 8 << 10;

/// Lines from the beginning of a body and from all over it.
pub(crate) struct Sample {
    /// The first lines, whole.
    pub(crate) head: Vec<u8>,
    /// Where the head begins in the file.
    pub(crate) start: u64,
    /// Whether the file ends with the head.
    pub(crate) is_all: bool,
    /// Lines from elsewhere, whole.
    pieces: Vec<Vec<u8>>,
}

impl Sample {
    /// Reads so many lines that are neither blank nor comments and are passed over, and as many as are looked at
    /// behind them, at most `most`. Where lines that are a count begin another cloud, no more are read than up to
    /// the first of them.
    ///
    /// # Errors
    /// Where a line is too long, or the system refuses.
    pub(crate) fn of_head(
        file: &FileSource,
        start: u64,
        passed_over: usize,
        most: u64,
        has_counts: bool,
    ) -> Result<Self> {
        let most = usize::try_from(most).map_or(HEAD_LINES, |most| most.min(HEAD_LINES));
        let most = most.saturating_add(passed_over);
        let mut len = most.saturating_mul(64).clamp(256, 4 << 10);
        loop {
            let (head, at_end) = bytes(file, start, len)?;
            let head = whole_lines(head, at_end);
            let n_lines = Lines::of(&head).filter(|(_, line)| has_words(line)).count();
            let ends = has_counts
                && Lines::of(&head).any(|(_, line)| has_words(line) && count(line).is_some());
            if at_end || ends || n_lines >= most || (len >= HEAD_BYTES && n_lines > passed_over) {
                return Ok(Self { head, start, is_all: at_end, pieces: Vec::new() });
            }
            if len as u64 >= MAX_LINE {
                return Err(long_line(start));
            }
            len = (len * 4).min(MAX_LINE as usize);
        }
    }

    /// Adds lines from between the head and `end`.
    ///
    /// # Errors
    /// Where the system refuses.
    pub(crate) fn spread(&mut self, file: &FileSource, end: u64) -> Result<()> {
        let head_end = self.start + self.head.len() as u64;
        let rest = end.min(file.length()).saturating_sub(head_end);
        let last = rest.saturating_sub(PIECE_BYTES as u64);
        if last == 0 {
            if rest > 0 {
                self.piece(file, head_end, true)?;
            }
            return Ok(());
        }
        for i in 1..=PIECES {
            let place = head_end + (u128::from(last) * u128::from(i) / u128::from(PIECES)) as u64;
            self.piece(file, place, false)?;
        }
        Ok(())
    }

    fn piece(&mut self, file: &FileSource, place: u64, begins_line: bool) -> Result<()> {
        let (mut piece, at_end) = bytes(file, place, PIECE_BYTES)?;
        if !begins_line {
            let (_, next) = line_end(&piece, 0);
            piece.drain(..next);
        }
        self.pieces.push(whole_lines(piece, at_end));
        Ok(())
    }

    /// The lines of the head, comments and blank ones as well, with the places where they begin in it.
    pub(crate) fn head_lines(&self) -> impl Iterator<Item = (usize, &[u8])> {
        Lines::of(&self.head)
    }

    /// Bytes of a line that is shorter than nearly all others, its end with it.
    pub(crate) fn short_line(&self) -> usize {
        let head = self.head_lines().map(|(_, line)| line).filter(|line| has_words(line));
        let mut lengths: Vec<usize> = head.chain(self.spread_lines()).map(<[u8]>::len).collect();
        lengths.sort_unstable();
        lengths.get(lengths.len() / 20).map_or(0, |shortest| shortest + 1)
    }

    /// The lines of the pieces that have words.
    pub(crate) fn spread_lines(&self) -> impl Iterator<Item = &[u8]> {
        let lines = self.pieces.iter().flat_map(|piece| Lines::of(piece));
        lines.map(|(_, line)| line).filter(|line| has_words(line))
    }

    /// The place in the file of one in the head.
    pub(crate) fn place(&self, at: usize) -> u64 {
        self.start + at as u64
    }

    /// Cuts the head off after `most` lines that have words and, where lines that are a count begin another cloud,
    /// before the first of them. The mean length of the lines that stay, and whether these are the whole cloud.
    pub(crate) fn cut(&mut self, most: u64, has_counts: bool) -> (f64, bool) {
        let (mut n_lines, mut end, before) = (0u64, self.head.len(), self.head.len());
        for (place, line) in Lines::of(&self.head).filter(|(_, line)| has_words(line)) {
            if n_lines == most || (has_counts && count(line).is_some()) {
                end = place;
                break;
            }
            n_lines += 1;
        }
        self.head.truncate(end);
        (self.head.len() as f64 / n_lines.max(1) as f64, end < before)
    }
}

/// Whether a line is neither blank nor a comment.
pub(crate) fn has_words(line: &[u8]) -> bool {
    !line.trim_ascii().is_empty() && !is_comment(line)
}

/// Bytes from a place, and whether the file ends with them.
fn bytes(file: &FileSource, place: u64, len: usize) -> Result<(Vec<u8>, bool)> {
    let left = file.length().saturating_sub(place);
    let len = usize::try_from(left).map_or(len, |left| left.min(len));
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(len)?;
    bytes.resize(len, 0);
    let n = file.read_at(place, &mut bytes)?;
    bytes.truncate(n);
    Ok((bytes, n < len || left == len as u64))
}

/// The text up to the end of its last whole line.
fn whole_lines(mut text: Vec<u8>, at_end: bool) -> Vec<u8> {
    if !at_end {
        let end = text.iter().rposition(|&byte| crate::text::ends_line(byte));
        text.truncate(end.map_or(0, |end| end + 1));
    }
    text
}
