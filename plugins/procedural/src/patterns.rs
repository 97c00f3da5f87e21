//! The texts of patterns: those that come with the plugin, and files of the user's.

use crate::settings::{Pattern, PatternSettings};
use surfelshop_api::prelude::*;

/// Most bytes of a file: enough for any pattern, little to read for every picture, and half of what
/// the host compiles.
const MOST_BYTES: u64 = 1 << 17;

/// A pattern's text and what messages call it.
pub(crate) struct Text {
    pub(crate) file: String,
    pub(crate) wgsl: String,
}

/// The text of the pattern that parameters ask for.
///
/// # Errors
/// Where a file of the user's cannot be read, or has no function that is a pattern.
pub(crate) fn text(chosen: &PatternSettings) -> Result<Text> {
    if !chosen.file.is_empty() {
        return own(&chosen.file);
    }
    let (file, wgsl) = match chosen.pattern {
        Pattern::SimpleMarble => ("simple_marble", include_str!("patterns/simple_marble.wgsl")),
        Pattern::VeinedMarble => ("veined_marble", include_str!("patterns/veined_marble.wgsl")),
        Pattern::Plaid => ("plaid", include_str!("patterns/plaid.wgsl")),
        Pattern::Wood => ("wood", include_str!("patterns/wood.wgsl")),
        Pattern::Granite => ("granite", include_str!("patterns/granite.wgsl")),
        Pattern::BrushedMetal => ("brushed_metal", include_str!("patterns/brushed_metal.wgsl")),
        Pattern::Rust => ("rust", include_str!("patterns/rust.wgsl")),
        Pattern::Checker => ("checker", include_str!("patterns/checker.wgsl")),
    };
    Ok(Text { file: format!("{file}.wgsl"), wgsl: wgsl.to_owned() })
}

fn own(path: &str) -> Result<Text> {
    let fail = |what: String| Error::new(format!("pattern {path}: {what}"));
    let about = std::fs::metadata(path).map_err(|error| fail(error.to_string()))?;
    if !about.is_file() || about.len() > MOST_BYTES {
        let found = match (about.is_file(), about.is_dir()) {
            (true, _) => format!("{} bytes", about.len()),
            (_, true) => "a folder".to_owned(),
            _ => "something else".to_owned(),
        };
        return Err(fail(format!("expected a file of at most {MOST_BYTES} bytes, found {found}")));
    }
    let bytes = std::fs::read(path).map_err(|error| fail(error.to_string()))?;
    let wgsl =
        String::from_utf8(bytes).map_err(|_error| fail("it is not UTF-8 text".to_owned()))?;
    // Some editors write a mark in front, which no WGSL has.
    let wgsl = wgsl.trim_start_matches('\u{feff}').to_owned();
    check(&wgsl).map_err(|found| {
        fail(format!("expected `fn look(at: Place, albedo: vec3<f32>) -> Look`, found {found}"))
    })?;
    Ok(Text { file: path.to_owned(), wgsl })
}

/// Whether a text has the function that makes it a pattern; what it has instead. What else is wrong
/// the compiler finds, with its line.
fn check(wgsl: &str) -> std::result::Result<(), String> {
    let plain = without_comments(wgsl).split_whitespace().collect::<Vec<_>>().join(" ");
    let mut rest = plain.as_str();
    let after = loop {
        let Some(at) = rest.find("fn look") else { return Err("no such function".to_owned()) };
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let before = rest[..at].chars().next_back();
        rest = &rest[at + "fn look".len()..];
        if !before.is_some_and(is_word) && !rest.starts_with(is_word) {
            break rest;
        }
    };
    let head = after.split('{').next().unwrap_or_default();
    let found = || format!("`fn look{}`", head.split_whitespace().collect::<Vec<_>>().join(" "));
    let packed: String = head.chars().filter(|c| !c.is_whitespace()).collect();
    let parts = packed.strip_prefix('(').and_then(|rest| rest.split_once(")->"));
    let (arguments, result) = parts.ok_or_else(found)?;
    let types: Vec<&str> = arguments
        .split(',')
        .filter(|argument| !argument.is_empty())
        .map(|argument| argument.split_once(':').map_or("", |(_, kind)| kind))
        .collect();
    // With its module's name before it a type is the same.
    let is = |kind: &str, name: &str| kind.rsplit("::").next() == Some(name);
    let fits = match types[..] {
        [place, albedo] => {
            let is_color = albedo == "vec3<f32>" || albedo == "vec3f";
            // A path of types leaves one colon of its separators at the split above.
            is(place.trim_start_matches(':'), "Place") && is_color && is(result, "Look")
        }
        _ => false,
    };
    if fits { Ok(()) } else { Err(found()) }
}

/// A text with spaces instead of its comments.
fn without_comments(wgsl: &str) -> String {
    let mut plain = String::with_capacity(wgsl.len());
    let mut rest = wgsl;
    let mut depth = 0;
    while let Some(c) = rest.chars().next() {
        let n = if depth == 0 && rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            depth += 1;
            2
        } else if depth > 0 && rest.starts_with("*/") {
            depth -= 1;
            plain.extend((depth == 0).then_some(' '));
            2
        } else {
            plain.extend((depth == 0).then_some(c));
            c.len_utf8()
        };
        rest = &rest[n..];
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::params::{ParamType as _, Value};

    const GOOD: &str = "fn look(at: Place, albedo: vec3<f32>) -> Look { return Look(); }";

    #[test]
    fn a_pattern_is_a_function_of_that_kind() {
        assert_eq!(check(GOOD), Ok(()));
        assert_eq!(
            check(
                "/* fn look() */ fn  x() {}\nfn look(\n  p : noise::Place,\n c: vec3f,\n)\n->  Look\n{"
            ),
            Ok(())
        );
        assert_eq!(check(&format!("fn looking() {{}} {GOOD}")), Ok(()));
    }

    #[test]
    fn what_is_no_pattern_is_said_to_be_what_it_is() {
        assert_eq!(check(""), Err("no such function".to_owned()));
        assert_eq!(check("// fn look(at: Place)"), Err("no such function".to_owned()));
        assert_eq!(check("fn look() {"), Err("`fn look()`".to_owned()));
        let found = check("fn look(at: vec3<f32>,  albedo: vec3<f32>) -> Look {");
        assert_eq!(found, Err("`fn look(at: vec3<f32>, albedo: vec3<f32>) -> Look`".to_owned()));
        assert!(check("fn look(at: Place, albedo: vec3<f32>) -> vec3<f32> {").is_err());
        assert!(check("fn look(at: Place, albedo: vec3<f32>, more: f32) -> Look {").is_err());
        assert!(check("fn look").is_err());
    }

    #[test]
    fn comments_of_any_kind_are_left_out() {
        assert_eq!(without_comments("a/* b /* c */ d */e// f\ng/"), "a e\ng/");
        assert_eq!(without_comments("é//"), "é");
        // Letters of several bytes anywhere, also behind what begins no comment.
        assert_eq!(without_comments("/* Grüne Adern */größe /ü*é"), " größe /ü*é");
        assert_eq!(check(&format!("// ä\n/* ü */ const größe = 1.0; {GOOD}")), Ok(()));
    }

    #[test]
    fn all_that_come_along_are_patterns() {
        for id in [
            "simple-marble",
            "veined-marble",
            "plaid",
            "wood",
            "granite",
            "brushed-metal",
            "rust",
            "checker",
        ] {
            let pattern = Value::Text(id.to_owned());
            let pattern = Pattern::from_value(&pattern).unwrap();
            let chosen = PatternSettings { pattern, ..crate::tests::pattern_settings() };
            assert_eq!(check(&text(&chosen).unwrap().wgsl), Ok(()), "{id}");
        }
    }
}
