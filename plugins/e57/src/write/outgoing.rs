//! Columns of a cloud that is written, as fields of a scan.

use crate::read::layout::{COLUMN_INDEX, NORMALS, ROW_INDEX, TIME_STAMP};
use crate::refused;
use crate::write::held::{Points, Storage};
use crate::write::xml_text::field_name;
use e57::{IntensityLimits, PointCloudWriter, Record, RecordDataType, RecordName, RecordValue};
use std::collections::HashSet;
use std::io::{Read, Seek, Write};
use surfelshop_api::columns::{COLOR, Element, NORMAL, POSITION, Role, Values, role_of};
use surfelshop_api::format::{
    CloudHeader, FileColumn, GPS_TIME, INTENSITY, N_RETURNS, RETURN_NUMBER,
};
use surfelshop_api::glam::DVec3;
use surfelshop_api::params::linear_to_srgb;
use surfelshop_api::{Error, Result};

/// Prefix of the extension that columns without a field of the standard are in.
pub(crate) const COLUMNS: &str = "surfelshop";

/// Most fields of a scan: their values fit many times into a packet of 64 kB.
const MOST_FIELDS: usize = 1000;

/// How a value of a column becomes that of a field.
#[derive(Clone, Copy, PartialEq)]
enum Conversion {
    Same,
    /// One less: the file counts from 0.
    CountedFromZero,
    /// Linear colours as sRGB of 16 bits.
    Encoded,
}

/// A field but for the coordinates, and where its values are.
struct Outlet {
    record: Record,
    column: usize,
    component: usize,
    components: usize,
    conversion: Conversion,
    /// What floats are multiplied by: lengths become metres.
    factor: f64,
}

impl Outlet {
    fn value(&self, values: &Values<'_>, i: usize) -> RecordValue {
        let i = self.components * i + self.component;
        let whole = |value: i64| match self.conversion {
            Conversion::CountedFromZero => RecordValue::Integer((value - 1).max(0)),
            _ => RecordValue::Integer(value),
        };
        match values {
            Values::I8(values) => whole(values[i].into()),
            Values::U8(values) => whole(values[i].into()),
            Values::I16(values) => whole(values[i].into()),
            Values::U16(values) => whole(values[i].into()),
            Values::I32(values) => whole(values[i].into()),
            Values::U32(values) => whole(values[i].into()),
            Values::F32(values) if self.conversion == Conversion::Encoded => {
                // A cast of a float ends at the ends of the range, and is 0 for NaN.
                let encoded = linear_to_srgb(values[i].clamp(0.0, 1.0)) * 65535.0;
                RecordValue::Integer((encoded.round() as u16).into())
            }
            Values::F32(values) => RecordValue::Single((f64::from(values[i]) * self.factor) as f32),
            Values::F64(values) => RecordValue::Double(values[i] * self.factor),
        }
    }
}

/// The fields of a scan and what became of its points.
pub(crate) struct Outgoing {
    storage: [Storage; 3],
    outlets: Vec<Outlet>,
    /// The field of the intensity, and its smallest and largest values.
    intensity: Option<usize>,
    intensities: [f64; 2],
    n_dropped: u64,
    n_rounded: u64,
    n_counts: u64,
}

impl Outgoing {
    /// The fields of a cloud's columns; `lines` gets what they cannot hold.
    pub(crate) fn new(
        header: &CloudHeader,
        storage: [Storage; 3],
        metres: f64,
        lines: &mut Vec<String>,
    ) -> Self {
        let columns = &header.columns;
        let (outlets, names) = Default::default();
        let mut places = Places { header, metres, outlets, names, lines };
        for (i, column) in columns.iter().enumerate() {
            places.add(i, column);
        }
        let outlets = places.outlets;
        let intensity = outlets.iter().position(|o| o.record.name == RecordName::Intensity);
        let intensities = [f64::INFINITY, f64::NEG_INFINITY];
        let (n_dropped, n_rounded, n_counts) = Default::default();
        Self { storage, outlets, intensity, intensities, n_dropped, n_rounded, n_counts }
    }

    /// The fields as the file declares them, coordinates first.
    pub(crate) fn prototype(&self) -> Vec<Record> {
        let names = [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ];
        let coordinate = |(name, storage): (RecordName, Storage)| {
            let data_type = match storage {
                Storage::Double => RecordDataType::F64,
                Storage::Single => RecordDataType::F32,
                Storage::Steps { step, offset, min, max } => {
                    RecordDataType::ScaledInteger { min, max, scale: step, offset }
                }
            };
            Record { name, data_type }
        };
        let coordinates = names.into_iter().zip(self.storage).map(coordinate);
        coordinates.chain(self.outlets.iter().map(|outlet| outlet.record.clone())).collect()
    }

    /// Whether there are fields of an extension.
    pub(crate) fn uses(&self, extension: &str) -> bool {
        let of_it = |outlet: &Outlet| match &outlet.record.name {
            RecordName::Unknown { namespace, .. } => namespace == extension,
            _ => false,
        };
        self.outlets.iter().any(of_it)
    }

    /// Adds points to a scan.
    ///
    /// # Errors
    /// Where a coordinate is out of the range of its steps, or the file cannot be written.
    pub(crate) fn add<T: Read + Write + Seek>(
        &mut self,
        scan: &mut PointCloudWriter<'_, T>,
        points: &Points<'_>,
    ) -> Result<()> {
        for i in 0..points.len {
            let place = points.place(i);
            if !place.is_finite() {
                self.n_dropped += 1;
                continue;
            }
            let mut values = Vec::with_capacity(3 + self.outlets.len());
            self.coordinates(place, &mut values)?;
            for outlet in &self.outlets {
                values.push(outlet.value(&points.columns[outlet.column], i));
            }
            if let Some(intensity) = self.intensity {
                self.see(&values[3 + intensity]);
            }
            scan.add_point(values).map_err(|error| refused(&error))?;
        }
        self.count_zeros(points);
        Ok(())
    }

    fn coordinates(&mut self, place: DVec3, values: &mut Vec<RecordValue>) -> Result<()> {
        let mut rounded = false;
        for (value, storage) in place.to_array().into_iter().zip(self.storage) {
            values.push(match storage {
                Storage::Double => RecordValue::Double(value),
                // All are `f32`, or another storage is chosen.
                Storage::Single => RecordValue::Single(value as f32),
                Storage::Steps { step, offset, min, max } => {
                    let (steps, away) = Storage::steps(step, offset, value);
                    if !(steps >= min as f64 && steps <= max as f64) {
                        return Err(Error::new(format!(
                            "expected coordinates that are at most {max} steps of {step} m from zero, found {value}"
                        )));
                    }
                    rounded |= away > 1e-2;
                    RecordValue::ScaledInteger(steps as i64)
                }
            });
        }
        self.n_rounded += u64::from(rounded);
        Ok(())
    }

    fn see(&mut self, intensity: &RecordValue) {
        let value = match intensity {
            RecordValue::Single(value) => f64::from(*value),
            RecordValue::Double(value) => *value,
            RecordValue::ScaledInteger(value) | RecordValue::Integer(value) => *value as f64,
        };
        if value.is_finite() {
            let [low, high] = self.intensities;
            self.intensities = [low.min(value), high.max(value)];
        }
    }

    /// Counts numbers of returns that do not count from 1.
    fn count_zeros(&mut self, points: &Points<'_>) {
        for outlet in self.outlets.iter().filter(|o| o.conversion == Conversion::CountedFromZero) {
            let zeros = points.columns[outlet.column].iter_f64().filter(|&value| value < 1.0);
            self.n_counts += zeros.count() as u64;
        }
    }

    /// The smallest and largest intensity, where there are two.
    pub(crate) fn intensity_limits(&self) -> Option<IntensityLimits> {
        let outlet = &self.outlets[self.intensity?];
        let [low, high] = self.intensities;
        let value = |value: f64| match outlet.record.data_type {
            RecordDataType::Single { .. } => RecordValue::Single(value as f32),
            RecordDataType::Double { .. } => RecordValue::Double(value),
            _ => RecordValue::Integer(value as i64),
        };
        (low < high).then(|| IntensityLimits {
            intensity_min: Some(value(low)),
            intensity_max: Some(value(high)),
        })
    }

    /// What became of points, for people.
    pub(crate) fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if self.n_dropped > 0 {
            lines
                .push(format!("{} points without finite coordinates are left out", self.n_dropped));
        }
        if self.n_rounded > 0 {
            lines.push(format!(
                "the coordinates of {} points are rounded to whole steps",
                self.n_rounded
            ));
        }
        if self.n_counts > 0 {
            lines.push(format!(
                "{} values of `{RETURN_NUMBER}` below 1 are written as 1",
                self.n_counts
            ));
        }
        lines
    }
}

/// The field of the extension that holds the opacity of colours.
const ALPHA: &str = "alpha";

/// Finds fields for columns.
struct Places<'a> {
    header: &'a CloudHeader,
    metres: f64,
    outlets: Vec<Outlet>,
    /// Names of fields of the extension.
    names: HashSet<String>,
    lines: &'a mut Vec<String>,
}

impl Places<'_> {
    fn has(&self, name: &str) -> bool {
        self.header.column(name).is_some_and(|(_, column)| is_whole(column))
    }

    fn add(&mut self, i: usize, column: &FileColumn) {
        use RecordName as N;
        let (one, whole) = (column.components == 1, is_whole(column));
        let float = matches!(column.element, Element::F32 | Element::F64);
        match column.name.as_str() {
            POSITION => {}
            COLOR if column.components >= 3 && is_color(column.element) => self.color(i, column),
            NORMAL if column.components == 3 && float => {
                let names = ["normalX", "normalY", "normalZ"].map(|name| extended(NORMALS, name));
                self.several(i, column, &names);
            }
            INTENSITY if one => self.one(i, column, N::Intensity),
            ROW_INDEX if whole => self.one(i, column, N::RowIndex),
            COLUMN_INDEX if whole => self.one(i, column, N::ColumnIndex),
            RETURN_NUMBER if whole && self.has(N_RETURNS) => {
                self.one(i, column, N::ReturnIndex);
                if let Some(outlet) = self.outlets.last_mut() {
                    outlet.conversion = Conversion::CountedFromZero;
                    if let RecordDataType::Integer { max, .. } = outlet.record.data_type {
                        outlet.record.data_type = RecordDataType::Integer { min: 0, max: max - 1 };
                    }
                }
            }
            N_RETURNS if whole && self.has(RETURN_NUMBER) => self.one(i, column, N::ReturnCount),
            TIME_STAMP if one => self.one(i, column, N::TimeStamp),
            GPS_TIME if one && self.header.column(TIME_STAMP).is_none() => {
                self.lines.push(format!("`{GPS_TIME}` is written as the field timeStamp, which is read as `{TIME_STAMP}`"));
                self.one(i, column, N::TimeStamp);
            }
            _ => self.other(i, column),
        }
    }

    fn color(&mut self, i: usize, column: &FileColumn) {
        let names = [RecordName::ColorRed, RecordName::ColorGreen, RecordName::ColorBlue];
        self.several(i, column, &names);
        if column.components > 3 && column.element != Element::F32 {
            // The standard has no field for opacity.
            self.outlets.push(Outlet {
                record: Record {
                    name: extended(COLUMNS, ALPHA),
                    data_type: data_type(column.element),
                },
                column: i,
                component: 3,
                components: column.components as usize,
                conversion: Conversion::Same,
                factor: 1.0,
            });
            self.names.insert(ALPHA.to_owned());
        } else if column.components > 3 {
            self.lines.push("the opacity of `color` is not written".to_owned());
        }
        if column.element == Element::F32 {
            self.lines
                .push("linear colours of `color` are written as sRGB with 16 bits".to_owned());
            for outlet in self.outlets.iter_mut().rev().take(3) {
                outlet.conversion = Conversion::Encoded;
                outlet.record.data_type = RecordDataType::U16;
            }
        }
    }

    /// A column that the standard has no field for.
    fn other(&mut self, i: usize, column: &FileColumn) {
        let (name, n) = (&column.name, column.components);
        let base = field_name(name);
        let names: Vec<String> = match n {
            1 => vec![base.clone()],
            _ => (0..n.min(1 << 16)).map(|k| format!("{base}-{k}")).collect(),
        };
        if self.outlets.len() + names.len() > MOST_FIELDS {
            self.lines
                .push(format!("`{name}` is not written: a scan has at most {MOST_FIELDS} fields"));
            return;
        }
        if names.iter().any(|name| self.names.contains(name)) {
            self.lines.push(format!("`{name}` is not written: another column is called `{base}`"));
            return;
        }
        if base != *name {
            self.lines.push(format!("`{name}` is written as `{base}`"));
        }
        let records: Vec<_> = names.iter().map(|name| extended(COLUMNS, name)).collect();
        self.several(i, column, &records);
        self.names.extend(names);
    }

    fn one(&mut self, i: usize, column: &FileColumn, name: RecordName) {
        self.several(i, column, &[name]);
    }

    fn several(&mut self, column_index: usize, column: &FileColumn, names: &[RecordName]) {
        let is_length = column.role == Role::Length || role_of(&column.name) == Role::Length;
        for (component, name) in names.iter().enumerate() {
            self.outlets.push(Outlet {
                record: Record { name: name.clone(), data_type: data_type(column.element) },
                column: column_index,
                component,
                components: column.components as usize,
                conversion: Conversion::Same,
                factor: if is_length { self.metres } else { 1.0 },
            });
        }
    }
}

fn extended(extension: &str, name: &str) -> RecordName {
    RecordName::Unknown { namespace: extension.to_owned(), name: name.to_owned() }
}

/// Whether a column is one whole number.
fn is_whole(column: &FileColumn) -> bool {
    column.components == 1 && !matches!(column.element, Element::F32 | Element::F64)
}

/// Whether colours are of this type.
fn is_color(element: Element) -> bool {
    matches!(element, Element::U8 | Element::U16 | Element::F32)
}

/// The type of a field that holds a column's values.
fn data_type(element: Element) -> RecordDataType {
    let whole = |min: i64, max: i64| RecordDataType::Integer { min, max };
    match element {
        Element::I8 => whole(i8::MIN.into(), i8::MAX.into()),
        Element::U8 => whole(0, u8::MAX.into()),
        Element::I16 => whole(i16::MIN.into(), i16::MAX.into()),
        Element::U16 => whole(0, u16::MAX.into()),
        Element::I32 => whole(i32::MIN.into(), i32::MAX.into()),
        Element::U32 => whole(0, u32::MAX.into()),
        Element::F32 => RecordDataType::F32,
        Element::F64 => RecordDataType::F64,
    }
}
