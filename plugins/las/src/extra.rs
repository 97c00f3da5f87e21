//! Extra bytes of point records, as a record of the file describes them.

use crate::numbers::{Number, f64_at, part, text};

/// Bytes of a description.
pub(crate) const DESCRIPTOR: usize = 192;
/// Longest name and longest description, in bytes.
pub(crate) const LONGEST_NAME: usize = 32;
/// What the description of a field says that has the place of a standard one, which cannot hold the values.
pub(crate) const IN_PLACE_OF: &str = "the column ";
/// Most fields that are read; files have a few.
const MOST_FIELDS: usize = 1000;
/// Most components of bytes that nobody describes.
const MOST_UNDESCRIBED: usize = 1024;

/// A field of the extra bytes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Extra {
    /// The name; may be empty.
    pub(crate) name: String,
    /// What it is, for people.
    pub(crate) description: String,
    /// Type of each component.
    pub(crate) number: Number,
    /// Where the components lie in the record, with what they are multiplied by and what is then added.
    pub(crate) components: Vec<Component>,
    /// Whether components are multiplied and added to.
    pub(crate) is_scaled: bool,
}

/// A component of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Component {
    pub(crate) at: usize,
    pub(crate) scale: f64,
    pub(crate) offset: f64,
}

/// The fields that descriptions name, from byte `start` of records of so many bytes; adds to `warnings` what does
/// not fit. Bytes that are left over make one more field.
pub(crate) fn fields(
    descriptions: &[u8],
    start: usize,
    record_len: usize,
    warnings: &mut Vec<String>,
) -> Vec<Extra> {
    let (mut fields, mut at) = (Vec::new(), start);
    for (i, one) in descriptions.chunks_exact(DESCRIPTOR).take(MOST_FIELDS).enumerate() {
        let Some(field) = field(one, at) else {
            warnings.push(format!(
                "the extra bytes from number {} on are of an unknown type {}",
                i + 1,
                one[2]
            ));
            break;
        };
        let len = field.number.size() * field.components.len();
        if len > record_len.saturating_sub(at) {
            warnings.push(format!(
                "the extra bytes `{}` do not fit into point records of {record_len} bytes",
                field.name
            ));
            break;
        }
        at += len;
        if len > 0 {
            fields.push(field);
        }
    }
    let left = record_len.saturating_sub(at);
    if left > MOST_UNDESCRIBED {
        warnings
            .push(format!("{left} extra bytes of each point have no description and are left out"));
    } else if left > 0 {
        warnings.push(format!(
            "{left} extra bytes of each point have no description; they are the column `extra_bytes`"
        ));
        fields.push(undescribed("extra_bytes".to_owned(), String::new(), at, left));
    }
    fields
}

fn undescribed(name: String, description: String, at: usize, len: usize) -> Extra {
    let components = (at..at + len).map(|at| Component { at, scale: 1.0, offset: 0.0 }).collect();
    Extra { name, description, number: Number::U8, components, is_scaled: false }
}

/// The field of a description; `None` where its type is unknown.
fn field(one: &[u8], start: usize) -> Option<Extra> {
    let (code, options) = (*one.get(2)?, *one.get(3)?);
    let name = text(part(one, 4, LONGEST_NAME));
    let description = text(part(one, 160, LONGEST_NAME));
    if code == 0 {
        return Some(undescribed(name, description, start, usize::from(options)));
    }
    let (number, n) = Number::of_code(code)?;
    let given = |bit: u8, at: usize, i: usize, default: f64| match options & bit {
        0 => default,
        _ => Some(f64_at(one, at + 8 * i)).filter(|value| value.is_finite()).unwrap_or(default),
    };
    let components: Vec<_> = (0..n)
        .map(|i| Component {
            at: start + i * number.size(),
            scale: given(8, 112, i, 1.0),
            offset: given(16, 136, i, 0.0),
        })
        .collect();
    // Many writers set the bits and then change nothing.
    let changes = |one: &Component| one.scale.to_bits() != 1f64.to_bits() || one.offset.abs() > 0.0;
    let is_scaled = components.iter().any(changes);
    Some(Extra { name, description, number, components, is_scaled })
}

/// Which component of how many a description says that a field is: `component 2 of 3`.
pub(crate) fn component_of(description: &str) -> Option<(usize, usize)> {
    let rest = description.strip_prefix("component ")?;
    let (i, n) = rest.split_once(" of ")?;
    let (i, n) = (i.parse::<usize>().ok()?, n.parse::<usize>().ok()?);
    (1 <= i && i <= n && n <= MOST_UNDESCRIBED).then_some((i, n))
}

/// The description of a field of a single number, for a file that is written.
pub(crate) fn descriptor(name: &str, description: &str, code: u8) -> [u8; DESCRIPTOR] {
    let mut one = [0; DESCRIPTOR];
    one[2] = code;
    for (at, text) in [(4, name), (160, description)] {
        let text = shortened(text, LONGEST_NAME).as_bytes();
        one[at..at + text.len()].copy_from_slice(text);
    }
    one
}

/// The beginning of a text that has at most so many bytes.
pub(crate) fn shortened(text: &str, most: usize) -> &str {
    let mut end = text.len().min(most);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    &text[..end]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_follow_one_another_and_end_with_the_record() {
        let mut all = Vec::new();
        all.extend(descriptor("a", "first", 3));
        let mut scaled = descriptor("b", "", 26);
        scaled[3] = 8 | 16;
        for (i, value) in [0.5f64, 1.0, f64::NAN, 7.0, 0.0, 0.0].into_iter().enumerate() {
            scaled[112 + 8 * i..][..8].copy_from_slice(&value.to_le_bytes());
        }
        all.extend(scaled);
        all.extend(descriptor("c", "", 10));
        let mut warnings = Vec::new();
        let found = fields(&all, 20, 20 + 2 + 12 + 5, &mut warnings);
        let names: Vec<_> = found.iter().map(|field| field.name.as_str()).collect();
        assert_eq!(names, ["a", "b", "extra_bytes"]);
        assert_eq!((found[0].number, found[0].components[0].at), (Number::U16, 20));
        assert!(!found[0].is_scaled && found[1].is_scaled);
        let b = &found[1].components;
        assert_eq!((b[0].at, b[0].scale, b[0].offset), (22, 0.5, 7.0));
        assert_eq!((b[2].at, b[2].scale, b[2].offset), (30, 1.0, 0.0));
        assert_eq!(found[2].components.len(), 5);
        assert!(warnings[0].contains("`c` do not fit"), "{warnings:?}");
    }

    #[test]
    fn unknown_types_end_the_list_and_numbers_of_components_are_read_with_care() {
        let mut warnings = Vec::new();
        assert!(fields(&descriptor("x", "", 31), 20, 20, &mut warnings).is_empty());
        assert!(warnings[0].contains("type 31"));
        assert_eq!(component_of("component 2 of 3"), Some((2, 3)));
        for text in ["component 0 of 3", "component 4 of 3", "component 1 of 99999999", "x", ""] {
            assert_eq!(component_of(text), None);
        }
        assert_eq!(shortened("aä", 2), "a");
    }
}
