//! Lines of points, and the two formats whose columns are fixed.

use super::words::{Form, push};
use std::fmt::Write;
use surfelshop_api::columns::{COLOR, Element, POSITION, Values};
use surfelshop_api::format::{
    CloudHeader, CloudSource, FileSink, HeaderSupport, INTENSITY, Pose, UpSupport,
};
use surfelshop_api::glam::DVec3;
use surfelshop_api::job::Job;
use surfelshop_api::{CloudView, Result};

/// Points of a piece that a thread writes.
const PIECE: usize = 4096;

/// Characters of a count that is written before it is known, blanks behind it.
const COUNT_WIDTH: usize = 20;

/// A word of each line.
#[derive(Clone, Copy, Debug)]
pub(super) enum Word {
    /// A component of a column.
    Value { column: usize, stride: usize, component: usize, form: Form },
    /// The same everywhere.
    Text(&'static str),
}

/// A file as far as it is written.
pub(super) struct Output<'a> {
    file: &'a FileSink,
    delimiter: char,
    place: u64,
}

impl<'a> Output<'a> {
    pub(super) fn new(file: &'a FileSink, delimiter: u8) -> Self {
        Self { file, delimiter: char::from(delimiter), place: 0 }
    }

    pub(super) fn text(&mut self, text: &str) -> Result<()> {
        self.file.write_at(self.place, text.as_bytes())?;
        self.place += text.len() as u64;
        Ok(())
    }

    /// Writes a count that is not known yet, and returns its place.
    fn unknown_count(&mut self) -> Result<u64> {
        let place = self.place;
        self.text(&format!("{:<COUNT_WIDTH$}\n", 0))?;
        Ok(place)
    }

    fn count(&self, place: u64, count: u64) -> Result<()> {
        self.file.write_at(place, format!("{count:<COUNT_WIDTH$}").as_bytes())
    }

    /// Writes a line for each point of a batch.
    pub(super) fn points(
        &mut self,
        batch: &CloudView<'_>,
        words: &[Word],
        job: &Job<'_>,
    ) -> Result<()> {
        self.lines(batch.len, job, |row, text| self.line(batch, words, row, text))
            .and_then(|pieces| pieces.iter().try_for_each(|piece| self.text(piece)))
    }

    /// The text of so many lines, in pieces.
    fn lines(
        &self,
        len: usize,
        job: &Job<'_>,
        line: impl Fn(usize, &mut String) -> std::fmt::Result + Sync,
    ) -> Result<Vec<String>> {
        // The host knows how far the work is by the points it has handed over.
        let pieces = job.map(len.div_ceil(PIECE), 0.0..0.0, |piece| {
            let mut text = String::new();
            for row in piece * PIECE..len.min((piece + 1) * PIECE) {
                line(row, &mut text)?;
            }
            Ok::<_, std::fmt::Error>(text)
        })?;
        Ok(pieces.into_iter().collect::<Result<_, _>>()?)
    }

    fn line(
        &self,
        batch: &CloudView<'_>,
        words: &[Word],
        row: usize,
        text: &mut String,
    ) -> std::fmt::Result {
        for (i, word) in words.iter().enumerate() {
            if i > 0 {
                text.push(self.delimiter);
            }
            match *word {
                Word::Text(word) => text.push_str(word),
                Word::Value { column, stride, component, form } => {
                    let values = &batch.columns[column].values;
                    push(text, values, row * stride + component, form)?;
                }
            }
        }
        text.push('\n');
        Ok(())
    }
}

/// A format whose columns are position, intensity and colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FixedFormat {
    Pts,
    Ptx,
}

/// Writes clouds, each behind what the format says of it.
///
/// # Errors
/// Where the user asked to stop, or the host or the system refuses.
pub(crate) fn write_fixed(
    format: FixedFormat,
    clouds: &mut CloudSource<'_>,
    file: &FileSink,
    job: &Job<'_>,
) -> Result<Vec<String>> {
    let (mut output, mut lines) = (Output::new(file, b' '), Vec::<String>::new());
    while let Some(header) = clouds.next_cloud()? {
        for line in left_out(format, &header) {
            if !lines.contains(&line) {
                lines.push(line);
            }
        }
        let (mut n_points, mut n_at_zero) = (0u64, 0usize);
        match format {
            FixedFormat::Pts => {
                let count = output.unknown_count()?;
                while let Some(batch) = clouds.next_batch()? {
                    output.points(&batch, &words(format, &batch), job)?;
                    n_points += batch.len as u64;
                }
                output.count(count, n_points)?;
            }
            FixedFormat::Ptx => {
                let (columns, rows) = (output.unknown_count()?, output.unknown_count()?);
                // The zero of a scan's axes is where the scanner stands: there they are moved.
                let scanner = header.scanner.filter(|place| place.is_finite()).unwrap_or_default();
                let translation = header.pose.place(scanner);
                output.text(&pose_lines(&Pose { translation, ..header.pose }))?;
                while let Some(batch) = clouds.next_batch()? {
                    n_at_zero += write_scan_points(&mut output, &batch, scanner, job)?;
                    n_points += batch.len as u64;
                }
                // Our grids go row by row, those of PTX column by column: a row of ours is a column there.
                let [n_columns, n_rows] = match header.grid.map(|grid| grid.map(u64::from)) {
                    Some([width, height]) if width * height == n_points => [height, width],
                    _ => [1, n_points],
                };
                output.count(columns, n_columns)?;
                output.count(rows, n_rows)?;
            }
        }
        if n_at_zero > 0 {
            lines.push(format!(
                "points where the scanner stands are written {BESIDE_ZERO} beside it, since 0 0 0 is a place without a point: {n_at_zero}"
            ));
        }
    }
    Ok(lines)
}

/// The first coordinate of points at zero: three zeros are a place without a point.
const BESIDE_ZERO: &str = "1e-9";

/// The coordinates of a batch.
fn positions<'a>(batch: &CloudView<'a>) -> &'a [f64] {
    match batch.column(POSITION).map(|column| column.values) {
        Some(Values::F64(positions)) => positions,
        _ => &[],
    }
}

/// Points of a scan, in the axes of a scanner that stands there; those that are not finite stand for places from which
/// nothing came back. Returns how many lie at zero, which does so, too, and are written beside it.
fn write_scan_points(
    output: &mut Output<'_>,
    batch: &CloudView<'_>,
    scanner: DVec3,
    job: &Job<'_>,
) -> Result<usize> {
    let seen: Vec<f64> = positions(batch)
        .as_chunks::<3>()
        .0
        .iter()
        .flat_map(|place| (DVec3::from_array(*place) - scanner).to_array())
        .collect();
    let mut batch = batch.clone();
    for column in batch.columns.iter_mut().filter(|column| column.name == POSITION) {
        column.values = Values::F64(&seen);
    }
    let batch = &batch;
    let words = words(FixedFormat::Ptx, batch);
    let none: Vec<Word> = words
        .iter()
        .map(|word| match word {
            Word::Value { column, .. } if batch.columns[*column].name == POSITION => {
                Word::Text("0")
            }
            other => *other,
        })
        .collect();
    let mut beside = none.clone();
    if let Some(word) = beside.first_mut() {
        *word = Word::Text(BESIDE_ZERO);
    }
    let positions = positions(batch);
    let pieces = output.lines(batch.len, job, |row, text| {
        let position = positions.get(3 * row..3 * row + 3).unwrap_or_default();
        let words = match position.iter().all(|coordinate| coordinate.is_finite()) {
            true if is_at_zero(position) => &beside,
            true => &words,
            false => &none,
        };
        output.line(batch, words, row, text)
    })?;
    pieces.iter().try_for_each(|piece| output.text(piece))?;
    Ok(positions.chunks_exact(3).filter(|position| is_at_zero(position)).count())
}

/// Whether a position is read as none.
fn is_at_zero(position: &[f64]) -> bool {
    !position.is_empty() && position.iter().all(|coordinate| *coordinate == 0.0)
}

/// The words of a line. Intensity stands where there is a colour, and in scans always.
fn words(format: FixedFormat, batch: &CloudView<'_>) -> Vec<Word> {
    let place = |name: &str| batch.columns.iter().position(|column| column.name == name);
    let values = |column: usize, n: usize, form: Form| {
        let stride = batch.columns[column].components as usize;
        (0..n.min(stride)).map(move |component| Word::Value { column, stride, component, form })
    };
    let mut words = Vec::new();
    words.extend(place(POSITION).into_iter().flat_map(|c| values(c, 3, Form::Shortest)));
    let color = place(COLOR).filter(|&column| batch.columns[column].components >= 3);
    match (format, place(INTENSITY)) {
        (FixedFormat::Pts, Some(column)) => words.extend(values(column, 1, Form::Shortest)),
        (FixedFormat::Ptx, Some(column)) => words.extend(values(column, 1, Form::Fraction)),
        (FixedFormat::Pts, None) if color.is_none() => {}
        (FixedFormat::Pts, None) => words.push(Word::Text("0")),
        (FixedFormat::Ptx, None) => words.push(Word::Text("0.5")),
    }
    words.extend(color.into_iter().flat_map(|column| values(column, 3, Form::Color)));
    words
}

/// The eight lines of a scan's place, axes and matrix.
fn pose_lines(pose: &Pose) -> String {
    let (place, turn) = (pose.translation, pose.rotation);
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| turn * axis);
    let mut text = String::new();
    let mut line = |vector: DVec3, last: &str| {
        let DVec3 { x, y, z } = vector;
        // Writing to a text cannot fail.
        let written = writeln!(text, "{x} {y} {z}{last}");
        debug_assert!(written.is_ok());
    };
    line(place, "");
    axes.iter().for_each(|axis| line(*axis, ""));
    axes.iter().for_each(|axis| line(*axis, " 0"));
    line(place, " 1");
    text
}

/// What of a cloud has no place in a format, for people.
fn left_out(format: FixedFormat, header: &CloudHeader) -> Vec<String> {
    let (name, held) = match format {
        FixedFormat::Pts => ("PTS", HeaderSupport::default()),
        FixedFormat::Ptx => {
            ("PTX", HeaderSupport { scanner: true, grid: true, ..HeaderSupport::default() })
        }
    };
    let mut lines = header.left_out(name, HeaderSupport { up: UpSupport::TakenAsZ, ..held });
    let others = header.columns.iter().map(|column| column.name.as_str());
    let others: Vec<&str> =
        others.filter(|name| ![POSITION, INTENSITY, COLOR].contains(name)).collect();
    let others: Vec<String> = others.iter().map(|name| format!("`{name}`")).collect();
    match others.as_slice() {
        [] => {}
        [one] => {
            lines.push(format!("column {one} is left out: {name} has intensity and colour only"));
        }
        several => {
            let several = several.join(", ");
            lines.push(format!(
                "columns {several} are left out: {name} has intensity and colour only"
            ));
        }
    }
    let element = |name: &str| header.column(name).map(|(_, column)| column.element);
    if element(COLOR).is_some_and(|element| element != Element::U8) {
        lines.push("`color` is rounded to 8 bits of sRGB".to_owned());
    }
    if header.column(COLOR).is_some_and(|(_, column)| column.components > 3) {
        lines.push("the opacity of `color` is left out".to_owned());
    }
    if format == FixedFormat::Ptx && header.scanner.is_none() {
        lines.push(
            "this cloud does not say where the scanner stood, and PTX is read as if at the zero of the points"
                .to_owned(),
        );
    }
    let has_color = header.column(COLOR).is_some_and(|(_, column)| column.components >= 3);
    let is_whole = |element| !matches!(element, Element::F32 | Element::F64);
    if format == FixedFormat::Pts && element(INTENSITY).is_some_and(is_whole) {
        lines.push("text keeps no types: read again, `intensity` will be floats".to_owned());
    }
    if format == FixedFormat::Pts && has_color && element(INTENSITY).is_none() {
        lines.push("there is no intensity: 0 is written".to_owned());
    }
    if format == FixedFormat::Ptx {
        match element(INTENSITY) {
            None => lines.push("there is no intensity: 0.5 is written".to_owned()),
            Some(Element::U8 | Element::U16) => {
                lines.push(
                    "intensity is written as a fraction of its type's largest number".to_owned(),
                );
            }
            Some(_) => {}
        }
    }
    lines
}
