//! Names of columns, made of what files call their fields.

use crate::columns::{
    AO, CLIP, COLOR, Element, MATERIAL, NORMAL, NORMAL_FIELD, POSITION, RADIUS, TANGENT_U,
    TANGENT_V,
};
use std::collections::HashSet;

/// Most bytes of a name.
const MOST_BYTES: usize = 200;

/// The names of a cloud's columns, each once whatever its case. Came while ABI 3.11 was current.
#[derive(Clone, Debug, Default)]
pub struct ColumnNames(HashSet<String>);

impl ColumnNames {
    /// A name like the field's that no column has yet, and that a column of such values can have: `_` is added where
    /// it is taken, or means something that is of other values. Control characters become `_`, and long names are cut.
    pub fn add(&mut self, field: &str, components: u32, element: Element) -> String {
        let printable = field.chars().map(|c| if c.is_control() { '_' } else { c });
        let mut name = shortened(printable.collect());
        while name.is_empty() || !is_possible(&name.to_lowercase(), components, element) {
            name.push('_');
        }
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

/// Whether a column of this name can have such values.
fn is_possible(name: &str, components: u32, element: Element) -> bool {
    let is_float = matches!(element, Element::F32 | Element::F64);
    match name {
        POSITION | NORMAL | TANGENT_U | TANGENT_V => components == 3 && is_float,
        NORMAL_FIELD => components == 4 && is_float,
        CLIP => components == 7 && is_float,
        COLOR => {
            matches!(components, 3 | 4)
                && matches!(element, Element::U8 | Element::U16 | Element::F32)
        }
        RADIUS | AO => components == 1 && is_float,
        MATERIAL => components == 1,
        _ => true,
    }
}

fn shortened(mut name: String) -> String {
    let end = (0..=MOST_BYTES.min(name.len())).rev().find(|&end| name.is_char_boundary(end));
    name.truncate(end.unwrap_or(0));
    name
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_single_and_possible() {
        let mut names = ColumnNames::default();
        assert_eq!(names.add("label", 1, Element::U32), "label");
        assert_eq!(names.add("Label", 1, Element::U32), "Label_");
        assert_eq!(names.add("label", 1, Element::U32), "label__");
        assert_eq!(names.add("Color", 1, Element::F32), "Color_");
        assert_eq!(names.add("radius", 1, Element::F32), "radius");
        assert_eq!(names.add("position", 1, Element::F32), "position_");
        assert_eq!(names.add("color", 3, Element::I32), "color__");
        assert_eq!(names.add("two\nlines", 1, Element::I8), "two_lines");
        assert_eq!(names.add("", 1, Element::I8), "_");
        assert_eq!(names.add("Ä", 1, Element::I8), "Ä");
        assert_eq!(names.add("ä", 1, Element::I8), "ä_");
        let many = (0..5000).map(|_| names.add("a", 1, Element::I8));
        assert!(many.last().unwrap().len() < 8);
        assert!(names.add(&"ä".repeat(300), 1, Element::I8).len() <= 200);
    }
}
