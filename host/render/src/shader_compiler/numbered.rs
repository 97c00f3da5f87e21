//! Gives the resources of a module binding numbers, which the composer wants there and which are
//! given anew in the whole.

use crate::shader_compiler::tokens::comment;

/// Numbers of host modules are below this, and each module of a text has so many of its own.
const NUMBERS: usize = 64;

/// The text with a binding in front of every resource that has none, on the line where it stands;
/// `module` counts the modules of a text.
pub(super) fn numbered(wgsl: &str, module: usize) -> String {
    let mut text = String::with_capacity(wgsl.len() + 256);
    let mut number = NUMBERS * (module + 1);
    // Braces that are open, the last character but spaces, and whether it ended a word.
    let (mut depth, mut last, mut in_word) = (0usize, ' ', false);
    let mut rest = wgsl;
    while let Some(c) = rest.chars().next() {
        let skipped = comment(rest);
        if skipped > 0 {
            text.push_str(&rest[..skipped]);
            rest = &rest[skipped..];
            in_word = false;
            continue;
        }
        let is_resource = depth == 0 && !in_word && last != ')' && declares_resource(rest);
        if is_resource {
            text.push_str(&format!("@group(0) @binding({number}) "));
            number += 1;
        }
        match c {
            '{' => depth += 1,
            '}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if !c.is_whitespace() {
            last = c;
        }
        in_word = c.is_ascii_alphanumeric() || c == '_';
        text.push(c);
        rest = &rest[c.len_utf8()..];
    }
    text
}

/// The first member of a structure whose name ends in a digit: the composer writes those otherwise
/// than the author for others to import.
pub(super) fn member_with_digit(wgsl: &str) -> Option<String> {
    let (mut plain, mut rest) = (String::with_capacity(wgsl.len()), wgsl);
    while let Some(c) = rest.chars().next() {
        let skipped = comment(rest);
        if skipped == 0 {
            plain.push(c);
        }
        rest = &rest[skipped.max(if skipped == 0 { c.len_utf8() } else { 0 })..];
    }
    let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut starts = plain.match_indices("struct ").filter(|(at, _)| {
        let before = plain[..*at].chars().next_back();
        !before.is_some_and(word)
    });
    starts.find_map(|(at, keyword)| {
        let text = &plain[at + keyword.len()..];
        let members = text.split_once('{')?.1.split_once('}')?.0;
        let names = members.split(':').map(|before| before.trim_end().rsplit(|c| !word(c)).next());
        let mut names = names.flatten().take(members.matches(':').count());
        names.find(|name| name.ends_with(|c: char| c.is_ascii_digit())).map(str::to_owned)
    })
}

/// Whether a text begins with the declaration of a uniform, a storage buffer, a texture or a
/// sampler.
fn declares_resource(text: &str) -> bool {
    let Some(rest) = text.strip_prefix("var") else { return false };
    match rest.trim_start().strip_prefix('<') {
        Some(space) => {
            let space = space.trim_start();
            space.starts_with("uniform") || space.starts_with("storage")
        }
        None => rest.starts_with(char::is_whitespace),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resources_without_a_number_get_one() {
        let text = "var<uniform> a: A;\nvar t: texture_2d<f32>;\nvar <storage, read> b: B;";
        assert_eq!(
            numbered(text, 0),
            "@group(0) @binding(64) var<uniform> a: A;\n@group(0) @binding(65) var t: \
             texture_2d<f32>;\n@group(0) @binding(66) var <storage, read> b: B;"
        );
        assert!(numbered(text, 2).starts_with("@group(0) @binding(192) "));
    }

    #[test]
    fn members_that_end_in_a_digit_are_found() {
        let found = |text| member_with_digit(text);
        assert_eq!(found("struct A { a: f32, b_1: vec3<f32> }"), Some("b_1".to_owned()));
        assert_eq!(found("struct A { // x1: f32\n a: f32 }\nfn f() { let a1: f32 = 1.0; }"), None);
        assert_eq!(found("struct A { a: vec3<f32>, @size(16) f0 : f32, }"), Some("f0".to_owned()));
        assert_eq!(found("struct A"), None);
        assert_eq!(found("fn construct () { let a1: f32 = 1.0; }"), None);
    }

    #[test]
    fn everything_else_stays() {
        for text in [
            "@group(0) @binding(1) var<uniform> a: A;",
            "fn f() { var x = 1.0; { var y: f32; } }",
            "var<private> p: f32; var<workgroup> w: f32;",
            "// var<uniform> a: A;\n/* var t: x; /* { */ */",
            "const variable = 1.0; fn my_var () {}",
            "é /* é",
        ] {
            assert_eq!(numbered(text, 0), text);
        }
    }
}
