//! What fields are called in files, and what columns are called here.

use std::collections::HashSet;
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

/// Names of fields that were given, without their case.
#[derive(Default)]
pub(crate) struct Names(HashSet<String>);

impl Names {
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
    fn fields_are_single_and_can_stand_in_a_header() {
        let mut fields = Names::default();
        let many = (0..5000).map(|_| fields.field("a"));
        assert!(many.last().unwrap().len() < 8);
        assert!(fields.field(&"ä".repeat(300)).len() <= 200);
        assert_eq!(fields.field("two words"), "two_words");
        assert_eq!(fields.field("two\twords"), "two_words_");
        assert_eq!((fields.field("_"), fields.field("")), ("column".into(), "column_".into()));
        assert_eq!((meaning("GpsTime"), field_of("gps_time")), (Some("gps_time"), "gpstime"));
    }
}
