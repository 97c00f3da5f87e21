//! Reads a line into numbers.

use super::number::{rounded_once, short_decimal};
use crate::layout::{Delimiter, Field, Layout};
use crate::text::{count, ends_line, is_blank, is_comment, line_end, number, short_number};

/// The decimal point: text with another was changed before.
const DECIMAL: u8 = b'.';

/// What a line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// Its numbers were added.
    Row,
    /// It is blank or a comment.
    Nothing,
    /// It is a count alone.
    Count,
    /// It cannot be read.
    Unreadable,
}

/// Reads lines as a layout says.
pub(super) struct LineParser<'a> {
    fields: &'a [Field],
    delimiter: Delimiter,
}

impl<'a> LineParser<'a> {
    pub(super) fn new(layout: &'a Layout) -> Self {
        Self { fields: &layout.fields, delimiter: layout.delimiter }
    }

    /// Adds the numbers of the line that begins at `start`, all of those that are read or none; where the next
    /// line begins. The last line of a text has an end, too.
    pub(super) fn line(
        &self,
        text: &[u8],
        start: usize,
        values: &mut Vec<f64>,
    ) -> (Outcome, usize) {
        let before = values.len();
        if let Some(next) = self.plain(text, start, values) {
            return (Outcome::Row, next);
        }
        values.truncate(before);
        let (end, next) = line_end(text, start);
        let outcome = self.any(&text[start..end], values);
        if outcome != Outcome::Row {
            values.truncate(before);
        }
        (outcome, next)
    }

    /// A line of plain numbers; where the next one begins. `None` where it may be something else.
    fn plain(&self, text: &[u8], start: usize, values: &mut Vec<f64>) -> Option<usize> {
        let line = text.get(start..)?;
        let rest = match self.delimiter {
            Delimiter::Comma => self.plain_words::<b','>(line, values),
            Delimiter::Semicolon => self.plain_words::<b';'>(line, values),
            Delimiter::Tab => self.plain_words::<b'\t'>(line, values),
            Delimiter::Space => self.plain_words::<b' '>(line, values),
        }?;
        let end = match rest {
            [b'\r', b'\n', ..] => 2,
            [byte, ..] if ends_line(*byte) => 1,
            _ => return None,
        };
        Some(text.len() - rest.len() + end)
    }

    /// The words of a line of plain numbers, of a delimiter that is known when this is compiled; what is left of
    /// the text behind them.
    fn plain_words<'t, const DELIMITER: u8>(
        &self,
        line: &'t [u8],
        values: &mut Vec<f64>,
    ) -> Option<&'t [u8]> {
        let mut rest = line;
        let last = self.fields.len().checked_sub(1)?;
        for (i, &field) in self.fields.iter().enumerate() {
            rest = blanks::<DELIMITER>(rest);
            let (value, n) = match field {
                Field::Skipped => (None, skipped::<DELIMITER>(rest)?),
                Field::Short => {
                    let (value, n) = short(rest)?;
                    (Some(value), n)
                }
                field => {
                    let (value, n) = match short_decimal(rest) {
                        Some(found) => found,
                        None => fast_float2::parse_partial(rest).ok()?,
                    };
                    (Some(fitted(field, value)?), n)
                }
            };
            values.extend(value);
            rest = rest.get(n..)?;
            if i < last {
                rest = behind::<DELIMITER>(rest)?;
            }
        }
        Some(blanks::<DELIMITER>(rest))
    }

    /// Any line.
    fn any(&self, line: &[u8], values: &mut Vec<f64>) -> Outcome {
        if line.trim_ascii().is_empty() || is_comment(line) {
            return Outcome::Nothing;
        }
        if self.words(line, values).is_some() {
            return Outcome::Row;
        }
        if count(line).is_some() {
            return Outcome::Count;
        }
        // A comment may follow the numbers.
        let comment = line.iter().position(|&byte| byte == b'#');
        let before = comment.and_then(|comment| self.words(&line[..comment], values));
        before.map_or(Outcome::Unreadable, |()| Outcome::Row)
    }

    fn words(&self, line: &[u8], values: &mut Vec<f64>) -> Option<()> {
        let before = values.len();
        let mut words = self.delimiter.split(line);
        let n = self.fields.len();
        if words.len() == n + 1 && words.last().is_some_and(|word| word.is_empty()) {
            words.pop();
        }
        if words.len() != n {
            return None;
        }
        for (word, &field) in words.iter().zip(self.fields) {
            let value = match field {
                Field::Skipped => continue,
                Field::Short => short_number(word, DECIMAL).map(f64::from),
                field => number(word, DECIMAL).and_then(|value| fitted(field, value)),
            };
            let Some(value) = value else {
                values.truncate(before);
                return None;
            };
            values.push(value);
        }
        Some(())
    }
}

/// The text behind blanks.
#[inline]
fn blanks<const DELIMITER: u8>(mut text: &[u8]) -> &[u8] {
    while let [byte, rest @ ..] = text {
        if !(is_blank(*byte) && (DELIMITER != b'\t' || *byte != b'\t')) {
            break;
        }
        text = rest;
    }
    text
}

/// The text behind a delimiter and blanks before it; `None` where there is none.
#[inline]
fn behind<const DELIMITER: u8>(text: &[u8]) -> Option<&[u8]> {
    match text {
        [byte, rest @ ..] if *byte == DELIMITER => Some(rest),
        [b'\t', rest @ ..] if DELIMITER == b' ' => Some(rest),
        [byte, ..] if DELIMITER != b' ' && is_blank(*byte) => {
            let behind = blanks::<DELIMITER>(text);
            behind.strip_prefix(&[DELIMITER])
        }
        _ => None,
    }
}

/// Bytes of a word that is passed over; `None` where it is quoted or not there.
fn skipped<const DELIMITER: u8>(text: &[u8]) -> Option<usize> {
    let ends = |byte: &u8| ends_line(*byte) || *byte == DELIMITER || is_blank(*byte);
    let n = text.iter().position(ends)?;
    (n > 0 && !matches!(text[0], b'"' | b'#' | b'%' | b'/')).then_some(n)
}

/// A number of 32 bits.
#[inline]
fn short(text: &[u8]) -> Option<(f64, usize)> {
    let plain = short_decimal(text).and_then(|(value, n)| Some((rounded_once(value)?, n)));
    let (value, n) = match plain {
        Some(found) => found,
        None => fast_float2::parse_partial::<f32, _>(text).ok()?,
    };
    Some((f64::from(value), n))
}

/// A number as a field takes it; `None` where it is none of its numbers.
#[inline]
fn fitted(field: Field, value: f64) -> Option<f64> {
    match field {
        Field::Whole([low, high]) => {
            // Within the limits of types of 32 bits, so that 64 hold it.
            let fits = value >= low && value <= high && (value as i64) as f64 == value;
            fits.then_some(value)
        }
        Field::Rounded([low, high]) => {
            let shifted = value + 0.5;
            if value.is_nan() {
                return Some(0.0);
            }
            (shifted >= low && shifted < high + 1.0).then_some((shifted as i64) as f64)
        }
        Field::Skipped | Field::Short | Field::Long => Some(value),
    }
}
