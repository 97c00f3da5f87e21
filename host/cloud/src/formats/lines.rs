//! Text files, line by line, and the numbers in them.

use crate::error::ReadFault;
use crate::formats::body::Body;
use std::io::BufRead;
use surfelshop_api::columns::Element;

/// Longest line, bytes: a polygon of a million corners. A file without line ends must not be taken into memory
/// whole.
pub(crate) const MAX_LINE: usize = 16 << 20;

/// Lines of a body; blank ones are passed over.
pub(crate) struct Lines<R> {
    pub(crate) body: Body<R>,
    pub(crate) text: Vec<u8>,
    /// Line of the file, counted from 1.
    pub(crate) line: usize,
    /// Whether the last line ended with a carriage return, to which a line feed may belong.
    after_return: bool,
}

impl<R: BufRead> Lines<R> {
    /// The lines after a header of `n_lines`.
    pub(crate) fn new(body: Body<R>, n_lines: usize) -> Self {
        Self { body, text: Vec::new(), line: n_lines, after_return: false }
    }

    /// Reads the next line that is not blank into `text`; whether there was one.
    pub(crate) fn next(&mut self) -> Result<bool, ReadFault> {
        loop {
            self.text.clear();
            if !self.any_line()? {
                return Ok(false);
            }
            if !self.text.trim_ascii().is_empty() {
                return Ok(true);
            }
        }
    }

    /// Reads a line that ends with a line feed, a carriage return or both.
    fn any_line(&mut self) -> Result<bool, ReadFault> {
        let mut found = false;
        loop {
            let bytes = self.body.reader.fill_buf()?;
            if bytes.is_empty() {
                self.line += usize::from(found);
                return Ok(found);
            }
            if std::mem::take(&mut self.after_return) && bytes[0] == b'\n' {
                self.consume(1);
                continue;
            }
            found = true;
            let end = bytes.iter().position(|&byte| byte == b'\n' || byte == b'\r');
            if self.text.len() + end.unwrap_or(bytes.len()) > MAX_LINE {
                return Err(ReadFault::LongLine { line: self.line + 1, most: MAX_LINE });
            }
            self.text.extend_from_slice(&bytes[..end.unwrap_or(bytes.len())]);
            let n_bytes = bytes.len();
            match end {
                Some(end) => {
                    self.after_return = bytes[end] == b'\r';
                    self.consume(end + 1);
                    self.line += 1;
                    return Ok(true);
                }
                None => self.consume(n_bytes),
            }
        }
    }

    fn consume(&mut self, n_bytes: usize) {
        self.body.reader.consume(n_bytes);
        self.body.remaining = self.body.remaining.saturating_sub(n_bytes as u64);
    }
}

/// A number as C programs print it, with their words for what is not finite.
pub(crate) fn number(word: &str, scalar: Element) -> Option<f64> {
    // Rounding to f64 first and to f32 then could miss the nearest f32.
    let parsed = if scalar == Element::F32 {
        word.parse::<f32>().ok().map(f64::from)
    } else {
        word.parse().ok()
    };
    parsed.or_else(|| {
        // Older Microsoft libraries print 1.#INF, -1.#IND and 1.#QNAN.
        let (sign, rest) = word.strip_prefix('-').map_or((1.0, word), |rest| (-1.0, rest));
        let mark = rest.strip_prefix("1.#")?;
        if mark.starts_with("INF") { Some(sign * f64::INFINITY) } else { Some(f64::NAN) }
    })
}
