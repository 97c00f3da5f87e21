//! Names are words of the field: those that the glossary avoids occur in no name of a file or type.
//! Costs 1 s.

use crate::repository::{files, root};
use std::fs;

/// Where the glossary's list begins.
const LIST: &str = "```text avoided\n";

/// The words that names must not have.
fn avoided() -> Vec<String> {
    let glossary = fs::read_to_string(root().join("host/manual/glossary.md")).unwrap();
    let list = glossary.split_once(LIST).expect("the glossary has the list").1;
    let list = list.split_once("```").expect("the list ends").0;
    list.split_whitespace().map(str::to_owned).collect()
}

/// The words of a name: `ColumnDemand`, `column_demand` and `column-demand` have `column` and `demand`.
fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut was_lower = false;
    for c in name.chars() {
        let starts = !c.is_ascii_alphanumeric() || c.is_ascii_uppercase() && was_lower;
        if starts {
            words.push(String::new());
        }
        was_lower = c.is_ascii_lowercase() || c.is_ascii_digit();
        if c.is_ascii_alphanumeric() {
            words.last_mut().expect("there is one").push(c.to_ascii_lowercase());
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

/// The types that a source declares.
fn types(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter_map(|line| {
        let line = line.trim_start();
        let line = line.strip_prefix("pub(crate) ").or(line.strip_prefix("pub ")).unwrap_or(line);
        let line = line.strip_prefix("pub(super) ").unwrap_or(line);
        let kinds = ["struct ", "enum ", "trait ", "type ", "union "];
        let name = kinds.iter().find_map(|kind| line.strip_prefix(kind))?;
        name.split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
            .next()
            .filter(|name| !name.is_empty())
    })
}

/// Names that plugins know, which stay.
const PUBLIC: [&str; 2] = ["Lamp", "SeenFrom"];

/// Invariant: words that the glossary avoids occur in no name of a file or type.
#[test]
fn names_of_files_and_types_are_words_of_the_field() {
    let avoided = avoided();
    assert!(avoided.len() > 20, "{avoided:?}");
    let is_avoided = |name: &str| words(name).into_iter().find(|word| avoided.contains(word));
    let mut found = Vec::new();
    for file in files() {
        let is_ours = ["host", "plugins", "shaders", "tests", "assets"]
            .iter()
            .any(|folder| file.starts_with(folder));
        let is_source = file.extension().is_some_and(|ending| ending == "rs" || ending == "wgsl");
        // Stored plugins are as they were.
        if !is_ours || !is_source || file.starts_with("tests/stored") {
            continue;
        }
        for part in file.iter().filter_map(|part| part.to_str()) {
            let stem = part.strip_suffix(".rs").or(part.strip_suffix(".wgsl")).unwrap_or(part);
            found.extend(is_avoided(stem).map(|word| format!("{}: {word}", file.display())));
        }
        let text = fs::read_to_string(root().join(&file)).unwrap();
        for name in types(&text).filter(|name| !PUBLIC.contains(name)) {
            found.extend(
                is_avoided(name).map(|word| format!("{}: {name} ({word})", file.display())),
            );
        }
    }
    found.sort();
    found.dedup();
    assert!(found.is_empty(), "{} names with words to avoid:\n{}", found.len(), found.join("\n"));
}

#[test]
fn names_are_cut_into_words() {
    assert_eq!(words("ColumnDemand"), ["column", "demand"]);
    assert_eq!(words("vpl-2.lit_surface"), ["vpl", "2", "lit", "surface"]);
    assert_eq!(words("RGBImage"), ["rgbimage"]);
    let text = "pub struct One;\n    enum Two<T> { A }\nstructure\npub(crate) type Three = u8;";
    assert_eq!(types(text).collect::<Vec<_>>(), ["One", "Two", "Three"]);
}
