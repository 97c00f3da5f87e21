//! Lines of a text and of a file, and the numbers in them.

use surfelshop_api::format::FileSource;
use surfelshop_api::{Error, Result};

/// Longest line, bytes: a file without line ends must not be taken into memory whole.
pub(crate) const MAX_LINE: u64 = 16 << 20;

/// What some editors put before the first byte of a text file.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Bytes of a file's beginning in which bytes that are no text are looked for.
const CHECKED: usize = 4096;

/// Whether a byte ends a line.
pub(crate) const fn ends_line(byte: u8) -> bool {
    matches!(byte, b'\n' | b'\r')
}

/// Whether a byte is a blank within a line.
pub(crate) const fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t')
}

/// Where the first line begins, behind a byte order mark.
///
/// # Errors
/// Where the file is empty, is no text, or is text in two-byte characters.
pub(crate) fn start_of(file: &FileSource) -> Result<u64> {
    let mut head = [0; CHECKED];
    let n = file.read_at(0, &mut head)?;
    let head = &head[..n];
    if head.is_empty() {
        return Err(Error::new("expected lines of numbers, found an empty file"));
    }
    if head.starts_with(b"\xFF\xFE") || head.starts_with(b"\xFE\xFF") {
        return Err(Error::new("expected text in ASCII or UTF-8, found UTF-16; save it as UTF-8"));
    }
    if head.contains(&0) {
        return Err(Error::new("expected lines of text, found zero bytes: is it a binary file?"));
    }
    Ok(if head.starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() as u64 } else { 0 })
}

/// The end of the line that begins at `start`, and the beginning of the next one. The end of the text ends a
/// line, too.
pub(crate) fn line_end(text: &[u8], start: usize) -> (usize, usize) {
    let rest = text.get(start..).unwrap_or_default();
    match rest.iter().position(|&byte| ends_line(byte)) {
        None => (text.len(), text.len()),
        Some(n) => {
            let end = start + n;
            let pair = text[end] == b'\r' && text.get(end + 1) == Some(&b'\n');
            (end, end + 1 + usize::from(pair))
        }
    }
}

/// The lines of a text with the places where they begin, blank ones as well.
pub(crate) struct Lines<'a> {
    text: &'a [u8],
    at: usize,
}

impl<'a> Lines<'a> {
    pub(crate) fn of(text: &'a [u8]) -> Self {
        Self { text, at: 0 }
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        if self.at >= self.text.len() {
            return None;
        }
        let start = self.at;
        let (end, next) = line_end(self.text, start);
        self.at = next;
        Some((start, &self.text[start..end]))
    }
}

/// Whether a line is a comment: it begins with `#`, `%` or `//`.
pub(crate) fn is_comment(line: &[u8]) -> bool {
    let line = line.trim_ascii_start();
    matches!(line.first(), Some(b'#' | b'%')) || line.starts_with(b"//")
}

/// The number that a line of digits alone says, as formats announce counts; too large ones are the largest.
pub(crate) fn count(line: &[u8]) -> Option<u64> {
    let digits = line.trim_ascii();
    if digits.is_empty() || !digits.iter().all(u8::is_ascii_digit) {
        return None;
    }
    let add = |n: u64, digit: &u8| n.saturating_mul(10).saturating_add(u64::from(digit - b'0'));
    Some(digits.iter().fold(0, add))
}

/// A number as people and programs write it; missing ones and words for "nothing" are NaN.
pub(crate) fn number(word: &[u8], decimal: u8) -> Option<f64> {
    parsed(word, decimal, |word| fast_float2::parse(word).ok())
}

/// As [`number`], rounded once.
pub(crate) fn short_number(word: &[u8], decimal: u8) -> Option<f32> {
    parsed(word, decimal, |word| fast_float2::parse(word).ok())
}

fn parsed<T: From<f32>>(word: &[u8], decimal: u8, parse: impl Fn(&[u8]) -> Option<T>) -> Option<T> {
    let word = word.trim_ascii();
    if decimal != b'.' {
        if word.contains(&b'.') {
            return None;
        }
        let pointed: Vec<u8> =
            word.iter().map(|&byte| if byte == decimal { b'.' } else { byte }).collect();
        return parse(&pointed).or_else(|| special(word).map(T::from));
    }
    parse(word).or_else(|| special(word).map(T::from))
}

/// Words for what is missing or not finite that [`fast_float2`] does not read.
fn special(word: &[u8]) -> Option<f32> {
    let lower = word.to_ascii_lowercase();
    let (sign, rest) = match lower.strip_prefix(b"-") {
        Some(rest) => (-1.0, rest),
        None => (1.0, lower.as_slice()),
    };
    match rest {
        b"" if lower.is_empty() => Some(f32::NAN),
        b"na" | b"n/a" | b"null" | b"none" => Some(f32::NAN),
        // Older and newer Microsoft libraries: 1.#INF, -1.#IND, -nan(ind).
        _ if rest.starts_with(b"1.#inf") => Some(sign * f32::INFINITY),
        _ if rest.starts_with(b"1.#") => Some(f32::NAN),
        _ if rest.starts_with(b"nan(") && rest.ends_with(b")") => Some(f32::NAN),
        _ => None,
    }
}

/// Bytes of a file as a person can read them: one line, at most 60 characters.
pub(crate) fn quoted(bytes: &[u8]) -> String {
    const SHOWN: usize = 60;
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(4 * SHOWN)]);
    let text = text.trim_end();
    let printable = |c: char| match c {
        '\t' => ' ',
        c if c.is_control() => '\u{FFFD}',
        c => c,
    };
    let mut shown: String = text.chars().take(SHOWN).map(printable).collect();
    if text.chars().count() > SHOWN {
        shown.push('…');
    }
    format!("`{shown}`")
}

/// A line of a file that is not blank.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Line {
    pub(crate) text: Vec<u8>,
    /// Its number, counted from 1.
    pub(crate) number: u64,
    /// Where it begins.
    pub(crate) place: u64,
}

/// Reads a few lines of a file, one by one.
pub(crate) struct LineReader<'a> {
    file: &'a FileSource,
    /// Where the next line begins.
    pub(crate) place: u64,
    /// The number of the next line, counted from 1.
    pub(crate) number: u64,
    /// Bytes of the file from `buffer_place` on.
    buffer: Vec<u8>,
    buffer_place: u64,
}

impl<'a> LineReader<'a> {
    pub(crate) fn new(file: &'a FileSource, place: u64, number: u64) -> Self {
        Self { file, place, number, buffer: Vec::new(), buffer_place: place }
    }

    /// The next line that is neither blank nor a comment; `None` at the end of the file.
    ///
    /// # Errors
    /// Where a line is too long, or the system refuses.
    pub(crate) fn next(&mut self) -> Result<Option<Line>> {
        loop {
            let Some(line) = self.any()? else { return Ok(None) };
            if !line.text.trim_ascii().is_empty() && !is_comment(&line.text) {
                return Ok(Some(line));
            }
        }
    }

    fn any(&mut self) -> Result<Option<Line>> {
        let mut len = 4096;
        loop {
            let from = usize::try_from(self.place - self.buffer_place)?;
            let (end, next) = line_end(&self.buffer, from);
            // A return at the end of what was read may belong to a line feed that was not.
            if next < self.buffer.len() || self.is_at_end() {
                if from >= self.buffer.len() {
                    return Ok(None);
                }
                let text = self.buffer[from..end].to_vec();
                let line = Line { text, number: self.number, place: self.place };
                self.place = self.buffer_place + next as u64;
                self.number += 1;
                return Ok(Some(line));
            }
            if len as u64 > MAX_LINE {
                return Err(long_line(self.place));
            }
            self.fill(len)?;
            len *= 4;
        }
    }

    fn is_at_end(&self) -> bool {
        self.buffer_place + self.buffer.len() as u64 >= self.file.length()
    }

    fn fill(&mut self, len: usize) -> Result<()> {
        self.buffer.clear();
        self.buffer.try_reserve_exact(len)?;
        self.buffer.resize(len, 0);
        let n = self.file.read_at(self.place, &mut self.buffer)?;
        self.buffer.truncate(n);
        self.buffer_place = self.place;
        if n == 0 && !self.is_at_end() {
            return Err(Error::new("the file ends before its announced length"));
        }
        Ok(())
    }
}

/// What is said of a line that is longer than [`MAX_LINE`].
pub(crate) fn long_line(place: u64) -> Error {
    Error::new(format!(
        "expected lines of at most {MAX_LINE} bytes, found a longer one at byte {place}: is it a text file?"
    ))
}

/// The first line of a place in a file, as it is shown to people.
pub(crate) fn shown_at(file: &FileSource, place: u64) -> String {
    let mut text = [0; 256];
    let n = file.read_at(place, &mut text).unwrap_or(0);
    quoted(Lines::of(&text[..n]).next().map_or(&[], |(_, line)| line))
}
