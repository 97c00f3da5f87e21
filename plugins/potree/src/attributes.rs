//! The attributes of points as columns.

use crate::metadata::{Attribute, Encoding, INSTEAD, Metadata};
use surfelshop_api::columns::{COLOR, Element, NORMAL, POSITION};
use surfelshop_api::format::{
    CLASSIFICATION, ColumnNames, FileColumn, GPS_TIME, INTENSITY, N_RETURNS, POINT_SOURCE,
    RETURN_NUMBER, SCAN_ANGLE,
};
use surfelshop_api::{Error, Result};

/// Degrees of a step of the attribute `scan angle`.
///
/// Source: ASPRS, "LAS Specification 1.4 - R15", 2019, point formats 6 to 10.
const ANGLE_STEP: f64 = 0.006;

/// Most components of a column.
const MOST_COMPONENTS: u64 = 1024;

/// Type of an element in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Number {
    /// The type of this name, which has so many bytes.
    fn of_name(name: &str, size: u64) -> Option<Self> {
        let (number, expected) = match name {
            "int8" => (Self::I8, 1),
            "uint8" => (Self::U8, 1),
            "int16" => (Self::I16, 2),
            "uint16" => (Self::U16, 2),
            "int32" => (Self::I32, 4),
            "uint32" => (Self::U32, 4),
            "int64" => (Self::I64, 8),
            "uint64" => (Self::U64, 8),
            "float" => (Self::F32, 4),
            "double" => (Self::F64, 8),
            _ => return None,
        };
        (size == expected).then_some(number)
    }

    /// The type of columns with such elements; whole numbers of 64 bits become f64.
    pub(crate) fn element(self) -> Element {
        match self {
            Self::I8 => Element::I8,
            Self::U8 => Element::U8,
            Self::I16 => Element::I16,
            Self::U16 => Element::U16,
            Self::I32 => Element::I32,
            Self::U32 => Element::U32,
            Self::F32 => Element::F32,
            Self::I64 | Self::U64 | Self::F64 => Element::F64,
        }
    }
}

/// A component of a column: where it is, and what it is multiplied by before something is added.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Component {
    /// Bytes of a point before those of its attribute, bytes of that, and before the component in it.
    pub(crate) before: usize,
    pub(crate) size: usize,
    pub(crate) within: usize,
    /// Its first bit, where bits are dealt in turn.
    pub(crate) bit: usize,
    pub(crate) scale: f64,
    pub(crate) offset: f64,
}

impl Component {
    pub(crate) fn is_scaled(&self) -> bool {
        self.scale.to_bits() != 1f64.to_bits() || self.offset.abs() > 0.0
    }
}

/// How the values of a column are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Storage {
    /// Numbers of this type.
    Numbers(Number),
    /// Three whole numbers of 32 bits whose bits are dealt in turn: 16 bytes, the upper halves before the lower ones.
    DealtPlaces,
    /// Three whole numbers of 16 bits whose bits are dealt in turn: 8 bytes.
    DealtColors,
}

/// A column, and where it comes from.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Column {
    pub(crate) file: FileColumn,
    pub(crate) storage: Storage,
    pub(crate) components: Vec<Component>,
}

/// The columns of an octree.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    /// Bytes of a point as they are stored, or before they are compressed.
    pub(crate) point_bytes: usize,
    pub(crate) encoding: Encoding,
    /// Those that are wanted; the first is the position.
    pub(crate) columns: Vec<Column>,
}

/// The fields that LAS files keep normals in.
const NORMALS: [&str; 3] = ["NormalX", "NormalY", "NormalZ"];

impl Layout {
    /// The columns of these attributes, without those that nobody wants; adds to `warnings` what is left out.
    ///
    /// # Errors
    /// Where there is no position.
    pub(crate) fn new(
        metadata: &Metadata,
        wants: impl Fn(&str) -> bool,
        warnings: &mut Vec<String>,
    ) -> Result<Self> {
        let encoding = metadata.encoding()?;
        let is_packed = encoding == Encoding::Brotli;
        let mut columns: Vec<Column> = Vec::with_capacity(metadata.attributes.len());
        let mut before = 0;
        for attribute in &metadata.attributes {
            let (size, storage) = match attribute.name.as_str() {
                // By their names, whatever they hold.
                "position" if is_packed => (16, Some(Storage::DealtPlaces)),
                "rgb" if is_packed => (8, Some(Storage::DealtColors)),
                _ => {
                    let number = Number::of_name(&attribute.kind, attribute.element_size);
                    (attribute.size as usize, number.map(Storage::Numbers))
                }
            };
            match storage.filter(|_| attribute.num_elements <= MOST_COMPONENTS) {
                Some(storage) => columns.push(column(attribute, storage, (before, size), metadata)),
                None => warnings.push(format!(
                    "the attribute `{}` of {} numbers of the type `{}` with {} bytes is left out",
                    attribute.name.escape_debug(),
                    attribute.num_elements,
                    attribute.kind.escape_debug(),
                    attribute.element_size
                )),
            }
            before += size;
        }
        join_normals(&mut columns);
        let mut names = ColumnNames::default();
        for Column { file, .. } in &mut columns {
            file.name = names.add(&file.name, file.components, file.element);
        }
        let Some(place) = columns.iter().position(|column| column.file.name == POSITION) else {
            return Err(Error::new(format!(
                "expected an attribute `position` of three numbers, found none; {INSTEAD}"
            )));
        };
        columns.swap(0, place);
        columns.retain(|column| column.file.name == POSITION || wants(&column.file.name));
        Ok(Self { point_bytes: before, encoding, columns })
    }

    /// Bytes of a point's values as columns.
    pub(crate) fn column_bytes(&self) -> usize {
        self.columns.iter().map(|column| column.file.point_bytes()).sum()
    }
}

/// What an attribute is called here.
fn name_of(attribute: &Attribute) -> &str {
    match attribute.name.to_ascii_lowercase().as_str() {
        "position" => POSITION,
        "rgb" | "rgba" => COLOR,
        "intensity" => INTENSITY,
        "return number" => RETURN_NUMBER,
        "number of returns" => N_RETURNS,
        "classification" => CLASSIFICATION,
        "classification flags" => "class_flags",
        "scan angle rank" | "scan angle" => SCAN_ANGLE,
        "user data" => "user_data",
        "point source id" => POINT_SOURCE,
        "gps-time" => GPS_TIME,
        "normal" => NORMAL,
        _ => &attribute.name,
    }
}

/// The column of an attribute that is stored like this, with so many bytes of a point before its own.
fn column(
    attribute: &Attribute,
    mut storage: Storage,
    (before, size): (usize, usize),
    metadata: &Metadata,
) -> Column {
    let Attribute { num_elements, element_size, scale, offset, .. } = attribute;
    let name = name_of(attribute);
    let is_place =
        name == POSITION && matches!(storage, Storage::DealtPlaces | Storage::Numbers(Number::I32));
    // Whole coordinates are those of the octree.
    let (scale, offset) = match is_place {
        true => (&metadata.scale[..], &metadata.offset[..]),
        false => (&scale[..], &offset[..]),
    };
    let n = if is_packed(storage) { 3 } else { *num_elements };
    let given = |values: &[f64], i: usize, default: f64| {
        values.get(i).copied().filter(|value| value.is_finite()).unwrap_or(default)
    };
    let components = (0..n as usize).map(|i| Component {
        before,
        size,
        within: if is_packed(storage) { 0 } else { i * *element_size as usize },
        bit: i,
        scale: given(scale, i, 1.0),
        offset: given(offset, i, 0.0),
    });
    let mut components: Vec<Component> = components.collect();
    if name == SCAN_ANGLE && n == 1 {
        match storage {
            // Said to have no sign, and has one.
            Storage::Numbers(Number::U8) => storage = Storage::Numbers(Number::I8),
            Storage::Numbers(Number::I16) => components[0].scale *= ANGLE_STEP,
            _ => {}
        }
    }
    let is_scaled = components.iter().any(Component::is_scaled);
    let element = match (storage, is_scaled) {
        // As LAS files of the same points have it.
        _ if name == SCAN_ANGLE => Element::F32,
        _ if is_place => Element::F64,
        (Storage::DealtColors, _) => Element::U16,
        (Storage::Numbers(number), false) => number.element(),
        _ => Element::F64,
    };
    let unit = match name {
        SCAN_ANGLE => "deg",
        GPS_TIME => "s",
        _ => "",
    };
    let file = FileColumn {
        unit: unit.to_owned(),
        description: attribute.description.clone(),
        ..FileColumn::new(name, n as u32, element)
    };
    Column { file, storage, components }
}

fn is_packed(storage: Storage) -> bool {
    !matches!(storage, Storage::Numbers(_))
}

/// Makes one column of the three that LAS files keep normals in, where they are alike.
fn join_normals(columns: &mut Vec<Column>) {
    let places = NORMALS.map(|name| {
        columns.iter().position(|column| {
            let FileColumn { name: found, components: n, element, .. } = &column.file;
            let is_float = matches!(element, Element::F32 | Element::F64);
            found.eq_ignore_ascii_case(name) && *n == 1 && is_float
        })
    });
    let [Some(x), Some(y), Some(z)] = places else { return };
    let is_like = |i: usize| {
        columns[i].storage == columns[x].storage
            && columns[i].file.element == columns[x].file.element
    };
    if !is_like(y) || !is_like(z) {
        return;
    }
    let components = [x, y, z].iter().flat_map(|&i| columns[i].components.clone()).collect();
    let file = FileColumn::new(NORMAL, 3, columns[x].file.element);
    let joined = Column { file, storage: columns[x].storage, components };
    let mut number = 0;
    columns.retain(|_| {
        number += 1;
        ![x, y, z].contains(&(number - 1))
    });
    columns.push(joined);
}
