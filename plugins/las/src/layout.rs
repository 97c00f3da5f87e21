//! Which columns a file has, and where in a point record their values lie.

use crate::extra::{self, Extra, IN_PLACE_OF};
use crate::header::Header;
use crate::numbers::Number;
use crate::point_format::PointFormat;
use surfelshop_api::columns::{
    AO, CLIP, COLOR, Element, MATERIAL, NORMAL, NORMAL_FIELD, POSITION, RADIUS, TANGENT_U,
    TANGENT_V,
};
use surfelshop_api::format::{
    CLASSIFICATION, FileColumn, GPS_TIME, INTENSITY, N_RETURNS, POINT_SOURCE, RETURN_NUMBER,
    SCAN_ANGLE,
};
use surfelshop_api::glam::DVec3;

/// Flags of a point's class: synthetic 1, key point 2, withheld 4, overlap 8.
pub(crate) const CLASS_FLAGS: &str = "class_flags";
/// Flags of a pulse: direction of the scan 1, edge of a flight line 2.
pub(crate) const SCAN_FLAGS: &str = "scan_flags";
/// Channel of the scanner, 0 to 3.
pub(crate) const SCANNER_CHANNEL: &str = "scanner_channel";
/// A byte of the user's.
pub(crate) const USER_DATA: &str = "user_data";
/// Near infrared.
pub(crate) const NIR: &str = "nir";
/// The fields that a normal is made of.
pub(crate) const NORMALS: [&str; 3] = ["NormalX", "NormalY", "NormalZ"];
/// Degrees of a step of scan angles in formats 6 to 10.
pub(crate) const ANGLE_STEP: f64 = 0.006;

/// Where the values of a column come from.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Source {
    /// The three coordinates: whole numbers, times the scale, plus the offset.
    Position { scale: DVec3, offset: DVec3 },
    /// Bits of a byte.
    Bits { at: usize, shift: u32, mask: u8 },
    /// Whole degrees, a signed byte.
    Degrees { at: usize },
    /// Degrees in steps, a signed number of two bytes.
    Steps { at: usize },
    /// Numbers as they are.
    Plain { number: Number, places: Vec<usize> },
    /// Numbers that are multiplied and added to, and whole numbers of eight bytes.
    Scaled { number: Number, components: Vec<extra::Component> },
}

/// A column and where it comes from.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Column {
    pub(crate) file: FileColumn,
    pub(crate) source: Source,
    /// Whether the values lie in the extra bytes.
    pub(crate) is_extra: bool,
}

/// The columns of a file.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layout {
    /// Bytes of a point record.
    pub(crate) record_len: usize,
    /// The columns that are wanted; the first is the position.
    pub(crate) columns: Vec<Column>,
}

impl Layout {
    /// The columns of a file with such a header whose extra bytes are these, without those that nobody wants.
    pub(crate) fn new(
        header: &Header,
        extra: Vec<Extra>,
        wants: impl Fn(&str) -> bool,
        warnings: &mut Vec<String>,
    ) -> Self {
        let mut columns = standard(header);
        add_extra(&mut columns, extra, warnings);
        columns.retain(|column| column.file.name == POSITION || wants(&column.file.name));
        Self { record_len: header.record_len, columns }
    }

    /// Bytes of a point's values.
    pub(crate) fn point_bytes(&self) -> usize {
        self.columns.iter().map(|column| column.file.point_bytes()).sum()
    }
}

/// The columns of a point format.
fn standard(header: &Header) -> Vec<Column> {
    let PointFormat { gps_time, color, nir, .. } = header.format;
    let is_extended = header.format.is_extended();
    let bits = |at, shift, mask| Source::Bits { at, shift, mask };
    let words = |places| Source::Plain { number: Number::U16, places };
    let (scale, offset) = (header.scale, header.offset);
    let position = FileColumn::new(POSITION, 3, Element::F64);
    let source = Source::Position { scale, offset };
    let mut columns = vec![Column { file: position, source, is_extra: false }];
    let mut add = |name: &str, element, description: &str, source| {
        let description = description.to_owned();
        let components = if name == COLOR { 3 } else { 1 };
        let file = FileColumn { description, ..FileColumn::new(name, components, element) };
        columns.push(Column { file, source, is_extra: false });
    };
    add(INTENSITY, Element::U16, "", words(vec![12]));
    let (n_shift, return_mask) = if is_extended { (4, 15) } else { (3, 7) };
    add(RETURN_NUMBER, Element::U8, "", bits(14, 0, return_mask));
    add(N_RETURNS, Element::U8, "", bits(14, n_shift, return_mask));
    let flags = "1 synthetic, 2 key point, 4 withheld, 8 overlap";
    let pulse = "1 direction of the scan, 2 edge of a flight line";
    if is_extended {
        add(CLASSIFICATION, Element::U8, "", bits(16, 0, 255));
        add(CLASS_FLAGS, Element::U8, flags, bits(15, 0, 15));
        add(SCAN_FLAGS, Element::U8, pulse, bits(15, 6, 3));
        add(SCANNER_CHANNEL, Element::U8, "", bits(15, 4, 3));
        add(SCAN_ANGLE, Element::F32, "", Source::Steps { at: 18 });
        add(USER_DATA, Element::U8, "", bits(17, 0, 255));
        add(POINT_SOURCE, Element::U16, "", words(vec![20]));
    } else {
        add(CLASSIFICATION, Element::U8, "", bits(15, 0, 31));
        add(CLASS_FLAGS, Element::U8, flags, bits(15, 5, 7));
        add(SCAN_FLAGS, Element::U8, pulse, bits(14, 6, 3));
        add(SCAN_ANGLE, Element::F32, "", Source::Degrees { at: 16 });
        add(USER_DATA, Element::U8, "", bits(17, 0, 255));
        add(POINT_SOURCE, Element::U16, "", words(vec![18]));
    }
    if let Some(at) = gps_time {
        let kind = if header.is_standard_time { STANDARD_TIME } else { WEEK_TIME };
        add(GPS_TIME, Element::F64, kind, Source::Plain { number: Number::F64, places: vec![at] });
    }
    if let Some(at) = color {
        add(COLOR, Element::U16, "", words(vec![at, at + 2, at + 4]));
    }
    if let Some(at) = nir {
        add(NIR, Element::U16, "", words(vec![at]));
    }
    for column in &mut columns {
        column.file.unit = match column.file.name.as_str() {
            SCAN_ANGLE => "deg",
            GPS_TIME => "s",
            _ => "",
        }
        .to_owned();
    }
    columns
}

/// What the column of times says where they count from 1980.
pub(crate) const STANDARD_TIME: &str = "GPS time since 1980, less 1e9";
/// What it says where they count from the beginning of a week.
const WEEK_TIME: &str = "GPS time of the week";

/// Adds the columns of extra bytes.
fn add_extra(columns: &mut Vec<Column>, extra: Vec<Extra>, warnings: &mut Vec<String>) {
    for field in joined(extra) {
        let place = field.description.strip_prefix(IN_PLACE_OF).unwrap_or_default().to_owned();
        let standard = columns.iter().position(|column| column.file.name == place);
        if field.number.element().is_none() && !field.is_scaled {
            warnings.push(format!(
                "the extra bytes `{}` are whole numbers of 64 bits; they are read as f64",
                field.name
            ));
        }
        let mut column = column_of(field, columns.len());
        match standard {
            // The standard field was left empty for this one.
            Some(i) => {
                column.file.name = place;
                column.file.description.clear();
                columns[i] = column;
            }
            None => {
                if !place.is_empty() && is_free(columns, &place) {
                    column.file.name = place;
                    column.file.description.clear();
                }
                while !is_free(columns, &column.file.name) || !is_fitting(&column.file) {
                    column.file.name.push('_');
                }
                columns.push(column);
            }
        }
    }
}

fn is_free(columns: &[Column], name: &str) -> bool {
    let name = name.to_lowercase();
    !columns.iter().any(|column| column.file.name.to_lowercase() == name)
}

/// Whether a column of a name that has a meaning is one that can have it.
fn is_fitting(column: &FileColumn) -> bool {
    let is_float = matches!(column.element, Element::F32 | Element::F64);
    let n = column.components;
    match column.name.as_str() {
        NORMAL | TANGENT_U | TANGENT_V => n == 3 && is_float,
        NORMAL_FIELD => n == 4 && is_float,
        CLIP => n == 7 && is_float,
        RADIUS | AO => n == 1 && is_float,
        MATERIAL => n == 1,
        COLOR => n == 3 || n == 4,
        _ => true,
    }
}

fn column_of(field: Extra, number: usize) -> Column {
    let name = if field.name.is_empty() { format!("extra_{number}") } else { field.name };
    let components = u32::try_from(field.components.len()).unwrap_or(1);
    let (element, source) = match field.number.element() {
        Some(element) if !field.is_scaled => {
            let places = field.components.iter().map(|one| one.at).collect();
            (element, Source::Plain { number: field.number, places })
        }
        _ => {
            let (number, components) = (field.number, field.components);
            (Element::F64, Source::Scaled { number, components })
        }
    };
    let description = field.description;
    let file = FileColumn { description, ..FileColumn::new(name, components, element) };
    Column { file, source, is_extra: true }
}

/// Fields with those joined that are components of one column: normals, and what this format writes.
fn joined(mut fields: Vec<Extra>) -> Vec<Extra> {
    let normals = NORMALS.map(|name| {
        let is_one = |field: &Extra| {
            field.name.eq_ignore_ascii_case(name)
                && field.components.len() == 1
                && (field.is_scaled || matches!(field.number, Number::F32 | Number::F64))
        };
        fields.iter().position(is_one)
    });
    if let [Some(x), Some(y), Some(z)] = normals
        && alike(&fields[x], &fields[y])
        && alike(&fields[x], &fields[z])
    {
        let parts = [x, y, z].map(|i| fields[i].components[0]);
        let is_scaled = [x, y, z].iter().any(|&i| fields[i].is_scaled);
        let (number, first) = (fields[x].number, x.min(y).min(z));
        let normal = Extra {
            name: NORMAL.to_owned(),
            description: String::new(),
            number,
            components: parts.to_vec(),
            is_scaled,
        };
        fields[first] = normal;
        let others = [x, y, z].into_iter().filter(|&i| i != first);
        let mut others: Vec<usize> = others.collect();
        others.sort_unstable();
        for i in others.into_iter().rev() {
            fields.remove(i);
        }
    }
    let mut all: Vec<Extra> = Vec::with_capacity(fields.len());
    let mut fields = fields.into_iter().peekable();
    while let Some(mut field) = fields.next() {
        if let (Some((1, n)), Some(name)) =
            (extra::component_of(&field.description), field.name.strip_suffix("_0"))
        {
            let name = name.to_owned();
            let continues = |i: usize, next: &Extra| {
                alike(&field, next)
                    && next.name == format!("{name}_{i}")
                    && extra::component_of(&next.description) == Some((i + 1, n))
            };
            let mut more = Vec::new();
            while let Some(next) = fields.next_if(|next| continues(more.len() + 1, next)) {
                more.extend(next.components);
            }
            field.components.extend(more);
            if field.components.len() == n {
                (field.name, field.description) = (name, String::new());
            }
        }
        all.push(field);
    }
    all
}

fn alike(one: &Extra, other: &Extra) -> bool {
    one.number == other.number && one.components.len() == 1 && other.components.len() == 1
}
