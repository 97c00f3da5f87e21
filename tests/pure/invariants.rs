//! The manual's table of invariants is made from a line above each test. Costs 1 s.

use crate::repository::{files, root};
use std::fs;
use std::path::Path;

/// Set to 1, the table is written anew.
const ACCEPT: &str = "SURFELSHOP_ACCEPT_INVARIANTS";

const PAGE: &str = "host/manual/reference/invariants.md";

const HEAD: &str = "# Invariants

What must stay true, and the test that holds each. This page is made from the line `Invariant:` above the
tests; to change it, change that line and run
`SURFELSHOP_ACCEPT_INVARIANTS=1 cargo test -p surfelshop-tests --test pure invariants::`.

| invariant | test | file |
|---|---|---|
";

/// The invariants of a source with their tests, in order.
fn invariants(text: &str) -> Vec<(String, String)> {
    let mut found: Vec<(String, String)> = Vec::new();
    let mut open: Vec<String> = Vec::new();
    let mut continues = false;
    for line in text.lines().map(str::trim_start) {
        if let Some(statement) = line.strip_prefix("/// Invariant: ") {
            open.push(statement.trim_end().to_owned());
            continues = true;
        } else if let Some(more) = line.strip_prefix("/// ").filter(|_| continues) {
            if let Some(last) = open.last_mut() {
                last.push(' ');
                last.push_str(more.trim_end());
            }
        } else if let Some(name) = line.strip_prefix("fn ").filter(|_| !open.is_empty()) {
            let name = name.split('(').next().unwrap_or_default();
            found.extend(open.drain(..).map(|statement| (statement, name.to_owned())));
            continues = false;
        } else {
            continues = false;
            if !line.starts_with("#[") && !line.starts_with("///") {
                open.clear();
            }
        }
    }
    found
}

/// The page.
fn page() -> String {
    let mut rows = Vec::new();
    let mut sources = files();
    sources.sort();
    let own = Path::new("tests/pure/invariants.rs");
    for file in
        sources.iter().filter(|file| file.extension().is_some_and(|e| e == "rs") && *file != own)
    {
        let text = fs::read_to_string(root().join(file)).unwrap();
        for (statement, test) in invariants(&text) {
            rows.push(format!("| {statement} | `{test}` | `{}` |\n", file.display()));
        }
    }
    assert!(rows.len() > 100, "only {} invariants were found", rows.len());
    HEAD.to_owned() + &rows.concat()
}

#[test]
fn the_manual_lists_every_invariant() {
    let (page, path) = (page(), root().join(PAGE));
    if std::env::var(ACCEPT).is_ok_and(|value| value == "1") {
        fs::write(&path, &page).unwrap();
    }
    let found = fs::read_to_string(&path).unwrap();
    assert!(found == page, "{PAGE} is not what the tests say; set {ACCEPT}=1 to write it anew");
}

#[test]
fn invariants_are_read_with_their_tests() {
    let text = "/// Words.\n///\n/// Invariant: one\n/// goes on\n#[test]\nfn a() {\n/// Invariant: two\n    fn b() {\n\
                /// Invariant: none\nlet x = 1;\nfn c() {";
    let expected = [("one goes on", "a"), ("two", "b")];
    assert_eq!(invariants(text), expected.map(|(s, t)| (s.to_owned(), t.to_owned())));
}
