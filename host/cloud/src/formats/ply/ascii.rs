//! Values as text, a line per record. `ply-rs-bw` reads text too, but neither `nan` nor `.5`.

use super::element::{empty_fields, has_lists, shrunk};
use super::faces::Corners;
use super::header::{ElementDef, Kind};
use crate::error::{ReadFault, quoted};
use crate::faces::Faces;
use crate::formats::body::Body;
use crate::formats::lines::{Lines, number};
use crate::table::Field;
use std::io::BufRead;
use surfelshop_geometry::Progress;

/// Lines between two questions whether to stop.
const BLOCK: u64 = 4096;

/// Passes over an element, taking the faces along that it has.
pub(super) fn pass<R: BufRead>(
    lines: &mut Lines<R>,
    element: &ElementDef,
    faces: &mut Faces,
    progress: Progress<'_>,
) -> Result<(), ReadFault> {
    let list = Corners::of(element);
    if list.is_none() {
        check_count(&lines.body, element)?;
    }
    // An element without properties has no lines that could be told from blank ones.
    let n_lines = if element.properties.is_empty() { 0 } else { element.count };
    let mut corners = Vec::new();
    for record in 0..n_lines {
        if record % BLOCK == 0 {
            lines.body.report(progress)?;
        }
        if !lines.next()? {
            return Err(shrunk(element));
        }
        let Some(list) = list else { continue };
        match corners_of(&lines.text, element, list, &mut corners) {
            Some(()) => list.add(&mut corners, faces)?,
            None => faces.add_bad(),
        }
    }
    Ok(())
}

/// Reads the corners that a line names; `None` where it is not made as it should be.
fn corners_of(
    text: &[u8],
    element: &ElementDef,
    list: Corners,
    corners: &mut Vec<i64>,
) -> Option<()> {
    corners.clear();
    let mut words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    let whole = |word: &[u8]| std::str::from_utf8(word).ok()?.parse::<i64>().ok();
    for (place, property) in element.properties.iter().enumerate().take(list.property + 1) {
        let word = words.next()?;
        if let Kind::List { .. } = property.kind {
            for _ in 0..whole(word)? {
                let item = words.next()?;
                if place == list.property {
                    corners.push(whole(item)?);
                }
            }
        }
    }
    Some(())
}

/// Reads the scalar properties of the element that holds points.
pub(super) fn read<R: BufRead>(
    lines: &mut Lines<R>,
    element: &ElementDef,
    warnings: &mut Vec<String>,
    progress: Progress<'_>,
) -> Result<Vec<Field>, ReadFault> {
    check_count(&lines.body, element)?;
    let mut fields = empty_fields(element, false)?;
    let mut n_longer = 0u64;
    for record in 0..element.count {
        if record % BLOCK == 0 {
            lines.body.report(progress)?;
        }
        if !lines.next()? {
            return Err(ReadFault::Truncated {
                element: element.name.clone(),
                expected: format!("{} lines", element.count),
                found: format!("{record}"),
            });
        }
        n_longer += u64::from(record_of(lines, element, &mut fields)?);
    }
    if n_longer > 0 {
        let name = quoted(element.name.as_bytes());
        warnings.push(format!(
            "{n_longer} lines of element {name} have more values than the header declares; \
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
        let name = quoted(element.name.as_bytes());
        let expected = format!("{} {kind} of element {name}", element.properties.len());
        fault(expected, format!("{}", text.split_ascii_whitespace().count()))
    };
    let mut column = 0;
    for property in &element.properties {
        let word = words.next().ok_or_else(too_few)?;
        match property.kind {
            Kind::Scalar(scalar) => {
                let value = number(word, scalar);
                if !value.is_some_and(|value| fields[column].values.push(value)) {
                    let name = quoted(property.name.as_bytes());
                    let expected = format!("a number of type {} for {name}", scalar.name());
                    return Err(fault(expected, quoted(word.as_bytes())));
                }
                column += 1;
            }
            Kind::List { .. } => {
                let Ok(length) = word.parse::<usize>() else {
                    let name = quoted(property.name.as_bytes());
                    let expected = format!("the length of list {name}");
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
