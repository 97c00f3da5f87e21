//! Values as text, a line per record. `ply-rs-bw` reads text too, but neither `nan` nor `.5`.

use super::binary::{has_lists, shrunk};
use super::header::{ElementDef, Header, Kind};
use super::{Body, empty_fields};
use crate::error::{ReadFault, quoted};
use crate::table::{Field, Table};
use std::io::BufRead;
use surfelshop_api::columns::Element;
use surfelshop_geometry::Progress;

/// Lines between two questions whether to stop.
const BLOCK: u64 = 4096;

/// Lines of a body; blank ones are passed over.
struct Lines<R> {
    body: Body<R>,
    text: Vec<u8>,
    /// Line of the file, counted from 1.
    line: usize,
    /// Whether the last line ended with a carriage return, to which a line feed may belong.
    after_return: bool,
}

impl<R: BufRead> Lines<R> {
    /// Reads the next line that is not blank into `text`; whether there was one.
    fn next(&mut self) -> Result<bool, ReadFault> {
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

/// Reads the scalar properties of `element`, passing over the elements `before` it.
pub(super) fn read<R: BufRead>(
    body: Body<R>,
    header: &Header,
    before: &[ElementDef],
    element: &ElementDef,
    table: &mut Table,
    progress: Progress<'_>,
) -> Result<Vec<Field>, ReadFault> {
    let mut lines = Lines { body, text: Vec::new(), line: header.n_lines, after_return: false };
    for skipped in before {
        check_count(&lines.body, skipped)?;
        // An element without properties has no lines that could be told from blank ones.
        let n_lines = if skipped.properties.is_empty() { 0 } else { skipped.count };
        for record in 0..n_lines {
            if record % BLOCK == 0 {
                lines.body.tell(progress)?;
            }
            if !lines.next()? {
                return Err(shrunk(skipped));
            }
        }
    }
    check_count(&lines.body, element)?;
    let mut fields = empty_fields(element, false);
    let mut n_longer = 0u64;
    for record in 0..element.count {
        if record % BLOCK == 0 {
            lines.body.tell(progress)?;
        }
        if !lines.next()? {
            return Err(ReadFault::Truncated {
                element: element.name.clone(),
                expected: format!("{} lines", element.count),
                found: format!("{record}"),
            });
        }
        n_longer += u64::from(record_of(&lines, element, &mut fields)?);
    }
    if n_longer > 0 {
        let name = &element.name;
        table.warnings.push(format!(
            "{n_longer} lines of element `{name}` have more values than the header declares; \
             the first ones were read"
        ));
    }
    Ok(fields)
}

/// Checks that the announced records can be in the file: each value takes a digit and a separator.
fn check_count<R>(body: &Body<R>, element: &ElementDef) -> Result<(), ReadFault> {
    let size = element.properties.len() as u64 * 2;
    // The last separator may be missing.
    match element.count.checked_mul(size) {
        Some(bytes) if bytes <= body.remaining.saturating_add(1) => Ok(()),
        _ => Err(ReadFault::Truncated {
            element: element.name.clone(),
            expected: format!("{} lines of at least {size} bytes", element.count),
            found: format!("{} bytes", body.remaining),
        }),
    }
}

/// Appends the values of a line to their columns; whether the line has more than that.
fn record_of<R>(
    lines: &Lines<R>,
    element: &ElementDef,
    fields: &mut [Field],
) -> Result<bool, ReadFault> {
    let fault = |expected: String, found: String| ReadFault::Value {
        place: format!("line {}", lines.line),
        expected,
        found,
    };
    let text = String::from_utf8_lossy(&lines.text);
    let mut words = text.split_ascii_whitespace();
    let too_few = || {
        let kind = if has_lists(element) { "lists and values" } else { "values" };
        let expected = format!("{} {kind} of element `{}`", element.properties.len(), element.name);
        fault(expected, format!("{}", text.split_ascii_whitespace().count()))
    };
    let mut column = 0;
    for property in &element.properties {
        let word = words.next().ok_or_else(too_few)?;
        match property.kind {
            Kind::Scalar(scalar) => {
                let value = number(word, scalar);
                if !value.is_some_and(|value| fields[column].values.push(value)) {
                    let expected =
                        format!("a number of type {} for `{}`", scalar.name(), property.name);
                    return Err(fault(expected, quoted(word.as_bytes())));
                }
                column += 1;
            }
            Kind::List { .. } => {
                let Ok(length) = word.parse::<usize>() else {
                    let expected = format!("the length of list `{}`", property.name);
                    return Err(fault(expected, quoted(word.as_bytes())));
                };
                for _ in 0..length {
                    words.next().ok_or_else(too_few)?;
                }
            }
        }
    }
    Ok(words.next().is_some())
}

/// A number as C programs print it, with their words for what is not finite.
fn number(word: &str, scalar: Element) -> Option<f64> {
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
