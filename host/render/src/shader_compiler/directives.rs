//! `enable` and its like at the head of a text.
//!
//! The composer takes such lines only where nothing else stands on them and nothing before them, and naga has
//! subgroups without being told: what a text enables is taken out of it here and given back in a line of its own.

use crate::shader_compiler::compose::ShaderError;
use crate::shader_compiler::tokens::{Token, tokens};
use crate::shader_features::ShaderFeature;
use std::borrow::Cow;

/// A text as the composer takes it.
pub(super) struct Headed<'a> {
    pub(super) text: Cow<'a, str>,
    /// Whether a line was put before it.
    pub(super) shifted: bool,
}

/// The text without what it enables, and with what naga wants enabled of what the pass needs.
///
/// # Errors
/// Where it enables what is not known or what the pass does not need, or another directive does not stand on a line of
/// its own.
pub(super) fn headed<'a>(
    text: &'a str,
    needs: &[ShaderFeature],
) -> Result<Headed<'a>, ShaderError> {
    let mut without = Cow::Borrowed(text);
    for (begin, end) in directives(text) {
        let words = &text[begin..end];
        let line = text[..begin].matches('\n').count() + 1;
        let refuse = |what: String| Err(ShaderError::new(format!("line {line}: {what}")));
        let Some(names) = words.strip_prefix("enable") else {
            let before = text[..begin].rsplit('\n').next().unwrap_or_default();
            let behind = text[end..].split('\n').next().unwrap_or_default().trim();
            let alone = before.trim().is_empty() && (behind.is_empty() || behind.starts_with("//"));
            if !alone {
                return refuse(format!("`{words}` must stand on a line of its own"));
            }
            continue;
        };
        for name in names.trim_end_matches(';').split(',').map(str::trim) {
            let known = ShaderFeature::ALL.iter().find(|feature| feature.enable == Some(name));
            match known {
                Some(feature) if needs.contains(feature) => {}
                Some(feature) => {
                    let word = feature.word;
                    return refuse(format!(
                        "`enable {name};` stands in a pass that does not say that it needs `{word}`; add \
                         `.needs(\"{word}\")`"
                    ));
                }
                None => {
                    let known = ShaderFeature::ALL.iter().filter_map(|feature| feature.enable);
                    let known = known.map(|word| format!("`{word}`")).collect::<Vec<_>>();
                    let name = name.escape_debug();
                    return refuse(format!("`{name}` cannot be enabled; {} can", known.join(", ")));
                }
            }
        }
        let blank = |c: char| if c == '\n' { c } else { ' ' };
        let range = begin..end;
        // Of as many bytes, so that the places of what follows stay.
        let blank: String = words.chars().flat_map(|c| vec![blank(c); c.len_utf8()]).collect();
        without.to_mut().replace_range(range, &blank);
    }
    if needs.iter().any(|feature| feature.enable == Some("f16")) {
        let text = Cow::Owned(format!("enable f16;\n{without}"));
        return Ok(Headed { text, shifted: true });
    }
    Ok(Headed { text: without, shifted: false })
}

/// Where directives of WGSL begin and end, before all else but lines of the composer.
fn directives(text: &str) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut all = tokens(text);
    while let Some((begin, token)) = all.next() {
        match token {
            Token::Directive(_) => {}
            Token::Word("enable" | "requires" | "diagnostic") => {
                let end = all.by_ref().find(|(_, token)| *token == Token::Mark(';'));
                let Some((end, _)) = end else { break };
                found.push((begin, end + 1));
            }
            _ => break,
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn needs(words: &[&str]) -> Vec<ShaderFeature> {
        words.iter().filter_map(|word| ShaderFeature::of_word(word)).collect()
    }

    fn refused(text: &str, words: &[&str]) -> String {
        headed(text, &needs(words)).err().map(|error| error.message).unwrap_or_default()
    }

    #[test]
    fn what_is_enabled_stands_in_a_line_of_its_own() {
        let headed = |text, words: &[&str]| {
            let headed = headed(text, &needs(words)).unwrap();
            (headed.text.into_owned(), headed.shifted)
        };
        let plain = "// é\n#import a\nfn enable() {}";
        assert_eq!(headed(plain, &[]), (plain.to_owned(), false));
        let (text, shifted) = headed("#import a\nenable f16; var x: f16;", &["f16"]);
        assert_eq!(
            (text.as_str(), shifted),
            ("enable f16;\n#import a\n            var x: f16;", true)
        );
        let (text, shifted) = headed("enable subgroups;\nfn f() {}", &["subgroups"]);
        assert_eq!((text.trim_start(), shifted), ("fn f() {}", false));
        let own = "diagnostic(off, derivative_uniformity); // why\nfn f() {}";
        assert_eq!(headed(own, &[]), (own.to_owned(), false));
    }

    #[test]
    fn what_cannot_be_enabled_is_refused_with_the_reason() {
        let line = refused("\nenable f16; var<private> x: f32;", &[]);
        assert!(
            line.starts_with("line 2: `enable f16;` stands in a pass that does not say"),
            "{line}"
        );
        let line = refused("enable f16, chromatic;", &["f16"]);
        assert!(line.contains("`chromatic` cannot be enabled; `subgroups`, `f16` can"), "{line}");
        let line = refused("diagnostic(off, a); fn f() {}", &[]);
        assert!(line.contains("must stand on a line of its own"), "{line}");
        assert_eq!(refused("enable", &[]), "");
    }
}
