//! Units of a coordinate system in well-known text, of its first and of its second version.

/// Deepest nesting that is read.
const DEEPEST: usize = 48;

/// Metres of the units of a coordinate system; 0 where unknown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Units {
    /// Of the plane.
    pub(super) plane: f64,
    /// Of heights.
    pub(super) height: f64,
}

/// A keyword with what is in its brackets.
#[derive(Debug, Default)]
struct Node {
    keyword: String,
    values: Vec<String>,
    children: Vec<Self>,
}

/// Systems whose coordinates are lengths.
const PLANE: &[&str] =
    &["PROJCS", "PROJCRS", "PROJECTEDCRS", "GEOCCS", "LOCAL_CS", "ENGCRS", "ENGINEERINGCRS"];
/// Systems of heights.
const HEIGHT: &[&str] = &["VERT_CS", "VERTCRS", "VERTICALCRS"];
/// Other systems.
const OTHERS: &[&str] = &[
    "COMPD_CS",
    "COMPOUNDCRS",
    "GEOGCS",
    "GEOGCRS",
    "GEOGRAPHICCRS",
    "GEODCRS",
    "GEODETICCRS",
    "BOUNDCRS",
];

/// Whether a text is well-known text of a coordinate system.
pub(crate) fn is_wkt(text: &str) -> bool {
    let keyword = text.trim_start().split(['[', '(']).next().unwrap_or_default();
    let keyword = keyword.trim().to_ascii_uppercase();
    keyword.len() < text.trim().len()
        && [PLANE, HEIGHT, OTHERS].iter().any(|known| known.contains(&keyword.as_str()))
}

/// The units that a text says.
pub(super) fn units(text: &str) -> Units {
    let root = parse(text);
    let of = |keywords| root.find(keywords).and_then(Node::unit).unwrap_or(0.0);
    Units { plane: of(PLANE), height: of(HEIGHT) }
}

impl Node {
    /// The first of these keywords, from the outside in.
    fn find(&self, keywords: &[&str]) -> Option<&Self> {
        let is_one = |node: &&Self| keywords.contains(&node.keyword.as_str());
        let here = self.children.iter().find(is_one);
        here.or_else(|| self.children.iter().find_map(|child| child.find(keywords)))
    }

    /// Metres of the unit of lengths of a system: its own, or that of its axes.
    fn unit(&self) -> Option<f64> {
        let is_unit = |node: &&Self| matches!(node.keyword.as_str(), "UNIT" | "LENGTHUNIT");
        let axes = self.children.iter().filter(|node| node.keyword == "AXIS");
        let unit = self.children.iter().find(is_unit);
        let unit = unit.or_else(|| axes.flat_map(|axis| &axis.children).find(is_unit))?;
        let metres = unit.values.get(1)?.parse::<f64>().ok()?;
        (metres.is_finite() && metres > 0.0).then_some(metres)
    }
}

/// The keywords of a text, in a node without a keyword. What is not closed ends with the text.
fn parse(text: &str) -> Node {
    let mut open = vec![Node::default()];
    let mut word = String::new();
    let mut letters = text.chars().peekable();
    let finish = |word: &mut String, open: &mut Vec<Node>| {
        let value = std::mem::take(word);
        if let (false, Some(node)) = (value.trim().is_empty(), open.last_mut()) {
            node.values.push(value.trim().to_owned());
        }
    };
    while let Some(letter) = letters.next() {
        match letter {
            '"' => {
                let mut quoted = String::new();
                while let Some(letter) = letters.next() {
                    // Two quotation marks are one that belongs to the text.
                    if letter == '"' && letters.next_if_eq(&'"').is_none() {
                        break;
                    }
                    quoted.push(letter);
                }
                if let Some(node) = open.last_mut() {
                    node.values.push(quoted);
                }
            }
            '[' | '(' => {
                let keyword = std::mem::take(&mut word).trim().to_ascii_uppercase();
                open.push(Node { keyword, ..Node::default() });
                if open.len() > DEEPEST {
                    break;
                }
            }
            ']' | ')' => {
                finish(&mut word, &mut open);
                close(&mut open);
            }
            ',' => finish(&mut word, &mut open),
            letter => word.push(letter),
        }
    }
    while open.len() > 1 {
        close(&mut open);
    }
    open.pop().unwrap_or_default()
}

/// Puts the innermost node into the one around it.
fn close(open: &mut Vec<Node>) {
    if open.len() > 1
        && let Some(node) = open.pop()
        && let Some(around) = open.last_mut()
    {
        around.children.push(node);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_is_that_of_the_plane_not_of_angles_or_heights() {
        let first = r#"COMPD_CS["a, ""b"" [c]",PROJCS["x",GEOGCS["g",UNIT["degree",0.0174532925199433]],
            PROJECTION["p"],PARAMETER["false_easting",1312335.958],UNIT["foot",0.3048,AUTHORITY["EPSG","9002"]]],
            VERT_CS["h",VERT_DATUM["d",2005],UNIT["metre",1.0]]]"#;
        assert_eq!(units(first), Units { plane: 0.3048, height: 1.0 });
        let second = r#"PROJCRS["x",BASEGEOGCRS["g",DATUM["d",ELLIPSOID["e",6378137,298.25,LENGTHUNIT["metre",1]]]],
            CONVERSION["u",PARAMETER["f",500000,LENGTHUNIT["metre",1]]],CS[Cartesian,2],
            AXIS["(E)",east,LENGTHUNIT["US survey foot",0.304800609601219]]]"#;
        assert_eq!(units(second), Units { plane: 0.304800609601219, height: 0.0 });
        assert_eq!(units(r#"GEOGCS["g",UNIT["degree",0.0174532925199433]]"#), Units::default());
        assert!(is_wkt(first) && is_wkt(second) && is_wkt("geogcs [\"g\"]"));
        assert!(!is_wkt("EPSG:2992") && !is_wkt("PROJCS") && !is_wkt(""));
    }

    #[test]
    fn texts_that_are_broken_say_nothing_and_end() {
        for text in
            ["", "[", "]]]]", "PROJCS[\"", "PROJCS[UNIT[\"m\"", "PROJCS[UNIT[m,nan]]", "((((,,,)"]
        {
            assert_eq!(units(text), Units::default(), "{text}");
        }
        assert_eq!(units(&"PROJCS[".repeat(100_000)), Units::default());
        assert_eq!(units("PROJCS[UNIT[m,2"), Units { plane: 0.0, height: 0.0 });
    }
}
