//! Which columns the fields of a file become.

use crate::header::{Field, Kind, shown};
use crate::names::meaning;
use surfelshop_api::columns::{COLOR, Element, NORMAL, POSITION};
use surfelshop_api::format::{CloudSink, ColumnNames, FileColumn, GPS_TIME, SCAN_ANGLE};
use surfelshop_api::prelude::{Error, Result};

/// Most components of a column.
const MAX_COMPONENTS: usize = 1024;

/// Where the values of a column come from.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Origin {
    /// These fields, by their place in the header: one for each component, or one that has all.
    Fields(Vec<usize>),
    /// A field of four bytes: blue, green, red and, where it is the fourth component, alpha.
    Packed(usize),
}

/// A column, and where its values come from.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Column {
    pub column: FileColumn,
    pub origin: Origin,
}

/// What a file's points become.
#[derive(Debug, Default)]
pub(crate) struct Layout {
    pub columns: Vec<Column>,
    /// What is doubtful.
    pub warnings: Vec<String>,
}

/// The type of a field's elements as a column has them; `None` where there is none.
pub(crate) fn element(field: &Field) -> Option<Element> {
    Some(match (field.kind, field.size) {
        (Kind::Signed, 1) => Element::I8,
        (Kind::Signed, 2) => Element::I16,
        (Kind::Signed, 4) => Element::I32,
        (Kind::Unsigned, 1) => Element::U8,
        (Kind::Unsigned, 2) => Element::U16,
        (Kind::Unsigned, 4) => Element::U32,
        (Kind::Float, 4) => Element::F32,
        (Kind::Float | Kind::Signed | Kind::Unsigned, 8) => Element::F64,
        _ => return None,
    })
}

/// The fields of a header that are not yet part of a column.
struct Fields<'a> {
    fields: &'a [Field],
    taken: Vec<bool>,
}

impl Fields<'_> {
    /// Where each of these fields of one element stands, the first of its name.
    fn places<const N: usize>(&self, names: [&str; N]) -> Option<[usize; N]> {
        let mut places = [0; N];
        for (place, name) in places.iter_mut().zip(names) {
            *place = self.fields.iter().zip(&self.taken).position(|(field, taken)| {
                let fits = field.count == 1 && element(field).is_some();
                !taken && fits && field.name.eq_ignore_ascii_case(name)
            })?;
        }
        Some(places)
    }

    fn take(&mut self, places: &[usize]) {
        places.iter().for_each(|&place| self.taken[place] = true);
    }

    /// The type that all of them have.
    fn common(&self, places: &[usize]) -> Option<Element> {
        let mut elements = places.iter().map(|&place| element(&self.fields[place]));
        let first = elements.next()??;
        elements.all(|other| other == Some(first)).then_some(first)
    }
}

impl Layout {
    /// Finds the columns of a header that somebody reads.
    ///
    /// # Errors
    /// Where there are no positions.
    pub(crate) fn new(fields: &[Field], clouds: &CloudSink<'_>) -> Result<Self> {
        let mut found = Self::default();
        let mut left = Fields { fields, taken: fields.iter().map(Field::is_padding).collect() };
        let mut names = ColumnNames::default();
        let places = left.places(["x", "y", "z"]).ok_or_else(|| {
            let known: Vec<&str> =
                fields.iter().map(|field| field.name.as_str()).take(20).collect();
            Error::new(format!("expected fields x, y and z, found {}", shown(&known.join(" "))))
        })?;
        found.vector(POSITION, &mut left, &places, Element::F64, &mut names);
        let normals = ["normal_x", "normal_y", "normal_z"];
        if let Some(places) = left.places(normals).or_else(|| left.places(["nx", "ny", "nz"])) {
            found.vector(NORMAL, &mut left, &places, Element::F32, &mut names);
        }
        found.color(&mut left, &mut names);
        for place in 0..fields.len() {
            if !std::mem::replace(&mut left.taken[place], true) {
                found.own(fields, place, &mut names);
            }
        }
        let is_read =
            |column: &Column| column.column.name == POSITION || clouds.wants(&column.column.name);
        found.columns.retain(is_read);
        Ok(found)
    }

    fn push(&mut self, name: String, components: usize, element: Element, origin: Origin) {
        // At most 1024.
        let column = FileColumn::new(name, components as u32, element);
        self.columns.push(Column { column, origin });
    }

    /// Three fields as a column of floats; of `otherwise` where they are not all of the same.
    fn vector(
        &mut self,
        name: &str,
        left: &mut Fields<'_>,
        places: &[usize; 3],
        otherwise: Element,
        names: &mut ColumnNames,
    ) {
        let same = left.common(places);
        let floats = same.filter(|same| matches!(same, Element::F32 | Element::F64));
        let element = floats.unwrap_or(otherwise);
        left.take(places);
        let name = names.add(name, 3, element);
        self.push(name, 3, element, Origin::Fields(places.to_vec()));
    }

    fn color(&mut self, left: &mut Fields<'_>, names: &mut ColumnNames) {
        let four = |place: &usize| left.fields[*place].size == 4;
        let packed = |name: &str| left.places([name]).map(|[place]| place).filter(four);
        let channels = left.places(["red", "green", "blue"]);
        let (components, element, origin, places) = if let Some(place) = packed("rgba") {
            (4, Element::U8, Origin::Packed(place), vec![place])
        } else if let Some(place) = packed("rgb") {
            (3, Element::U8, Origin::Packed(place), vec![place])
        } else if let Some(places) = channels
            && let Some(element @ (Element::U8 | Element::U16)) = left.common(&places)
        {
            (3, element, Origin::Fields(places.to_vec()), places.to_vec())
        } else {
            return;
        };
        left.take(&places);
        let name = names.add(COLOR, components as u32, element);
        self.push(name, components, element, origin);
    }

    /// A field as a column of its own.
    fn own(&mut self, fields: &[Field], place: usize, names: &mut ColumnNames) {
        let field = &fields[place];
        let shown_name = shown(&field.name);
        let Some(own) = element(field).filter(|_| field.count <= MAX_COMPONENTS) else {
            self.warnings.push(format!(
                "field `{shown_name}` of {} x {} bytes has no type that is known, and was left out",
                field.count, field.size
            ));
            return;
        };
        if field.kind != Kind::Float && field.size == 8 {
            self.warnings.push(format!(
                "field `{shown_name}` has whole numbers of 8 bytes, which are rounded beyond 2^53"
            ));
        }
        let known = meaning(&field.name).filter(|_| field.count == 1);
        let element = match known {
            Some(SCAN_ANGLE) => Element::F32,
            Some(GPS_TIME) => Element::F64,
            _ => own,
        };
        let name = names.add(known.unwrap_or(&field.name), field.count as u32, element);
        self.push(name, field.count, element, Origin::Fields(vec![place]));
    }
}
