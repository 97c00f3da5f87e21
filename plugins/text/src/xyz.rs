//! # `xyz`: tables of points
//!
//! | parameter      | type   | default | meaning                                                           |
//! |----------------|--------|---------|-------------------------------------------------------------------|
//! | `columns`      | text   | empty   | names of the columns, such as `x,y,z,intensity,-`; empty: guessed |
//! | `delimiter`    | choice | `auto`  | `comma`, `semicolon`, `tab`, `space` or what fits most lines      |
//! | `header-lines` | int    | -1      | lines before the first point; -1: all that have no numbers        |
//! | `header`       | switch | true    | whether a line of names is written                                |
//!
//! What separates words is what gives numbers in most of the first thousand lines; with other separators than the
//! comma, numbers may have decimal commas. The last line before the numbers names the columns, and so does a
//! comment there that names x, y and z. Known names (easting, red, nx, reflectance, `gps_time` and so on) are columns
//! with a meaning; others are columns of their own, `flow.0` and `flow.1` one of two components; columns of text
//! are left out. Without names: x y z, then directions of length 1, colours, and intensity before colours or as
//! the fourth of four; what stays unknown is called `column_5`. What was found stands with the cloud's format,
//! which `surfelshop info` shows.
//!
//! Types follow the first thousand lines and 15 places behind them. Positions and times are `f64`; colours `u8`,
//! `u16` or, to 1, `f32`; classes and numbers of returns are whole; all others `f32`, or `f64` where more digits
//! or whole numbers above 65535 are written. A line whose numbers a type does not hold counts as one that cannot
//! be read. A type can be set behind a name: `x,y,z,r:u16,g:u16,b:u16`. Missing numbers are NaN.
//!
//! Written is every column, with the fewest digits that are read as the same numbers. `delimiter` `auto` is a comma
//! in `.csv`, a tabulator in `.tsv` and a space elsewhere. Triangles have no place.
//!
//! ```text
//! surfelshop info scan.csv
//! surfelshop bake scan.las -t normals -o scan.xyz
//! ```

use crate::layout::sample::Sample;
use crate::layout::{self, Delimiter, Settings as Layouts, in_table, noted};
use crate::output::write_table;
use crate::rows::{Body, Options, Unreadable};
use crate::text::start_of;
use surfelshop_api::columns::{Element, POSITION};
use surfelshop_api::format::{
    CloudHeader, CloudSink, CloudSource, FileSink, FileSource, FileTypes, UpAxis,
};
use surfelshop_api::prelude::*;

choices! {
    /// What separates the words of a line.
    pub enum Separator {
        /// What fits most lines; written is what the file's ending suggests.
        Auto = "auto",
        /// `,`
        Comma = "comma",
        /// `;`
        Semicolon = "semicolon",
        /// A tab.
        Tab = "tab",
        /// Any number of spaces and tabs.
        Space = "space",
    }
}

params! {
    /// Settings of `xyz`.
    pub struct Settings {
        /// Names of the columns of a file that is read, such as `x,y,z,intensity,-`, where `-` leaves a column out;
        /// a type may follow: `r:u16`. Empty: they are taken from the file or guessed.
        columns: String { default: String::new() },
        /// What separates the words of a line.
        delimiter: Separator { default: Separator::Auto },
        /// Lines before the first point of a file that is read; -1: all that have no numbers.
        header_lines: i32 { default: -1, range: -1..=1000 },
        /// Whether a line with the names of the columns is written before the points.
        header: bool { default: true },
    }
}

/// The format.
pub(crate) struct Xyz;

impl surfelshop_api::Format for Xyz {
    const INFO: UnitInfo = UnitInfo::new(
        "xyz",
        "XYZ and CSV",
        "Tables of points as lines of text, with columns that are named, set or guessed.",
    );
    const FILES: FileTypes = FileTypes::new()
        .ending("xyz")
        .ending("txt")
        .ending("asc")
        .ending("csv")
        .ending("tsv")
        .written();
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn read(
        &mut self,
        file: &FileSource,
        params: &Settings,
        clouds: &mut CloudSink<'_>,
        job: &Job<'_>,
    ) -> Result<()> {
        let settings = Layouts {
            delimiter: separator(params.delimiter),
            columns: columns(&params.columns)?,
            header_lines: u64::try_from(params.header_lines).ok(),
        };
        let passed_over = usize::try_from(settings.header_lines.unwrap_or(0))?;
        let start = start_of(file)?;
        let mut sample = Sample::of_head(file, start, passed_over, u64::MAX, false)?;
        sample.spread(file, file.length())?;
        let found = in_table(&sample, &settings)?;
        let layout = found.layout(|column| clouds.wants(column));
        let format = format!("text, {}", noted(&found));
        let header = CloudHeader {
            format,
            columns: layout.columns.iter().map(|column| column.file.clone()).collect(),
            up: UpAxis::Z,
            comments: found.comments.clone(),
            ..CloudHeader::default()
        };
        found.left_out.iter().for_each(|line| clouds.warn(line));
        if !clouds.begin(&header)? {
            return Ok(());
        }
        let body = Body {
            file,
            layout: &layout,
            options: Options::default(),
            start: found.start,
            line: found.line,
            most: u64::MAX,
            likely: file.length().saturating_sub(found.start),
            least: 0,
        };
        let mut unreadable = Unreadable::default();
        body.hand_over(clouds, &mut unreadable, job, |_| Ok(false))?;
        unreadable.finish(file, clouds)
    }

    fn write(
        &mut self,
        clouds: &mut CloudSource<'_>,
        params: &Settings,
        file: &FileSink,
        job: &Job<'_>,
    ) -> Result<Vec<String>> {
        let name = file.name().to_ascii_lowercase();
        let usual = match name.rsplit('.').next() {
            Some("csv") => Delimiter::Comma,
            Some("tsv") => Delimiter::Tab,
            _ => Delimiter::Space,
        };
        let delimiter = separator(params.delimiter).unwrap_or(usual);
        write_table(clouds, delimiter, params.header, file, job)
    }
}

const fn separator(separator: Separator) -> Option<Delimiter> {
    match separator {
        Separator::Auto => None,
        Separator::Comma => Some(Delimiter::Comma),
        Separator::Semicolon => Some(Delimiter::Semicolon),
        Separator::Tab => Some(Delimiter::Tab),
        Separator::Space => Some(Delimiter::Space),
    }
}

/// Names of columns with their types, as they are set.
fn columns(text: &str) -> Result<Vec<(String, Option<Element>)>> {
    if text.trim().is_empty() {
        return Ok(Vec::new());
    }
    let columns: Vec<(String, Option<Element>)> = text
        .split(',')
        .map(|part| {
            let part = part.trim();
            let Some((name, element)) = part.rsplit_once(':') else {
                return Ok((part.to_owned(), None));
            };
            let element = layout::named(element.trim()).ok_or_else(|| {
                Error::new(format!(
                    "--text-columns: expected one of {} behind `{name}:`, found `{}`; without one it is told by the numbers",
                    layout::type_names(),
                    element.trim()
                ))
            })?;
            Ok((name.trim().to_owned(), Some(element)))
        })
        .collect::<Result<_>>()?;
    let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    if !layout::have_position(&names) {
        return Err(Error::new(format!(
            "--text-columns: expected x, y and z, found `{text}`; name all three, and `-` for columns to leave out"
        )));
    }
    let targets = layout::targets(&names);
    for (target, (name, element)) in targets.iter().zip(&columns) {
        let is_position = target.as_ref().is_some_and(|target| target.column == POSITION);
        let is_float = element.is_none_or(|e| matches!(e, Element::F32 | Element::F64));
        if is_position && !is_float {
            return Err(Error::new(format!(
                "--text-columns: expected `{name}:f32` or `{name}:f64`, found `{text}`; positions are floats"
            )));
        }
    }
    Ok(columns)
}
