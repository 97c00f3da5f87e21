//! Which columns the fields of a scan become.

use crate::read::color::ColorScale;
use crate::read::fields::{Field, Kind};
use e57::{PointCloud, RecordName};
use surfelshop_api::columns::{COLOR, Element, POSITION};
use surfelshop_api::format::{FileColumn, INTENSITY, N_RETURNS, RETURN_NUMBER};

/// Row of a point in the grid of its scan, counted from 0.
pub(crate) const ROW_INDEX: &str = "row_index";
/// Column of a point in the grid of its scan, counted from 0.
pub(crate) const COLUMN_INDEX: &str = "column_index";
/// Seconds since the scan began.
pub(crate) const TIME_STAMP: &str = "time_stamp";
/// Prefix of the extension for normals.
pub(crate) const NORMALS: &str = "nor";

/// Most fields of a packet.
const MOST_FIELDS: usize = u16::MAX as usize;

/// Where positions come from.
pub(crate) struct Places {
    pub(crate) cartesian: Option<[usize; 3]>,
    pub(crate) cartesian_state: Option<usize>,
    /// Range, azimuth and elevation.
    pub(crate) spherical: Option<[usize; 3]>,
    pub(crate) spherical_state: Option<usize>,
    pub(crate) element: Element,
}

/// How values of fields become those of a column.
#[derive(Clone, Copy)]
pub(crate) enum Conversion {
    /// As they are.
    Same,
    /// One more: the file counts from 0.
    CountedFromOne,
    /// Colours.
    Color(ColorScale),
}

/// A column but for the positions.
pub(crate) struct Column {
    pub(crate) file: FileColumn,
    /// The field of each component.
    pub(crate) fields: Vec<usize>,
    /// The field that is not 0 where values are invalid.
    pub(crate) invalid: Option<usize>,
    pub(crate) conversion: Conversion,
}

/// The fields of a scan and the columns that they become.
pub(crate) struct Layout {
    pub(crate) fields: Vec<Field>,
    pub(crate) places: Places,
    pub(crate) columns: Vec<Column>,
    /// What is doubtful, for people.
    pub(crate) doubts: Vec<String>,
}

impl Layout {
    /// Whether colours have 16 bits.
    pub(crate) fn has_wide_colors(&self) -> bool {
        self.columns.iter().any(|c| c.file.name == COLOR && c.file.element == Element::U16)
    }

    /// Gives colours 16 bits, as other scans of the file have them.
    pub(crate) fn widen_colors(&mut self) {
        for column in &mut self.columns {
            if let Conversion::Color(scale) = column.conversion {
                column.conversion = Conversion::Color(scale.widened());
                column.file.element = Element::U16;
            }
        }
    }

    /// The layout of a scan with the columns that are wanted.
    ///
    /// # Errors
    /// A line where points have no coordinates, or there are more fields than a packet holds.
    pub(crate) fn new(scan: &PointCloud, wants: impl Fn(&str) -> bool) -> Result<Self, String> {
        let fields: Vec<Field> = scan.prototype.iter().map(Field::new).collect();
        if fields.len() > MOST_FIELDS {
            return Err(format!("expected at most {MOST_FIELDS} fields, found {}", fields.len()));
        }
        let mut taker = Taker { fields: &fields, taken: vec![false; fields.len()] };
        let places = taker.places().ok_or_else(|| {
            let names: Vec<_> = fields.iter().take(20).map(|field| field_name(&field.name)).collect();
            format!(
                "expected the fields cartesianX, Y and Z or sphericalRange, Azimuth and Elevation, found {}",
                names.join(", ")
            )
        })?;
        let mut doubts = Vec::new();
        let mut columns = taker.standard(scan, &mut doubts);
        columns.extend(taker.normals());
        columns.extend(taker.others(&columns));
        let left = taker.left();
        if !left.is_empty() {
            doubts.push(format!("fields that no column is made of: {}", left.join(", ")));
        }
        columns.retain(|column| wants(&column.file.name));
        Ok(Self { fields, places, columns, doubts })
    }

    /// The columns of batches, positions first.
    pub(crate) fn file_columns(&self) -> Vec<FileColumn> {
        let position = FileColumn::new(POSITION, 3, self.places.element);
        std::iter::once(position).chain(self.columns.iter().map(|c| c.file.clone())).collect()
    }

    /// Whether the values of a field are read.
    pub(crate) fn needs(&self, field: usize) -> bool {
        let Places { cartesian, spherical, .. } = self.places;
        let states = [self.places.cartesian_state, self.places.spherical_state];
        cartesian.iter().chain(&spherical).flatten().any(|&needed| needed == field)
            || states.contains(&Some(field))
            || self.columns.iter().any(|c| c.fields.contains(&field) || c.invalid == Some(field))
    }

    /// Bytes of a point in all columns.
    pub(crate) fn point_bytes(&self) -> usize {
        self.file_columns().iter().map(FileColumn::point_bytes).sum()
    }
}

/// The name of a field as files have it.
fn field_name(name: &RecordName) -> String {
    match name {
        RecordName::Unknown { namespace, name } if namespace.is_empty() => name.clone(),
        RecordName::Unknown { namespace, name } => format!("{namespace}:{name}"),
        _ => {
            let mut name = format!("{name:?}");
            name.get_mut(..1).map(str::make_ascii_lowercase);
            name
        }
    }
}

/// The type that holds the values of a field exactly, where one does.
pub(super) fn own_element(field: &Field) -> Element {
    match field.kind {
        Kind::F32 => Element::F32,
        Kind::F64 => Element::F64,
        // As many bits as the fraction of an `f32` has.
        Kind::Steps { .. } if field.bits <= 24 => Element::F32,
        Kind::Steps { .. } => Element::F64,
        Kind::Whole { min, max } => {
            let fits = |low: i64, high: i64| min >= low && max <= high;
            match () {
                () if fits(0, 0xff) => Element::U8,
                () if fits(-0x80, 0x7f) => Element::I8,
                () if fits(0, 0xffff) => Element::U16,
                () if fits(-0x8000, 0x7fff) => Element::I16,
                () if fits(0, 0xffff_ffff) => Element::U32,
                () if fits(-0x8000_0000, 0x7fff_ffff) => Element::I32,
                () => Element::F64,
            }
        }
    }
}

/// Takes fields for columns, each once.
pub(super) struct Taker<'a> {
    pub(super) fields: &'a [Field],
    pub(super) taken: Vec<bool>,
}

impl Taker<'_> {
    /// A field that was not taken yet.
    fn one(&mut self, name: &RecordName) -> Option<usize> {
        let mut places = self.fields.iter().zip(&self.taken);
        let found = places.position(|(field, taken)| !taken && field.name == *name)?;
        self.taken[found] = true;
        Some(found)
    }

    /// Three fields, where all of them are there.
    pub(super) fn three(&mut self, names: &[RecordName; 3]) -> Option<[usize; 3]> {
        let there = |name: &RecordName| self.fields.iter().any(|field| field.name == *name);
        if !names.iter().all(there) {
            return None;
        }
        Some([self.one(&names[0])?, self.one(&names[1])?, self.one(&names[2])?])
    }

    fn places(&mut self) -> Option<Places> {
        use RecordName as N;
        let cartesian = self.three(&[N::CartesianX, N::CartesianY, N::CartesianZ]);
        let cartesian_state = self.one(&N::CartesianInvalidState).filter(|_| cartesian.is_some());
        let spherical =
            self.three(&[N::SphericalRange, N::SphericalAzimuth, N::SphericalElevation]);
        let spherical_state = self.one(&N::SphericalInvalidState).filter(|_| spherical.is_some());
        // Where all cartesian coordinates are valid, the others say the same.
        let spherical = spherical.filter(|_| cartesian.is_none() || cartesian_state.is_some());
        let spherical_state = spherical_state.filter(|_| spherical.is_some());
        let all_f32 = |fields: [usize; 3]| fields.iter().all(|&i| self.fields[i].kind == Kind::F32);
        let element = match (cartesian, spherical) {
            (None, None) => return None,
            (Some(fields), None) if all_f32(fields) => Element::F32,
            _ => Element::F64,
        };
        Some(Places { cartesian, cartesian_state, spherical, spherical_state, element })
    }

    /// The columns of the standard's own fields.
    fn standard(&mut self, scan: &PointCloud, doubts: &mut Vec<String>) -> Vec<Column> {
        use RecordName as N;
        let mut columns = Vec::new();
        if let Some(channels) = self.three(&[N::ColorRed, N::ColorGreen, N::ColorBlue]) {
            let fields = channels.map(|i| &self.fields[i]);
            let (scale, doubt) = ColorScale::new(fields, scan.color_limits.as_ref());
            doubts.extend(doubt);
            columns.push(Column {
                file: FileColumn::new(COLOR, 3, scale.element),
                fields: channels.to_vec(),
                invalid: self.one(&N::IsColorInvalid),
                conversion: Conversion::Color(scale),
            });
        }
        if let Some(field) = self.one(&N::Intensity) {
            let element = match own_element(&self.fields[field]) {
                Element::U8 => Element::U16,
                Element::I8 | Element::I16 => Element::I32,
                element => element,
            };
            let invalid = self.one(&N::IsIntensityInvalid);
            columns.push(Column { invalid, ..scalar(INTENSITY, element, field) });
        }
        for (name, record) in [(ROW_INDEX, N::RowIndex), (COLUMN_INDEX, N::ColumnIndex)] {
            columns.extend(self.one(&record).map(|field| scalar(name, Element::U32, field)));
        }
        if let Some(field) = self.one(&N::ReturnIndex) {
            let element = self.count_element(field, 1);
            let conversion = Conversion::CountedFromOne;
            columns.push(Column { conversion, ..scalar(RETURN_NUMBER, element, field) });
        }
        if let Some(field) = self.one(&N::ReturnCount) {
            columns.push(scalar(N_RETURNS, self.count_element(field, 0), field));
        }
        if let Some(field) = self.one(&N::TimeStamp) {
            let mut column = scalar(TIME_STAMP, Element::F64, field);
            "s".clone_into(&mut column.file.unit);
            columns.push(Column { invalid: self.one(&N::IsTimeStampInvalid), ..column });
        }
        columns
    }

    /// The type of a number of returns.
    fn count_element(&self, field: usize, more: i64) -> Element {
        match self.fields[field].kind {
            Kind::Whole { max, .. } if max <= 0xff - more => Element::U8,
            Kind::Whole { max, .. } if max <= 0xffff - more => Element::U16,
            _ => Element::U32,
        }
    }

    /// The fields that nothing was made of.
    fn left(&self) -> Vec<String> {
        let left = self.fields.iter().zip(&self.taken).filter(|(_, taken)| !**taken);
        left.map(|(field, _)| field_name(&field.name)).take(20).collect()
    }
}

fn scalar(name: &str, element: Element, field: usize) -> Column {
    vector(name, element, vec![field])
}

pub(super) fn vector(name: &str, element: Element, fields: Vec<usize>) -> Column {
    // There are at most as many fields as a u16 counts.
    let file = FileColumn::new(name, fields.len() as u32, element);
    Column { file, fields, invalid: None, conversion: Conversion::Same }
}

#[cfg(test)]
mod tests {
    use super::*;
    use e57::{Record, RecordDataType};

    fn scan(names: &[&str]) -> PointCloud {
        let mut scan = PointCloud::default();
        for name in names {
            let (namespace, own) = name.split_once(':').unwrap_or(("", name));
            let own_name = match *name {
                "x" => RecordName::CartesianX,
                "y" => RecordName::CartesianY,
                "z" => RecordName::CartesianZ,
                "red" => RecordName::ColorRed,
                "row" => RecordName::RowIndex,
                _ => RecordName::Unknown { namespace: namespace.to_owned(), name: own.to_owned() },
            };
            scan.prototype.push(Record { name: own_name, data_type: RecordDataType::F32 });
        }
        scan
    }

    fn names(names: &[&str]) -> Vec<(String, u32)> {
        let layout = Layout::new(&scan(names), |_| true).unwrap();
        let columns = layout.file_columns();
        columns.iter().map(|column| (column.name.clone(), column.components)).collect()
    }

    #[test]
    fn fields_of_extensions_get_names_of_their_own() {
        let found = names(&[
            "x",
            "y",
            "z",
            "row",
            "a:row_index",
            "a:radius",
            "b:radius",
            "a:t-0",
            "a:t-1",
            "a:t-3",
            "a:-0",
            "a:normal",
            "nor:normalX",
            "nor:normalY",
            "nor:normalZ",
        ]);
        let found: Vec<_> = found.iter().map(|(name, n)| (name.as_str(), *n)).collect();
        assert_eq!(
            found,
            [
                ("position", 3),
                ("row_index", 1),
                ("normal", 3),
                ("a_row_index", 1),
                ("radius", 1),
                ("b_radius", 1),
                ("t", 2),
                ("t-3", 1),
                ("-0", 1),
                ("a_normal", 1),
            ]
        );
    }

    #[test]
    fn what_lacks_its_companions_is_left_out_with_a_word() {
        let layout = Layout::new(&scan(&["x", "y", "z", "red"]), |_| true).unwrap();
        assert!(layout.doubts[0].contains("colorRed"), "{:?}", layout.doubts);
        let line = Layout::new(&scan(&["x", "y"]), |_| true).err().unwrap();
        assert!(line.contains("found cartesianX, cartesianY"), "{line}");
    }

    #[test]
    fn only_what_is_wanted_is_read() {
        let layout =
            Layout::new(&scan(&["x", "row", "y", "z", "a:b"]), |name| name == "b").unwrap();
        let needed: Vec<_> = (0..5).filter(|&i| layout.needs(i)).collect();
        assert_eq!((needed, layout.point_bytes()), (vec![0, 2, 3, 4], 16));
    }
}
