//! What fields are called in files, and what columns are called here.

use std::collections::HashSet;
use surfelshop_api::columns::{
    AO, COLOR, Element, MATERIAL, NORMAL, POSITION, RADIUS, TANGENT_U, TANGENT_V,
};
use surfelshop_api::format::{
    CLASSIFICATION, GPS_TIME, INTENSITY, N_RETURNS, POINT_SOURCE, RETURN_NUMBER, SCAN_ANGLE,
};

/// Columns with a meaning, and the fields that PCD files made from LAS files have for them.
const MEANINGS: [(&str, &str); 7] = [
    ("intensity", INTENSITY),
    ("classification", CLASSIFICATION),
    ("returnnumber", RETURN_NUMBER),
    ("numberofreturns", N_RETURNS),
    ("gpstime", GPS_TIME),
    ("pointsourceid", POINT_SOURCE),
    ("scananglerank", SCAN_ANGLE),
];

/// Most bytes of a column's name.
const MAX_NAME: usize = 200;

/// The column with a meaning that a field is, if it is one.
pub(crate) fn meaning(field: &str) -> Option<&'static str> {
    let known = MEANINGS.iter().find(|(name, _)| field.eq_ignore_ascii_case(name));
    known.map(|(_, column)| *column)
}

/// The field that a column is written to.
pub(crate) fn field_of(column: &str) -> &str {
    MEANINGS.iter().find(|(_, name)| *name == column).map_or(column, |(field, _)| field)
}

/// Whether a column of this name can have such values.
fn is_possible(name: &str, components: usize, element: Element) -> bool {
    let floats = matches!(element, Element::F32 | Element::F64);
    match name {
        POSITION | NORMAL | TANGENT_U | TANGENT_V => components == 3 && floats,
        COLOR => {
            matches!(components, 3 | 4)
                && matches!(element, Element::U8 | Element::U16 | Element::F32)
        }
        RADIUS | AO => components == 1 && floats,
        MATERIAL => components == 1,
        _ => true,
    }
}

/// Names that were given, without their case.
#[derive(Default)]
pub(crate) struct Names(HashSet<String>);

impl Names {
    /// A name like the field's that nobody has yet, and that the values can have.
    pub(crate) fn column(&mut self, field: &str, components: usize, element: Element) -> String {
        let printable = field.chars().map(|c| if c.is_control() { '_' } else { c });
        let mut name = shortened(printable.collect());
        while !is_possible(&name.to_lowercase(), components, element) {
            name.push('_');
        }
        self.unused(name)
    }

    /// A name like the column's that nobody has yet, and that can stand in a header.
    pub(crate) fn field(&mut self, column: &str) -> String {
        let unfit = |c: char| c.is_control() || c.is_whitespace();
        let name: String = column.chars().map(|c| if unfit(c) { '_' } else { c }).collect();
        // A lone underscore is padding; a number sign begins a comment in some readers.
        let name = name.replace('#', "_");
        let name = if name.is_empty() || name == "_" { "column".to_owned() } else { name };
        self.unused(shortened(name))
    }

    fn unused(&mut self, mut name: String) -> String {
        let first = name.len();
        while !self.0.insert(name.to_lowercase()) {
            if name.len() < first + 4 {
                name.push('_');
            } else {
                // Numbers, so that thousands of the same name do not become long.
                name.truncate(first);
                name.push_str(&format!("_{}", self.0.len()));
            }
        }
        name
    }
}

fn shortened(mut name: String) -> String {
    let end = (0..=MAX_NAME.min(name.len())).rev().find(|&end| name.is_char_boundary(end));
    name.truncate(end.unwrap_or(0));
    name
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_single_and_possible() {
        let mut names = Names::default();
        assert_eq!(names.column("label", 1, Element::U32), "label");
        assert_eq!(names.column("Label", 1, Element::U32), "Label_");
        assert_eq!(names.column("label", 1, Element::U32), "label__");
        assert_eq!(names.column("Color", 1, Element::F32), "Color_");
        assert_eq!(names.column("radius", 1, Element::F32), "radius");
        assert_eq!(names.column("position", 1, Element::F32), "position_");
        let many = (0..5000).map(|_| names.column("a", 1, Element::I8));
        assert!(many.last().unwrap().len() < 8);
        assert!(names.column(&"ä".repeat(300), 1, Element::I8).len() <= 200);
        let mut fields = Names::default();
        assert_eq!(fields.field("two words"), "two_words");
        assert_eq!(fields.field("two\twords"), "two_words_");
        assert_eq!((fields.field("_"), fields.field("")), ("column".into(), "column_".into()));
        assert_eq!((meaning("GpsTime"), field_of("gps_time")), (Some("gps_time"), "gpstime"));
    }
}
