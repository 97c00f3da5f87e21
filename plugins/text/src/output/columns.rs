//! Tables: every column of a cloud, under a line of names.

use super::lines::{Output, Word};
use super::words::Form;
use crate::layout::{Delimiter, Target, is_whole, shown};
use surfelshop_api::columns::{COLOR, Element, POSITION};
use surfelshop_api::format::{CloudSource, FileColumn, FileSink, HeaderSupport, UpSupport};
use surfelshop_api::job::Job;
use surfelshop_api::{CloudView, Error, Result};

/// Writes clouds of the same columns one behind the other.
///
/// # Errors
/// Where clouds have different columns, the user asked to stop, or the host or the system refuses.
pub(crate) fn write_table(
    clouds: &mut CloudSource<'_>,
    delimiter: Delimiter,
    header: bool,
    file: &FileSink,
    job: &Job<'_>,
) -> Result<Vec<String>> {
    let (mut output, mut lines) = (Output::new(file, delimiter.byte()), Vec::new());
    let mut first: Option<Vec<FileColumn>> = None;
    while let Some(cloud) = clouds.next_cloud()? {
        match &first {
            None => {
                if header {
                    output.text(&names(&cloud.columns, delimiter))?;
                }
                lines.extend(untyped(&cloud.columns));
                let held = HeaderSupport { up: UpSupport::TakenAsZ, ..HeaderSupport::default() };
                lines.extend(cloud.left_out("a table of points", held));
                first = Some(cloud.columns.clone());
            }
            Some(first) if *first != cloud.columns => {
                return Err(Error::new(
                    "expected clouds of the same columns, found different ones",
                ));
            }
            Some(_) => {}
        }
        while let Some(batch) = clouds.next_batch()? {
            output.points(&batch, &words(&batch), job)?;
        }
    }
    Ok(lines)
}

/// The columns whose type numbers in text do not tell, in a line; `None` where all are floats or colours.
fn untyped(columns: &[FileColumn]) -> Option<String> {
    let is_told = |column: &&FileColumn| {
        let is_color = column.name == COLOR && column.element == Element::U8;
        is_color || is_whole(&column.name) || matches!(column.element, Element::F32 | Element::F64)
    };
    let names = columns.iter().filter(|column| !is_told(column));
    let names: Vec<String> = names.map(|column| format!("`{}`", column.name)).collect();
    let line = format!("text keeps no types: read again, {} will be floats", names.join(", "));
    (!names.is_empty()).then_some(line)
}

/// The columns in the order in which they are written, with their places: the position first.
fn order<'a>(names: impl Iterator<Item = &'a str>) -> Vec<usize> {
    let mut places: Vec<(bool, usize)> =
        names.enumerate().map(|(i, name)| (name != POSITION, i)).collect();
    places.sort_unstable();
    places.into_iter().map(|(_, i)| i).collect()
}

fn words(batch: &CloudView<'_>) -> Vec<Word> {
    let mut words = Vec::new();
    for column in order(batch.columns.iter().map(|column| column.name)) {
        let view = &batch.columns[column];
        // Linear colours are told from those of 8 bits by their points.
        let is_linear = matches!(view.values.element(), Element::F32 | Element::F64);
        let form = if view.name == COLOR && is_linear { Form::Pointed } else { Form::Shortest };
        words.extend((0..view.components as usize).map(|component| {
            let stride = view.components as usize;
            Word::Value { column, stride, component, form }
        }));
    }
    words
}

/// The line of names.
fn names(columns: &[FileColumn], delimiter: Delimiter) -> String {
    let mut words: Vec<String> = Vec::new();
    for place in order(columns.iter().map(|column| column.name.as_str())) {
        let column = &columns[place];
        let n = column.components as usize;
        words.extend((0..n).map(|i| word(&shown(&Target::new(&column.name, i), n))));
    }
    let mut line = words.join(&char::from(delimiter.byte()).to_string());
    line.push('\n');
    line
}

/// A name as one word, whatever separates words.
fn word(name: &str) -> String {
    let plain = |c: char| match c {
        ',' | ';' | '"' => '_',
        c if c.is_whitespace() || c.is_control() => '_',
        c => c,
    };
    name.chars().map(plain).collect()
}
