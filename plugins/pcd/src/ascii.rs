//! Points as text: each line becomes the bytes that the binary encoding would have.

use crate::decode::Rows;
use crate::header::{Field, Header, Kind, shown};
use crate::layout::Layout;
use crate::read::{batch_rows, hand_over, interleaved};
use std::ops::Range;
use surfelshop_api::format::{CloudSink, FileSource};
use surfelshop_api::prelude::{Error, Job, Result};

/// Bytes of text that are read at once; no line may be longer.
const BLOCK: usize = 8 << 20;

/// Bytes of text that a thread takes at once, about.
const PIECE: usize = 1 << 16;

/// Reads the points of a file.
pub(crate) fn read(
    file: &FileSource,
    header: &Header,
    layout: &Layout,
    clouds: &mut CloudSink<'_>,
    job: &Job<'_>,
) -> Result<()> {
    let n_values: usize = header.fields.iter().map(|field| field.count).sum();
    let left = file.length().saturating_sub(header.start);
    // A value takes a character, and one that ends it.
    let least = header.rows.saturating_mul(2 * n_values as u64).saturating_sub(1);
    if left < least {
        return Err(Error::new(format!(
            "expected {} points, found {left} bytes of text, which cannot hold them: the file is cut short",
            header.rows
        )));
    }
    let mut points =
        Points { header, layout, n_values, n_done: 0, has_more: false, rows: Vec::new() };
    let (mut text, mut place) = (Vec::new(), header.start);
    while points.n_done < header.rows {
        job.check()?;
        let n_carried = text.len();
        let room = block_room(file, place, n_carried);
        text.try_reserve(room)?;
        text.resize(n_carried + room, 0);
        let n_read = file.read_at(place, &mut text[n_carried..])?;
        text.truncate(n_carried + n_read);
        let share = |at: u64| (at - header.start) as f64 / left.max(1) as f64;
        let shares = share(place)..share(place + n_read as u64).min(1.0);
        place += n_read as u64;
        let is_last = n_read < room || place >= file.length();
        let end = if is_last {
            text.len()
        } else {
            let newline = text.iter().rposition(|&byte| byte == b'\n');
            newline
                .ok_or_else(|| Error::new(format!("expected lines, found one of {BLOCK} bytes")))?
                + 1
        };
        points.take(&text[..end], shares, clouds, job)?;
        text.drain(..end);
        if is_last {
            break;
        }
    }
    if points.n_done < header.rows {
        let (expected, found) = (header.rows, points.n_done);
        return Err(Error::new(format!(
            "expected {expected} points, found {found}: the file is cut short"
        )));
    }
    if points.has_more
        || place < file.length()
        || text.iter().any(|byte| !byte.is_ascii_whitespace())
    {
        clouds.warn("there are more points than the header announces; they were left out");
    }
    Ok(())
}

/// Bytes that a block has room for behind those carried over, no more than the file has.
fn block_room(file: &FileSource, place: u64, n_carried: usize) -> usize {
    let left = usize::try_from(file.length().saturating_sub(place)).unwrap_or(usize::MAX);
    left.min(BLOCK.saturating_sub(n_carried))
}

/// Points as far as they were read.
struct Points<'a> {
    header: &'a Header,
    layout: &'a Layout,
    n_values: usize,
    n_done: u64,
    /// Whether text follows behind the last point that is announced.
    has_more: bool,
    rows: Vec<u8>,
}

impl Points<'_> {
    /// Takes whole lines, and hands their points over.
    fn take(
        &mut self,
        text: &[u8],
        shares: Range<f64>,
        clouds: &mut CloudSink<'_>,
        job: &Job<'_>,
    ) -> Result<()> {
        let pieces = pieces(text);
        let parsed = job.map(pieces.len(), shares, |i| self.piece(&text[pieces[i].clone()]))?;
        self.rows.clear();
        for (rows, failure) in parsed {
            self.rows.try_reserve(rows.len())?;
            self.rows.extend_from_slice(&rows);
            let step = self.header.step;
            let n = self.n_done + (self.rows.len() / step) as u64;
            if n >= self.header.rows {
                // At most what there is.
                let n = (self.header.rows - self.n_done) as usize;
                self.has_more |= failure.is_some() || self.rows.len() > n * step;
                self.rows.truncate(n * step);
                break;
            }
            if let Some(line) = failure {
                return Err(Error::new(format!("point {}: {line}", n + 1)));
            }
        }
        self.hand_over(clouds)
    }

    fn hand_over(&mut self, clouds: &mut CloudSink<'_>) -> Result<()> {
        let (step, fields) = (self.header.step, &self.header.fields);
        let places = interleaved(self.header);
        for bytes in self.rows.chunks(batch_rows(step) * step) {
            let n = bytes.len() / step;
            hand_over(&Rows { bytes, fields, places: &places, first: 0, n }, self.layout, clouds)?;
            self.n_done += n as u64;
        }
        Ok(())
    }

    /// The rows of some lines, and why one of them is none.
    fn piece(&self, text: &[u8]) -> (Vec<u8>, Option<String>) {
        let mut rows = Vec::new();
        for line in text.split(|&byte| byte == b'\n') {
            let before = rows.len();
            match self.line(line, &mut rows) {
                Ok(()) => {}
                Err(failure) => {
                    rows.truncate(before);
                    return (rows, Some(failure));
                }
            }
        }
        (rows, None)
    }

    fn line(&self, line: &[u8], rows: &mut Vec<u8>) -> Result<(), String> {
        let Ok(line) = std::str::from_utf8(line) else {
            return Err("expected numbers, found bytes that are no text".to_owned());
        };
        let mut words = line.split_ascii_whitespace();
        if words.clone().next().is_none_or(|word| word.starts_with('#')) {
            return Ok(());
        }
        for field in &self.header.fields {
            for _ in 0..field.count {
                let word = words.next().ok_or_else(|| {
                    let found = line.split_ascii_whitespace().count();
                    format!("expected {} values, found {found}", self.n_values)
                })?;
                push(field, word, rows).ok_or_else(|| {
                    let expected =
                        if field.kind == Kind::Float { "a number" } else { "a whole number" };
                    let (name, size) = (shown(&field.name), field.size);
                    format!(
                        "field `{name}`: expected {expected} of {size} bytes, found `{}`",
                        shown(word)
                    )
                })?;
            }
        }
        match words.next() {
            None => Ok(()),
            Some(_) => {
                let found = line.split_ascii_whitespace().count();
                Err(format!("expected {} values, found {found}", self.n_values))
            }
        }
    }
}

/// Text in pieces of whole lines.
fn pieces(text: &[u8]) -> Vec<Range<usize>> {
    let mut pieces = Vec::new();
    let mut start = 0;
    while start < text.len() {
        let least = (start + PIECE).min(text.len());
        let newline = text[least..].iter().position(|&byte| byte == b'\n');
        let end = newline.map_or(text.len(), |newline| least + newline + 1);
        pieces.push(start..end);
        start = end;
    }
    pieces
}

/// Appends an element as its bytes; `None` where the word is none.
fn push(field: &Field, word: &str, rows: &mut Vec<u8>) -> Option<()> {
    macro_rules! whole {
        ($type:ty) => {
            rows.extend(whole(word).and_then(|value| <$type>::try_from(value).ok())?.to_le_bytes())
        };
    }
    match (field.kind, field.size) {
        (Kind::Float, 4) => {
            // Parsed at once: by way of f64 it could be rounded twice.
            let value = word.parse().ok().or_else(|| no_number(word).then_some(f32::NAN))?;
            rows.extend(value.to_le_bytes());
        }
        (Kind::Float, 8) => {
            let value = word.parse().ok().or_else(|| no_number(word).then_some(f64::NAN))?;
            rows.extend(value.to_le_bytes());
        }
        (Kind::Signed, 1) => whole!(i8),
        (Kind::Signed, 2) => whole!(i16),
        (Kind::Signed, 4) => whole!(i32),
        (Kind::Signed, 8) => whole!(i64),
        (Kind::Unsigned, 1) => whole!(u8),
        (Kind::Unsigned, 2) => whole!(u16),
        (Kind::Unsigned, 4) => whole!(u32),
        (Kind::Unsigned, 8) => whole!(u64),
        (_, size) => rows.resize(rows.len() + size, 0),
    }
    Some(())
}

/// Whether a word is what some programs write for values that are no numbers, such as `-1.#IND`.
fn no_number(word: &str) -> bool {
    word.contains('#') || word.to_ascii_lowercase().contains("nan")
}

/// A whole number, which may be written as `1e3` or `2.0`; 0 where it is no number, as in PCL.
fn whole(word: &str) -> Option<i128> {
    if let Ok(value) = word.parse::<i128>() {
        return Some(value);
    }
    match word.parse::<f64>() {
        Ok(value) if value.is_nan() => Some(0),
        Ok(value) if value.is_finite() && value.fract() == 0.0 => Some(value as i128),
        Ok(_) => None,
        Err(_) => no_number(word).then_some(0),
    }
}
