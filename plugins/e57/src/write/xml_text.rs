//! Texts and names as the XML of a file holds them.

use std::hash::{BuildHasher, RandomState};

/// Names of the standard's own fields: readers take no others for them, whatever extension they are of.
const STANDARD: [&str; 20] = [
    "cartesianX",
    "cartesianY",
    "cartesianZ",
    "cartesianInvalidState",
    "sphericalRange",
    "sphericalAzimuth",
    "sphericalElevation",
    "sphericalInvalidState",
    "intensity",
    "isIntensityInvalid",
    "colorRed",
    "colorGreen",
    "colorBlue",
    "isColorInvalid",
    "rowIndex",
    "columnIndex",
    "returnCount",
    "returnIndex",
    "timeStamp",
    "isTimeStampInvalid",
];

/// A text without what XML cannot hold; `None` where nothing is left.
///
/// The crate `e57` puts texts into CDATA sections as they are, which the end of such a section would end.
pub(crate) fn text(text: &str) -> Option<String> {
    let allowed = |c: &char| matches!(c, '\t' | '\n' | '\r' | ' '..='\u{7e}' | '\u{a0}'..='\u{fffd}' | '\u{10000}'..);
    let text: String = text.chars().filter(allowed).collect();
    let text = text.replace("]]>", "]] >");
    (!text.trim().is_empty()).then_some(text)
}

/// The name of a field for a column's name.
pub(crate) fn field_name(column: &str) -> String {
    let letter = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
    let mut name: String = column.chars().map(letter).collect();
    let first = name.as_bytes().first();
    if !first.is_some_and(|c| c.is_ascii_alphabetic() || *c == b'_')
        || name.to_ascii_lowercase().starts_with("xml")
    {
        name.insert(0, '_');
    }
    if STANDARD.contains(&name.as_str()) {
        name.push('_');
    }
    name
}

/// A new globally unique identifier, of random numbers.
pub(crate) fn guid() -> String {
    // The keys of a `RandomState` are random numbers of the system.
    let [a, b] = [0u8, 1].map(|seed| RandomState::new().hash_one(seed));
    let (version, variant) = (a & 0x0fff | 0x4000, b >> 48 & 0x3fff | 0x8000);
    let (a, b) = (a >> 16, b & 0xffff_ffff_ffff);
    format!("{{{:08X}-{:04X}-{version:04X}-{variant:04X}-{b:012X}}}", a >> 16, a & 0xffff)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_keep_what_xml_holds() {
        assert_eq!(text("a]]>b\u{0}\u{ffff}\u{7}ä\n").as_deref(), Some("a]] >bä\n"));
        assert_eq!((text(" \u{1}"), text("")), (None, None));
    }

    #[test]
    fn names_are_those_of_xml() {
        let names = ["scan_angle", "f dc.0", "0", "", "xmlThing", "intensity", "größe", "-a"];
        let found = names.map(field_name);
        let expected =
            ["scan_angle", "f_dc_0", "_0", "_", "_xmlThing", "intensity_", "gr__e", "_-a"];
        assert_eq!(found, expected);
    }

    #[test]
    fn identifiers_differ() {
        let (a, b) = (guid(), guid());
        assert!(a != b && a.len() == 38 && a.as_bytes()[15] == b'4', "{a} {b}");
    }
}
