//! Columns as the bytes of points.

use crate::Encoding;
use crate::names::{Names, field_of};
use surfelshop_api::CloudView;
use surfelshop_api::columns::{COLOR, Element, NORMAL, POSITION, Values};
use surfelshop_api::format::{CloudHeader, FileColumn};
use surfelshop_api::params::linear_to_srgb;
use surfelshop_api::prelude::{Error, Result};

/// A field of the file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Field {
    pub name: String,
    /// `I`, `U` or `F`.
    pub letter: char,
    pub size: usize,
    pub count: usize,
}

impl Field {
    /// Bytes in a point.
    pub(crate) fn bytes(&self) -> usize {
        self.size * self.count
    }
}

/// What becomes of a column's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    Position,
    /// Bytes blue, green, red, alpha.
    Packed,
    /// As they are.
    Own,
}

/// A column, and where its bytes lie in a point.
struct Part {
    form: Form,
    components: usize,
    /// For wide positions.
    offset: usize,
}

/// How points are made of columns.
pub(crate) struct Encoder {
    fields: Vec<Field>,
    parts: Vec<Part>,
    /// The columns as batches have them.
    columns: CloudHeader,
    /// Whether positions need 8 bytes.
    is_wide: bool,
    /// Bytes of a point with wide positions.
    step: usize,
}

/// Bytes that positions need less where they are not wide.
const NARROWER: usize = 12;

const AXES: [&str; 3] = ["x", "y", "z"];
const NORMAL_AXES: [&str; 3] = ["normal_x", "normal_y", "normal_z"];

fn letter(element: Element) -> char {
    match element {
        Element::I8 | Element::I16 | Element::I32 => 'I',
        Element::U8 | Element::U16 | Element::U32 => 'U',
        Element::F32 | Element::F64 => 'F',
    }
}

impl Encoder {
    /// Lays out the columns of a cloud, positions first; adds what the format cannot hold.
    ///
    /// # Errors
    /// Where there are no positions.
    pub(crate) fn new(
        header: &CloudHeader,
        encoding: Encoding,
        lines: &mut Vec<String>,
    ) -> Result<Self> {
        let mut columns = header.clone();
        // Whatever they were, they are handed over as f64.
        for column in &mut columns.columns {
            if column.name == POSITION {
                *column = FileColumn::new(POSITION, 3, Element::F64);
            }
        }
        if columns.column(POSITION).is_none() {
            return Err(Error::new("expected a column `position`, found none"));
        }
        let mut made =
            Self { fields: Vec::new(), parts: Vec::new(), columns, is_wide: false, step: 24 };
        let mut names = Names::default();
        // No other column may be taken for one of these.
        AXES.iter()
            .chain(&NORMAL_AXES)
            .chain(&["rgb", "rgba"])
            .for_each(|name| drop(names.field(name)));
        AXES.iter().for_each(|axis| made.field((*axis).to_owned(), 'F', 4, 1));
        for column in &header.columns {
            let part = made.part(column, encoding, &mut names, lines);
            made.parts.push(part);
        }
        Ok(made)
    }

    fn field(&mut self, name: String, letter: char, size: usize, count: usize) {
        self.fields.push(Field { name, letter, size, count });
    }

    fn part(
        &mut self,
        column: &FileColumn,
        encoding: Encoding,
        names: &mut Names,
        lines: &mut Vec<String>,
    ) -> Part {
        let (offset, element) = (self.step, column.element);
        // At most what the host takes.
        let (components, size) = (column.components as usize, element.size());
        let form = match (column.name.as_str(), components, element) {
            (POSITION, _, _) => return Part { form: Form::Position, components: 3, offset: 0 },
            (NORMAL, 3, Element::F32 | Element::F64) => {
                NORMAL_AXES.iter().for_each(|axis| self.field((*axis).to_owned(), 'F', size, 1));
                Form::Own
            }
            (COLOR, 3 | 4, Element::U8 | Element::U16 | Element::F32) => {
                if element != Element::U8 {
                    lines.push("`color` is rounded to 8 bits of sRGB".to_owned());
                }
                // PCL's custom; as text it would be no number where red is large.
                let name = if components == 4 { "rgba" } else { "rgb" };
                let float = components == 3 && encoding != Encoding::Ascii;
                self.field(name.to_owned(), if float { 'F' } else { 'U' }, 4, 1);
                Form::Packed
            }
            (name, _, _) => {
                let field = names.field(field_of(name));
                if field != field_of(name) {
                    lines.push(format!("column `{name}` was written as `{field}`"));
                }
                self.field(field, letter(element), size, components);
                Form::Own
            }
        };
        self.step += if form == Form::Packed { 4 } else { components * size };
        Part { form, components, offset }
    }

    /// The fields as they are by now.
    pub(crate) fn fields(&self) -> Vec<Field> {
        let mut fields = self.fields.clone();
        fields.iter_mut().take(3).for_each(|axis| axis.size = if self.is_wide { 8 } else { 4 });
        fields
    }

    /// Bytes of a point.
    pub(crate) fn step(&self) -> usize {
        if self.is_wide { self.step } else { self.step - NARROWER }
    }

    /// Whether positions must become wide before these points are encoded.
    pub(crate) fn must_widen(&self, batch: &CloudView<'_>) -> bool {
        // What is no number is none in f32, too.
        let is_exact = |value: &f64| f64::from(*value as f32) == *value || value.is_nan();
        let positions = batch.column(POSITION).map(|column| column.values);
        !self.is_wide
            && matches!(positions, Some(Values::F64(values)) if !values.iter().all(is_exact))
    }

    /// Gives positions 8 bytes from now on.
    pub(crate) fn widen(&mut self) {
        self.is_wide = true;
    }

    /// The bytes of points.
    ///
    /// # Errors
    /// Where the batch does not have the columns of the header, or memory runs out.
    pub(crate) fn encode(&self, batch: &CloudView<'_>, rows: &mut Vec<u8>) -> Result<()> {
        let values: Vec<Values<'_>> = batch.columns.iter().map(|column| column.values).collect();
        let n = surfelshop_api::format::check_batch(&self.columns, &values)?;
        let step = self.step();
        rows.clear();
        rows.try_reserve(n * step)?;
        rows.resize(n * step, 0);
        for (part, values) in self.parts.iter().zip(&values) {
            let target = Target { rows, step, offset: self.offset(part), count: part.components };
            match (part.form, values) {
                (Form::Position, Values::F64(values)) if !self.is_wide => {
                    target.put(values, |value| (value as f32).to_le_bytes());
                }
                (Form::Packed, values) => target.pack(values),
                (_, values) => target.own(values),
            }
        }
        Ok(())
    }

    fn offset(&self, part: &Part) -> usize {
        let narrower = if self.is_wide || part.form == Form::Position { 0 } else { NARROWER };
        part.offset - narrower
    }
}

/// Points with wide positions, of points with narrow ones.
pub(crate) fn widened(narrow: &[u8], step: usize, wide: &mut Vec<u8>) {
    for row in narrow.chunks_exact(step) {
        let (positions, rest) = row.split_at(NARROWER);
        for value in positions.as_chunks::<4>().0 {
            wide.extend(f64::from(f32::from_le_bytes(*value)).to_le_bytes());
        }
        wide.extend_from_slice(rest);
    }
}

/// Where the values of a column go.
struct Target<'a> {
    rows: &'a mut [u8],
    step: usize,
    offset: usize,
    count: usize,
}

impl Target<'_> {
    fn put<T: Copy, const N: usize>(self, values: &[T], bytes: impl Fn(T) -> [u8; N]) {
        let rows = self.rows.chunks_exact_mut(self.step);
        for (row, values) in rows.zip(values.chunks_exact(self.count.max(1))) {
            let places = row[self.offset..].as_chunks_mut::<N>().0;
            for (place, value) in places.iter_mut().zip(values) {
                *place = bytes(*value);
            }
        }
    }

    fn own(self, values: &Values<'_>) {
        match values {
            Values::I8(values) => self.put(values, i8::to_le_bytes),
            Values::U8(values) => self.put(values, u8::to_le_bytes),
            Values::I16(values) => self.put(values, i16::to_le_bytes),
            Values::U16(values) => self.put(values, u16::to_le_bytes),
            Values::I32(values) => self.put(values, i32::to_le_bytes),
            Values::U32(values) => self.put(values, u32::to_le_bytes),
            Values::F32(values) => self.put(values, f32::to_le_bytes),
            Values::F64(values) => self.put(values, f64::to_le_bytes),
        }
    }

    fn pack(self, values: &Values<'_>) {
        // Casts of floats to whole numbers stop at their ends, and take what is no number as 0.
        let linear = |value: f32| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        match values {
            Values::U8(values) => self.colors(values, |value| value, |value| value),
            Values::U16(values) => {
                let byte = |value| ((u32::from(value) + 128) / 257) as u8;
                self.colors(values, byte, byte);
            }
            Values::F32(values) => {
                let encoded = |value: f32| linear(linear_to_srgb(value.clamp(0.0, 1.0)));
                self.colors(values, encoded, linear);
            }
            // The layout packs no others.
            _ => {}
        }
    }

    fn colors<T: Copy>(self, values: &[T], channel: impl Fn(T) -> u8, alpha: impl Fn(T) -> u8) {
        let rows = self.rows.chunks_exact_mut(self.step);
        for (row, color) in rows.zip(values.chunks_exact(self.count.max(1))) {
            if let (Some(place), [red, green, blue, rest @ ..]) =
                (row[self.offset..].first_chunk_mut(), color)
            {
                // Without alpha the upper byte stays 0, so that the float is a number.
                let alpha = rest.first().map_or(0, |value| alpha(*value));
                *place = [channel(*blue), channel(*green), channel(*red), alpha];
            }
        }
    }
}
