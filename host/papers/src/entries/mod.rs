//! What the papers show: figures, tables, numbers and errata, as data.
//!
//! A step is a command line of this program without the program's name. In it `{name}` is a file of
//! `data.toml`, something prepared there, or a cloud that the program makes; `{out}` the folder of the entry,
//! and `{samples}` the paths of a pixel.

use anyhow::Context as _;
use serde::{Deserialize, Serialize};

/// A paper, or the errata of all.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Paper {
    /// As it is typed.
    pub id: String,
    /// The title.
    pub title: String,
    /// Who wrote it, where and when.
    pub source: String,
    /// What the whole page has to say beforehand.
    #[serde(default)]
    pub notes: Vec<String>,
    /// What it shows, in order.
    pub entry: Vec<Entry>,
}

/// A figure, table, number or erratum.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Entry {
    /// As printed: `Figure 15`; of an erratum its number.
    pub id: String,
    /// Section or page.
    pub at: String,
    /// What it shows, in a sentence.
    pub shows: String,
    /// What is printed, a number where there is one.
    pub printed: String,
    /// Of an erratum: the correct form.
    pub corrected: String,
    /// Of an erratum: `B` wrong output, `Q` bias, `A` ambiguous, `C` cosmetic.
    pub severity: String,
    /// Of an erratum: why, in a sentence.
    pub reason: String,
    /// What its pictures show, and what the truth is that they are measured against.
    pub pictures: String,
    /// The technique, as in the page of how it was checked.
    pub technique: String,
    /// Where its formula is in the code: `path: name`, a file of the repository and a function, type or constant in it.
    pub formula: Vec<String>,
    /// Command lines that make it.
    pub steps: Vec<String>,
    /// What evaluates it, where no command does.
    pub computed: String,
    /// Why it cannot be made or shown; empty where it is.
    pub impossible: String,
    /// What stands in for the paper's own scene, whatever data there is.
    pub stand_in: String,
    /// Of an erratum: the names of two numbers, the error as printed and as corrected, where they are not called so.
    pub errors: Vec<String>,
    /// What its pictures show in the gallery; empty where they are not in it.
    pub gallery: String,
    /// Rows of the tables of time by pass that its benchmarks make.
    pub pass: Vec<PassRow>,
    /// Printed numbers and where ours are found.
    pub against: Vec<Against>,
}

/// A step of a paper's algorithm, and what of a frame it is.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PassRow {
    /// What it is.
    pub name: String,
    /// Section of the paper.
    pub at: String,
    /// How stages of `bench --split` begin that belong to it, up to a blank, a comma, a colon or the end.
    pub stages: Vec<String>,
}

/// A number that is printed, and ours.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Against {
    /// What is counted.
    pub what: String,
    /// As printed, with its unit.
    pub printed: String,
    /// The step whose numbers count, from 0.
    pub step: usize,
    /// Where ours is in that step's JSON file: a JSON pointer. Of a list of runs it is the median time. Of a
    /// benchmark's step also `RENDERER: ROW` of its table of passes, or `RENDERER: frame`.
    pub value: String,
    /// What it is divided by, the same of another number; nothing where empty.
    pub over: String,
    /// Factor on the result; 1 where 0.
    pub factor: f64,
    /// The unit of ours.
    pub unit: String,
}

impl Entry {
    /// Whether a user's name means it.
    #[must_use]
    pub fn is_called(&self, name: &str) -> bool {
        self.id.eq_ignore_ascii_case(name)
    }

    /// The name of its folder.
    #[must_use]
    pub fn folder(&self, paper: &str) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
        format!("{paper}-{}", self.id.chars().map(plain).collect::<String>())
    }
}

/// The three papers and their errata.
pub fn papers() -> anyhow::Result<Vec<Paper>> {
    let all = [
        ("thesis.toml", include_str!("thesis.toml")),
        ("phong-splatting.toml", include_str!("phong-splatting.toml")),
        ("point-gi.toml", include_str!("point-gi.toml")),
        ("errata.toml", include_str!("errata.toml")),
    ];
    let parsed = |(name, text): (&str, &str)| {
        toml::from_str(text).with_context(|| format!("{name}: it is no list of entries"))
    };
    all.into_iter().map(parsed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_entry_is_made_or_says_why_not_and_no_two_share_a_folder() {
        let papers = papers().unwrap();
        let mut folders = Vec::new();
        for paper in &papers {
            for entry in &paper.entry {
                let is_made = !entry.steps.is_empty() || !entry.computed.is_empty();
                assert_ne!(is_made, !entry.impossible.is_empty(), "{} {}", paper.id, entry.id);
                assert!(!entry.shows.is_empty() && !entry.at.is_empty(), "{}", entry.id);
                folders.push(entry.folder(&paper.id));
            }
        }
        let n = folders.len();
        folders.sort();
        folders.dedup();
        assert_eq!(folders.len(), n, "folders are told apart");
    }

    #[test]
    fn all_figures_and_errata_are_listed() {
        let papers = papers().unwrap();
        let count = |id: &str, word: &str| {
            let paper = papers.iter().find(|paper| paper.id == id).unwrap();
            paper.entry.iter().filter(|entry| entry.id.starts_with(word)).count()
        };
        assert_eq!(count("thesis", "Figure"), 47);
        assert_eq!(count("thesis", "Table"), 1);
        assert_eq!(count("phong-splatting", "Figure"), 9);
        assert_eq!(count("point-gi", "Figure"), 14);
        assert_eq!(count("errata", "T") + count("errata", "P") + count("errata", "B"), 47);
    }
}
