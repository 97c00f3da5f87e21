//! Where the columns of a cloud go in point records.

use super::extra_fields::{ExtraFields, Fitting};
use super::values;
use crate::layout::{ANGLE_STEP, CLASS_FLAGS, NIR, SCAN_FLAGS, SCANNER_CHANNEL, USER_DATA};
use crate::point_format::PointFormat;
use crate::projection::is_wkt;
use surfelshop_api::columns::{COLOR, Element, POSITION, Values};
use surfelshop_api::format::{
    CLASSIFICATION, CloudHeader, FileColumn, GPS_TIME, INTENSITY, N_RETURNS, POINT_SOURCE,
    RETURN_NUMBER, SCAN_ANGLE,
};
use surfelshop_api::{CloudView, Error, Result};

/// What becomes of a column, or of a component of it.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Put {
    /// Coordinates.
    Position,
    /// Whole numbers from 0 to `most` in bits of the one or two bytes at `at`.
    Whole { at: usize, shift: u32, most: u16 },
    /// Whole numbers of so many degrees, of one byte or of two.
    Angle { at: usize, step: f64, most: f64 },
    /// Seconds.
    Time { at: usize },
    /// Red, green and blue.
    Color { at: usize },
    /// A component as it is.
    Raw { at: usize, component: usize },
}

/// A column on its way into records.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field {
    /// Its place among the columns of a batch.
    pub(super) column: usize,
    pub(super) name: String,
    pub(super) components: usize,
    pub(super) put: Put,
}

/// How records are filled.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    /// The minor version of LAS, 2 or 4.
    pub(super) minor: u8,
    pub(super) format: PointFormat,
    pub(super) record_len: usize,
    pub(super) fields: Vec<Field>,
    /// Descriptions of extra bytes.
    pub(super) descriptions: Vec<u8>,
    /// What every record has where no column says anything else.
    pub(super) empty: Vec<u8>,
    /// What cannot be held, for people.
    pub(super) lines: Vec<String>,
}

impl Plan {
    /// How to write a cloud with such a header whose first points are these, as LAS 1.2 or 1.4.
    ///
    /// # Errors
    /// Where there are no positions.
    pub(super) fn new(
        header: &CloudHeader,
        first: Option<&CloudView<'_>>,
        minor: u8,
    ) -> Result<Self> {
        let standard = Standard::new(header, first, minor)?;
        let (mut fields, mut lines) = (Vec::new(), Vec::new());
        let mut extra = ExtraFields::new(standard.format.len, &header.columns);
        for (i, column) in header.columns.iter().enumerate() {
            let put = standard.put(i, column);
            if matches!(put, Some(Put::Time { .. })) && column.name == TIME_STAMP {
                lines.push(format!(
                    "`{TIME_STAMP}` is written as the field of GPS times, which is read as `{GPS_TIME}`"
                ));
            }
            let is_standard = is_meant(column);
            if is_standard && put.is_none() {
                lines.push(format!(
                    "`{}` does not fit into its field of LAS 1.{minor}; it is kept as extra bytes of {}",
                    column.name,
                    column.element.name()
                ));
            }
            let components = column.components as usize;
            let mut add = |put| {
                fields.push(Field { column: i, name: column.name.clone(), components, put });
            };
            match put {
                Some(put) => {
                    if matches!(put, Put::Color { .. }) && components == 4 {
                        let alpha = FileColumn::new("alpha", 1, column.element);
                        if let Fitting::At(at) = extra.add(&alpha, false, &mut lines) {
                            add(Put::Raw { at, component: 3 });
                        }
                    }
                    if matches!(put, Put::Color { .. }) && column.element == Element::U8 {
                        lines.push(
                            "`color` is written with 16 bits a channel, as LAS has it".to_owned(),
                        );
                    }
                    add(put);
                }
                None => {
                    if let Fitting::At(start) = extra.add(column, is_standard, &mut lines) {
                        let size = column.element.size();
                        for component in 0..components {
                            add(Put::Raw { at: start + component * size, component });
                        }
                    }
                }
            }
        }
        let record_len = standard.format.len + extra.len();
        let mut empty = vec![0; record_len];
        // A point whose returns nobody counted is the only one of its pulse.
        if header.column(RETURN_NUMBER).is_none() && header.column(N_RETURNS).is_none() {
            empty[14] = if standard.format.is_extended() { 0x11 } else { 0x09 };
        }
        let (format, descriptions) = (standard.format, extra.into_descriptions());
        Ok(Self { minor, format, record_len, fields, descriptions, empty, lines })
    }
}

/// A column that LAS 1.2 has a narrower field for than LAS 1.4.
pub(super) struct Narrow {
    column: usize,
    is_fitting: fn(f64) -> bool,
}

impl Narrow {
    /// Whether the field holds all values of a batch as they are.
    pub(super) fn holds(&self, batch: &CloudView<'_>) -> bool {
        let column = batch.columns.get(self.column);
        column.is_some_and(|column| values::all(&column.values, self.is_fitting))
    }
}

/// The columns on whose values it depends whether LAS 1.2 holds a cloud with such a header; `None` where it does not,
/// whatever they are.
pub(super) fn narrow(header: &CloudHeader) -> Option<Vec<Narrow>> {
    let is_few = header.rows.is_none_or(|rows| u32::try_from(rows).is_ok());
    if !is_few || is_wkt(&header.coordinate_system) {
        return None;
    }
    let mut narrow = Vec::new();
    for (column, FileColumn { name, components, .. }) in header.columns.iter().enumerate() {
        let is_fitting: fn(f64) -> bool = match name.as_str() {
            SCANNER_CHANNEL | NIR => return None,
            CLASSIFICATION => |value| is_whole_to(value, 31),
            RETURN_NUMBER | N_RETURNS => |value| is_whole_to(value, 7),
            CLASS_FLAGS => |value| is_whole_to(value, 7),
            SCAN_ANGLE => is_whole_degree,
            _ => continue,
        };
        if *components != 1 {
            return None;
        }
        narrow.push(Narrow { column, is_fitting });
    }
    Some(narrow)
}

/// Whether a value is a whole number from 0 to `most`.
fn is_whole_to(value: f64, most: u16) -> bool {
    value >= 0.0 && value <= f64::from(most) && value.fract() == 0.0
}

/// Whether a field of whole degrees holds a value; what is no number is 0 in both versions.
fn is_whole_degree(value: f64) -> bool {
    value.is_nan() || value.abs() <= f64::from(i8::MAX) && value.fract() == 0.0
}

/// The fields that the standard names.
struct Standard<'a> {
    first: Option<&'a CloudView<'a>>,
    format: PointFormat,
    /// The column that goes into the field of times.
    time: &'a str,
}

impl<'a> Standard<'a> {
    fn new(header: &'a CloudHeader, first: Option<&'a CloudView<'a>>, minor: u8) -> Result<Self> {
        let is_position = |column: &FileColumn| {
            column.components == 3 && matches!(column.element, Element::F32 | Element::F64)
        };
        if !header.column(POSITION).is_some_and(|(_, column)| is_position(column)) {
            return Err(Error::new("expected a column `position` of three floats, found none"));
        }
        let has_time = time_of(header).is_some_and(|column| column.components == 1);
        let has_color = header.column(COLOR).is_some_and(|(_, column)| is_color(column));
        let time = time_of(header).map_or(GPS_TIME, |column| column.name.as_str());
        let mut standard = Self { first, format: format(0)?, time };
        let nir = header.column(NIR);
        let has_nir = nir.is_some_and(|(i, column)| standard.is_whole(i, column, u16::MAX));
        let id = match (minor, has_color) {
            (4, true) if has_nir => 8,
            (4, true) => 7,
            (4, false) => 6,
            _ => u8::from(has_time) + 2 * u8::from(has_color),
        };
        standard.format = format(id)?;
        Ok(standard)
    }

    /// What becomes of a column; `None` where it has no place in the standard fields.
    fn put(&self, i: usize, column: &FileColumn) -> Option<Put> {
        let format = self.format;
        let whole = |at, shift, most| {
            self.is_whole(i, column, most).then_some(Put::Whole { at, shift, most })
        };
        let is_one = column.components == 1;
        match (column.name.as_str(), format.is_extended()) {
            (POSITION, _) => Some(Put::Position),
            (INTENSITY, _) => whole(12, 0, u16::MAX),
            (RETURN_NUMBER, true) => whole(14, 0, 15),
            (N_RETURNS, true) => whole(14, 4, 15),
            (CLASSIFICATION, true) => whole(16, 0, 255),
            (CLASS_FLAGS, true) => whole(15, 0, 15),
            (SCAN_FLAGS, true) => whole(15, 6, 3),
            (SCANNER_CHANNEL, true) => whole(15, 4, 3),
            (USER_DATA, _) => whole(17, 0, 255),
            (SCAN_ANGLE, true) if is_one => {
                Some(Put::Angle { at: 18, step: ANGLE_STEP, most: f64::from(i16::MAX) })
            }
            (POINT_SOURCE, true) => whole(20, 0, u16::MAX),
            (RETURN_NUMBER, false) => whole(14, 0, 7),
            (N_RETURNS, false) => whole(14, 3, 7),
            (CLASSIFICATION, false) => whole(15, 0, 31),
            (CLASS_FLAGS, false) => whole(15, 5, 7),
            (SCAN_FLAGS, false) => whole(14, 6, 3),
            (SCAN_ANGLE, false) if self.has_whole_degrees(i, column) => {
                Some(Put::Angle { at: 16, step: 1.0, most: f64::from(i8::MAX) })
            }
            (POINT_SOURCE, false) => whole(18, 0, u16::MAX),
            (name, _) if name == self.time && is_one => Some(Put::Time { at: format.gps_time? }),
            (COLOR, _) if is_color(column) => Some(Put::Color { at: format.color? }),
            (NIR, _) => whole(format.nir?, 0, u16::MAX),
            _ => None,
        }
    }

    /// The first values of a column.
    fn values(&self, i: usize) -> Option<&Values<'a>> {
        self.first?.columns.get(i).map(|column| &column.values)
    }

    /// Whether a column has whole numbers from 0 to `most`: by its type, or as far as its first values show.
    fn is_whole(&self, i: usize, column: &FileColumn, most: u16) -> bool {
        let by_type = match column.element {
            Element::U8 => most >= 255,
            Element::U16 => most == u16::MAX,
            _ => false,
        };
        let fits = |value| is_whole_to(value, most);
        let by_values = || self.values(i).is_some_and(|found| values::all(found, fits));
        column.components == 1 && (by_type || by_values())
    }

    fn has_whole_degrees(&self, i: usize, column: &FileColumn) -> bool {
        let by_values = || self.values(i).is_some_and(|found| values::all(found, is_whole_degree));
        column.components == 1 && (column.element == Element::I8 || by_values())
    }
}

/// What E57 files have as the time of a point.
const TIME_STAMP: &str = "time_stamp";

/// The column that goes into the field of times: that of GPS, or else that of a scan.
fn time_of(header: &CloudHeader) -> Option<&FileColumn> {
    let column = |name| header.column(name).map(|(_, column)| column);
    column(GPS_TIME).or_else(|| column(TIME_STAMP))
}

/// Whether a column has the name of a field of the standard, of any version.
fn is_meant(column: &FileColumn) -> bool {
    matches!(
        column.name.as_str(),
        INTENSITY
            | RETURN_NUMBER
            | N_RETURNS
            | CLASSIFICATION
            | CLASS_FLAGS
            | SCAN_FLAGS
            | SCANNER_CHANNEL
            | USER_DATA
            | SCAN_ANGLE
            | POINT_SOURCE
            | GPS_TIME
            | COLOR
            | NIR
    )
}

fn format(id: u8) -> Result<PointFormat> {
    PointFormat::of(id).ok_or_else(|| Error::new(format!("there is no point format {id}")))
}

/// Whether a column holds colours of a type that they can have.
fn is_color(column: &FileColumn) -> bool {
    let is_known =
        matches!(column.element, Element::U8 | Element::U16 | Element::F32 | Element::F64);
    is_known && (column.components == 3 || column.components == 4)
}
