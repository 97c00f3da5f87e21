//! The licences of all crates that are compiled into the program and its plugins.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::said;
use crate::cargo;

/// Characters of the line between the texts of two licences.
pub(super) const RULE: usize = 80;

/// A crate that is linked.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Linked {
    name: String,
    version: String,
    licence: String,
    repository: String,
}

/// Writes name, version, licence and the texts of the licences of every crate that these packages link, each text once.
pub(super) fn write(path: &Path, packages: &[String]) -> Result<(), String> {
    let mut tree = cargo::bare();
    tree.args(["tree", "--locked", "--edges=normal", "--prefix=none", "--no-dedupe"]);
    tree.arg("--format={p}|{l}|{r}");
    tree.args(packages.iter().map(|name| format!("--package={name}")));
    let told = cargo::output(&mut tree)?;
    let mut crates: Vec<Linked> = told.lines().filter_map(linked).collect();
    crates.sort();
    crates.dedup();
    let sources = sources()?;
    let mut texts: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut list = String::new();
    for one in &crates {
        let full = format!("{} {}", one.name, one.version);
        list += &format!("{full}: {} {}\n", one.licence, one.repository);
        for text in licence_texts(&sources, one) {
            texts.entry(text).or_default().push(full.clone());
        }
    }
    let mut whole = format!(
        "Surfelshop is licensed under MIT OR Apache-2.0; see LICENSE. Compiled into it are these {} crates, under the \
         licences that they name:\n\n{list}",
        crates.len()
    );
    for (text, of) in texts {
        let line = "-".repeat(RULE);
        whole += &format!("\n{line}\n{}\n{line}\n\n{}\n", of.join(", "), text.trim());
    }
    fs::write(path, whole).map_err(|error| said(path, &error))
}

/// A line of `cargo tree`: `NAME vVERSION (…)|LICENCE|REPOSITORY`; none for crates of this workspace.
fn linked(line: &str) -> Option<Linked> {
    let mut parts = line.split('|');
    let mut package = parts.next()?.split_whitespace();
    let (name, version) =
        (package.next()?.to_owned(), package.next()?.strip_prefix('v')?.to_owned());
    if name.starts_with("surfelshop") {
        return None;
    }
    let mut text = || parts.next().unwrap_or_default().to_owned();
    let (licence, repository) = (text(), text());
    Some(Linked { name, version, licence, repository })
}

/// The folders that Cargo unpacks crates into.
fn sources() -> Result<Vec<PathBuf>, String> {
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(std::env::home_dir()?.join(".cargo")));
    let folder = home.ok_or("there is no home folder of Cargo")?.join("registry/src");
    let entries = fs::read_dir(&folder).map_err(|error| said(&folder, &error))?;
    Ok(entries.filter_map(|entry| Some(entry.ok()?.path())).collect())
}

/// The texts of the licences that a crate brings.
fn licence_texts(sources: &[PathBuf], of: &Linked) -> Vec<String> {
    let name = format!("{}-{}", of.name, of.version);
    let Some(folder) =
        sources.iter().map(|source| source.join(&name)).find(|folder| folder.is_dir())
    else {
        return Vec::new();
    };
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.sort();
    let is_licence = |file: &PathBuf| {
        let name = file.file_name().map(|name| name.to_string_lossy().to_ascii_uppercase());
        let starts = ["LICENSE", "LICENCE", "COPYING", "NOTICE", "UNLICENSE"];
        file.is_file()
            && name.is_some_and(|name| starts.iter().any(|start| name.starts_with(start)))
    };
    files
        .iter()
        .filter(|file| is_licence(file))
        .filter_map(|file| fs::read_to_string(file).ok())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_cargo_tree_are_read() {
        let found = linked("glam v0.34.2|MIT OR Apache-2.0|https://example.org/glam").unwrap();
        assert_eq!((found.name.as_str(), found.version.as_str()), ("glam", "0.34.2"));
        assert_eq!(found.licence, "MIT OR Apache-2.0");
        let derive = linked("serde_derive v1.0.1 (proc-macro)|MIT|").unwrap();
        assert_eq!((derive.version.as_str(), derive.repository.as_str()), ("1.0.1", ""));
        assert_eq!(linked("surfelshop-api v0.1.0 (/a/host/sdk/api)|MIT|"), None);
        assert_eq!(linked(""), None);
    }
}
