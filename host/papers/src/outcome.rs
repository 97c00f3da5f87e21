//! What came of an entry: pictures, numbers, tables and plots, with the commands and the machine.

use crate::effects::Effect;
use crate::entries::{Entry, Paper};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::path::PathBuf;

/// Whether an entry was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// With the paper's own data, or of data that the paper does not depend on.
    Made,
    /// With something else in the place of what the paper shows.
    StoodIn,
    /// Not at all.
    Impossible,
}

impl State {
    /// In a word or two.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Made => "made",
            Self::StoodIn => "stood in",
            Self::Impossible => "not made",
        }
    }
}

/// A picture in the entry's folder.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PictureFile {
    /// What it is called below it.
    pub name: String,
    /// Its place in the folder.
    pub file: String,
}

/// A number and how to measure it again.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Number {
    /// What it counts.
    pub what: String,
    /// The value.
    pub value: f64,
    /// Its unit; empty where it has none.
    pub unit: String,
    /// What the paper has; empty where it has nothing.
    pub printed: String,
    /// The command that measures it, by its place among the commands; none where the program itself
    /// evaluates a formula.
    pub command: Option<usize>,
    /// Where it is in the JSON file of that command: a JSON pointer, several with ` + ` between them that are added
    /// up, and behind ` / ` what the sum is divided by.
    pub pointer: String,
    /// Whether another run has the very value: times differ.
    pub is_repeatable: bool,
}

/// A table.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Grid {
    /// What it shows.
    pub caption: String,
    /// Names of the columns.
    pub head: Vec<String>,
    /// Rows of texts.
    pub rows: Vec<Vec<String>>,
}

/// A drawing.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Drawing {
    /// What it shows.
    pub caption: String,
    /// The program's own, without scripts.
    pub svg: String,
}

/// What an entry was made of.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Shown {
    /// What it is.
    pub of: String,
    /// For what of the paper it stands in; empty where it is the paper's own.
    pub stands_in_for: String,
}

/// All that came of an entry.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Outcome {
    /// Changes with whatever it was made of.
    pub hash: String,
    /// The folder of all entries where it was made, from the root.
    pub place: String,
    /// Whether it was made.
    pub state: State,
    /// The commands that make it, in order.
    pub commands: Vec<String>,
    /// What was shown.
    pub data: Vec<Shown>,
    /// Pictures.
    pub pictures: Vec<PictureFile>,
    /// Numbers.
    pub numbers: Vec<Number>,
    /// Tables.
    pub tables: Vec<Grid>,
    /// Drawings.
    pub drawings: Vec<Drawing>,
    /// What the commands printed that belongs to it.
    pub said: Vec<String>,
    /// When, in UTC.
    pub date: String,
    /// On what.
    pub machine: String,
    /// How long it took, in seconds, with everything that had to be prepared.
    pub seconds: f64,
    /// Where its pictures lie.
    #[serde(skip)]
    pub folder: PathBuf,
    /// Whether an earlier run made it.
    #[serde(skip)]
    pub was_there: bool,
}

impl Outcome {
    /// Nothing, in a state.
    #[must_use]
    pub fn empty(state: State) -> Self {
        Self {
            hash: String::new(),
            place: String::new(),
            state,
            commands: Vec::new(),
            data: Vec::new(),
            pictures: Vec::new(),
            numbers: Vec::new(),
            tables: Vec::new(),
            drawings: Vec::new(),
            said: Vec::new(),
            date: String::new(),
            machine: String::new(),
            seconds: 0.0,
            folder: PathBuf::new(),
            was_there: false,
        }
    }
}

/// An entry and what came of it, or a line that says what went wrong.
pub struct Made<'a> {
    /// The entry.
    pub entry: &'a Entry,
    /// What came of it.
    pub outcome: Result<Outcome, String>,
    /// Of an erratum: what it does to a picture.
    pub effect: Option<Effect>,
}

/// Everything for programs.
#[must_use]
pub fn object(made: &[(&Paper, Vec<Made<'_>>)]) -> Value {
    let entry = |made: &Made<'_>| {
        let outcome = made.outcome.as_ref().ok();
        json!({
            "id": made.entry.id,
            "shows": made.entry.shows,
            "state": outcome.map_or("failed", |outcome| outcome.state.word()),
            "why": made.entry.impossible,
            "error": made.outcome.as_ref().err(),
            "commands": outcome.map(|outcome| &outcome.commands),
            "effect": made.effect,
            "numbers": outcome.map(|outcome| &outcome.numbers),
            "data": outcome.map(|outcome| &outcome.data),
            "date": outcome.map(|outcome| &outcome.date),
            "machine": outcome.map(|outcome| &outcome.machine),
            "seconds": outcome.map(|outcome| outcome.seconds),
        })
    };
    let paper = |(paper, made): &(&Paper, Vec<Made<'_>>)| json!({ "id": paper.id, "entries": made.iter().map(entry).collect::<Vec<_>>() });
    Value::Array(made.iter().map(paper).collect())
}
