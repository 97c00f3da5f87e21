//! Points as lines of text.

use crate::encode::Field;
use std::fmt::Write;
use surfelshop_api::prelude::{Job, Result};

/// Bytes of text that are widened at once.
pub(crate) const BLOCK: usize = 1 << 20;

/// Points of a piece that a thread writes.
const PIECE: usize = 4096;

/// The lines of points of these fields, in pieces.
///
/// # Errors
/// Where the user asked to stop.
pub(crate) fn lines(rows: &[u8], fields: &[Field], job: &Job<'_>) -> Result<Vec<String>> {
    let step: usize = fields.iter().map(Field::bytes).sum();
    let pieces: Vec<&[u8]> = rows.chunks(PIECE * step.max(1)).collect();
    // The host knows how far the work is by the points it has handed over.
    job.map(pieces.len(), 0.0..0.0, |i| {
        let mut text = String::new();
        for row in pieces[i].chunks_exact(step.max(1)) {
            let mut rest = row;
            for field in fields {
                for _ in 0..field.count {
                    let (value, behind) = rest.split_at(field.size);
                    append(&mut text, field, value);
                    rest = behind;
                }
            }
            text.pop();
            text.push('\n');
        }
        text
    })
}

/// The same lines with the three numbers that each begins with, in single precision, as double precision has them.
pub(crate) fn widened(lines: &[u8]) -> String {
    let lines = String::from_utf8_lossy(lines);
    let mut wide = String::with_capacity(lines.len() * 2);
    for line in lines.lines() {
        let mut words = line.splitn(4, ' ');
        for word in words.by_ref().take(3) {
            let value = word.parse::<f32>().unwrap_or(f32::NAN);
            let written = number(&mut wide, f64::from(value));
            debug_assert!(written.is_ok());
        }
        wide.push_str(words.next().unwrap_or_default());
        if wide.ends_with(' ') {
            wide.pop();
        }
        wide.push('\n');
    }
    wide
}

/// Appends a value and a space.
fn append(text: &mut String, field: &Field, bytes: &[u8]) {
    // Writing to a string cannot fail.
    let written = match (field.letter, bytes) {
        ('F', &[a, b, c, d]) => number(text, f32::from_le_bytes([a, b, c, d])),
        ('F', &[a, b, c, d, e, f, g, h]) => {
            number(text, f64::from_le_bytes([a, b, c, d, e, f, g, h]))
        }
        ('I', &[a]) => write!(text, "{} ", i8::from_le_bytes([a])),
        ('I', &[a, b]) => write!(text, "{} ", i16::from_le_bytes([a, b])),
        ('I', &[a, b, c, d]) => write!(text, "{} ", i32::from_le_bytes([a, b, c, d])),
        ('U', &[a]) => write!(text, "{a} "),
        ('U', &[a, b]) => write!(text, "{} ", u16::from_le_bytes([a, b])),
        ('U', &[a, b, c, d]) => write!(text, "{} ", u32::from_le_bytes([a, b, c, d])),
        _ => write!(text, "0 "),
    };
    debug_assert!(written.is_ok());
}

/// The shortest text that is read as the same number; `nan` as PCL writes it.
fn number<T: Into<f64> + Copy + std::fmt::Display + std::fmt::LowerExp>(
    text: &mut String,
    value: T,
) -> std::fmt::Result {
    let size = value.into().abs();
    if size.is_nan() {
        write!(text, "nan ")
    } else if size.is_finite() && size != 0.0 && !(1e-5..1e16).contains(&size) {
        write!(text, "{value:e} ")
    } else {
        write!(text, "{value} ")
    }
}
