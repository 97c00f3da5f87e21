//! Names of projects that `surfelshop plugins new` starts.

use anyhow::ensure;

/// Names that Cargo or Rust would not take, or that would be taken for others.
const TAKEN: [&str; 68] = [
    "abstract",
    "alloc",
    "as",
    "async",
    "aux",
    "await",
    "become",
    "box",
    "break",
    "build",
    "con",
    "const",
    "continue",
    "core",
    "crate",
    "deps",
    "do",
    "dyn",
    "else",
    "enum",
    "examples",
    "extern",
    "false",
    "final",
    "fn",
    "for",
    "gen",
    "glam",
    "if",
    "impl",
    "in",
    "incremental",
    "let",
    "loop",
    "macro",
    "match",
    "mod",
    "move",
    "mut",
    "nul",
    "override",
    "priv",
    "prn",
    "proc-macro",
    "pub",
    "ref",
    "return",
    "self",
    "serde",
    "static",
    "std",
    "struct",
    "super",
    "surfelshop-api",
    "surfelshop-geometry",
    "test",
    "trait",
    "true",
    "try",
    "type",
    "typeof",
    "unsafe",
    "unsized",
    "use",
    "virtual",
    "where",
    "while",
    "yield",
];

/// Refuses names that Cargo, Rust or a command line would not take.
pub(super) fn check_name(name: &str) -> anyhow::Result<()> {
    let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    let sound = name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(allowed)
        && !name.ends_with('-')
        && !name.contains("--")
        && name.len() <= 64;
    ensure!(sound, "{name}: expected a name of a-z, 0-9 and single -, such as rim-light");
    ensure!(
        !TAKEN.contains(&name),
        "{name}: this name is taken by Rust or its libraries; choose another"
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_cargo_or_rust_refuse_are_refused_in_a_line() {
        for name in ["rim", "rim-light", "a1"] {
            assert!(check_name(name).is_ok(), "{name}");
        }
        for name in ["Rim", "1rim", "rim_light", "-rim", "rim-", "a--b", "self", "std", "ä", "a b"]
        {
            assert!(check_name(name).is_err(), "{name}");
        }
        assert!(TAKEN.is_sorted());
    }
}
