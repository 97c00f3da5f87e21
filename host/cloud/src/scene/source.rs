//! A scene's TOML text as tables with source positions, for messages.

use super::error::SceneFault;
use super::limits::MOST_UNKNOWN_KEYS;
use super::limits::NumberRange;
use crate::error::quoted;
use std::cell::RefCell;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// What is wrong, and at which byte of the text.
pub(super) struct Fault {
    pub(super) at: Option<usize>,
    pub(super) fault: SceneFault,
}

/// Tables and arrays within each other that are read; the parser's own limit differs for headers
/// and values, and what is read must be readable again however it is written.
const DEEPEST: usize = 32;

/// Keys that are warned of one by one.
const MOST_WARNINGS: usize = 20;

/// A text and what is to be said of it.
pub(super) struct Source<'a> {
    text: &'a str,
    /// Where each line begins: hundreds of thousands of clouds each have a line to be reported.
    lines: Vec<usize>,
    unknown: RefCell<Vec<(usize, String)>>,
}

impl<'a> Source<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        let lines = std::iter::once(0).chain(ends.map(|(at, _)| at + 1)).collect();
        Self { text, lines, unknown: RefCell::default() }
    }

    /// The whole text as a table.
    pub(super) fn table(&self) -> Result<Spanned<DeTable<'a>>, Fault> {
        DeTable::parse(self.text).map_err(|error| {
            let at = error.span().map(|span| span.start);
            let near = error.span().and_then(|span| self.text.get(span)).unwrap_or_default();
            let near = near.lines().next().unwrap_or_default();
            let near =
                if near.is_empty() { String::new() } else { format!(" at `{}`", word(near)) };
            let found = format!("{}{near}", error.message());
            Fault { at, fault: SceneFault::Syntax { found } }
        })
    }

    /// Line of a byte, counted from 1.
    fn line(&self, at: usize) -> usize {
        self.lines.partition_point(|start| *start <= at)
    }

    /// Line and column of a byte, counted from 1, the column in characters.
    pub(super) fn place(&self, at: usize) -> [usize; 2] {
        let line = self.line(at);
        let start = self.lines.get(line - 1).copied().unwrap_or_default();
        let before = self.text.get(start..at).unwrap_or_default();
        [line, before.chars().count() + 1]
    }

    /// A line for each key that nobody asked for, in the order of the text.
    pub(super) fn warnings(&self, file: &str) -> Vec<String> {
        let mut unknown = self.unknown.borrow_mut();
        unknown.sort();
        let line = |(at, line): &(usize, String)| {
            let [row, column] = self.place(*at);
            format!("{file}:{row}:{column}: {line}")
        };
        let mut lines: Vec<String> = unknown.iter().take(MOST_WARNINGS).map(line).collect();
        if let Some(more) = unknown.len().checked_sub(MOST_WARNINGS).filter(|more| *more > 0) {
            lines.push(format!("{file}: {more} more unknown keys are kept and have no effect"));
        }
        lines
    }
}

/// A table that is being read.
pub(super) struct Section<'a> {
    source: &'a Source<'a>,
    name: String,
    at: usize,
    table: &'a DeTable<'a>,
    known_keys: Vec<&'static str>,
}

impl<'a> Section<'a> {
    /// The table of the whole text.
    pub(super) fn whole(source: &'a Source<'a>, table: &'a DeTable<'a>) -> Self {
        Self { source, name: String::new(), at: 0, table, known_keys: Vec::new() }
    }

    fn full_name(&self, key: &str) -> String {
        if self.name.is_empty() { word(key) } else { format!("{}.{}", self.name, word(key)) }
    }

    /// The value of a key, where there is one.
    pub(super) fn find(&mut self, key: &'static str) -> Option<Entry<'a>> {
        self.known_keys.push(key);
        let (_, value) = self.table.iter().find(|(own, _)| own.get_ref() == key)?;
        Some(Entry { source: self.source, name: self.full_name(key), value })
    }

    /// The value of a key.
    pub(super) fn need(&mut self, key: &'static str, expected: &str) -> Result<Entry<'a>, Fault> {
        let (full_name, at) = (self.full_name(key), self.at);
        self.find(key).ok_or_else(|| {
            let fault = SceneFault::Missing { key: full_name, expected: expected.to_owned() };
            Fault { at: Some(at), fault }
        })
    }

    /// All keys and their values.
    pub(super) fn all(&self) -> impl Iterator<Item = (&'a str, Entry<'a>)> {
        self.table.iter().map(|(key, value)| {
            let name = self.full_name(key.get_ref());
            (key.get_ref().as_ref(), Entry { source: self.source, name, value })
        })
    }

    /// The keys that nobody asked for, each with a warning.
    pub(super) fn unknown(self) -> Result<toml::Table, Fault> {
        let mut unknown = toml::Table::new();
        for (key, value) in self.table {
            let name: &str = key.get_ref();
            if self.known_keys.contains(&name) {
                continue;
            }
            let full_name = self.full_name(name);
            let meant = self.known_keys.iter().min_by_key(|known| distance(known, name));
            // A third of the letters may differ; anything is near to a short word otherwise.
            let line = match meant.filter(|known| distance(known, name) <= known.len() / 3) {
                Some(meant) => format!("unknown key `{full_name}`, did you mean `{meant}`?"),
                None => format!("unknown key `{full_name}` is kept and has no effect"),
            };
            let found = {
                let mut unknown = self.source.unknown.borrow_mut();
                unknown.push((key.span().start, line));
                unknown.len()
            };
            if found > MOST_UNKNOWN_KEYS {
                let (what, most) = ("unknown keys", MOST_UNKNOWN_KEYS);
                let fault = SceneFault::TooMany { key: full_name, what, most, found };
                return Err(Fault { at: Some(key.span().start), fault });
            }
            let entry = Entry { source: self.source, name: full_name, value };
            unknown.insert(name.to_owned(), entry.value(0)?);
        }
        Ok(unknown)
    }
}

/// A value that is being read.
pub(super) struct Entry<'a> {
    source: &'a Source<'a>,
    name: String,
    value: &'a Spanned<DeValue<'a>>,
}

impl<'a> Entry<'a> {
    /// Says that the value is another one than was expected.
    pub(super) fn wrong(&self, expected: impl Into<String>) -> Fault {
        let found = match self.value.get_ref() {
            DeValue::Table(_) => "a table".to_owned(),
            _ => quoted(self.source.text.get(self.span()).unwrap_or_default().as_bytes()),
        };
        let fault = SceneFault::Value { key: self.name.clone(), expected: expected.into(), found };
        Fault { at: Some(self.span().start), fault }
    }

    /// Says that there is more of something than may be.
    pub(super) fn too_many(&self, what: &'static str, most: usize, found: usize) -> Fault {
        let fault = SceneFault::TooMany { key: self.name.clone(), what, most, found };
        Fault { at: Some(self.span().start), fault }
    }

    fn span(&self) -> Range<usize> {
        self.value.span()
    }

    /// Line where the value begins.
    pub(super) fn line(&self) -> usize {
        self.source.line(self.span().start)
    }

    /// A whole number.
    pub(super) fn whole(&self) -> Option<i64> {
        whole(self.value.get_ref())
    }

    /// A number that is allowed, written with a point or without.
    pub(super) fn number(
        &self,
        expected: &str,
        allowed: impl Fn(f64) -> bool,
    ) -> Result<f64, Fault> {
        let number = number(self.value.get_ref()).filter(|number| allowed(*number));
        number.ok_or_else(|| self.wrong(expected))
    }

    /// A number of a range.
    pub(super) fn within(&self, range: &NumberRange) -> Result<f64, Fault> {
        self.number(&range.expected(), |n| range.contains(n))
    }

    /// An array of numbers that are allowed.
    pub(super) fn numbers<const N: usize>(
        &self,
        expected: &str,
        allowed: impl Fn(f64) -> bool,
    ) -> Result<[f64; N], Fault> {
        let found = match self.value.get_ref() {
            DeValue::Array(array) => {
                array.iter().map(|value| number(value.get_ref()).filter(|n| allowed(*n))).collect()
            }
            _ => None,
        };
        let found: Option<[f64; N]> = found.and_then(|list: Vec<f64>| list.try_into().ok());
        found.ok_or_else(|| self.wrong(expected))
    }

    /// The values of an array; `None` where it is none.
    pub(super) fn items(&self) -> Option<Vec<Self>> {
        let array = self.value.get_ref().as_array()?;
        let item = |value: &'a Spanned<DeValue<'a>>| Self {
            source: self.source,
            name: self.name.clone(),
            value,
        };
        Some(array.iter().map(item).collect())
    }

    pub(super) fn flag(&self) -> Result<bool, Fault> {
        self.value.get_ref().as_bool().ok_or_else(|| self.wrong("true or false"))
    }

    pub(super) fn text(&self) -> Option<&'a str> {
        self.value.get_ref().as_str()
    }

    /// A table.
    pub(super) fn section(&self) -> Result<Section<'a>, Fault> {
        let table = self.value.get_ref().as_table().ok_or_else(|| self.wrong("a table"))?;
        let (name, at) = (self.name.clone(), self.span().start);
        Ok(Section { source: self.source, name, at, table, known_keys: Vec::new() })
    }

    /// At most so many tables, named by their place from 1.
    pub(super) fn sections(
        &self,
        what: &'static str,
        most: usize,
    ) -> Result<Vec<Section<'a>>, Fault> {
        let expected = || format!("tables that begin with [[{}]]", self.name);
        let array = self.value.get_ref().as_array().ok_or_else(|| self.wrong(expected()))?;
        if array.len() > most {
            return Err(self.too_many(what, most, array.len()));
        }
        let entry = |(i, value): (usize, &'a Spanned<DeValue<'a>>)| {
            let name = format!("{}[{}]", self.name, i + 1);
            let entry = Entry { source: self.source, name, value };
            if value.get_ref().is_table() { entry.section() } else { Err(entry.wrong(expected())) }
        };
        array.iter().enumerate().map(entry).collect()
    }

    /// The value as it is, whatever it is; `depth` tables and arrays are around it.
    pub(super) fn value(&self, depth: usize) -> Result<toml::Value, Fault> {
        if depth > DEEPEST {
            return Err(self.wrong(format!("at most {DEEPEST} tables and arrays in each other")));
        }
        let inner = |value: &'a Spanned<DeValue<'a>>, name: &str| {
            let name = format!("{}.{}", self.name, word(name));
            Entry { source: self.source, name, value }.value(depth + 1)
        };
        Ok(match self.value.get_ref() {
            DeValue::String(text) => toml::Value::String(text.clone().into_owned()),
            value @ DeValue::Integer(_) => {
                let expected = "a whole number of 64 bits";
                toml::Value::Integer(whole(value).ok_or_else(|| self.wrong(expected))?)
            }
            value @ DeValue::Float(_) => {
                let expected = "a number below 1.8e308";
                toml::Value::Float(number(value).ok_or_else(|| self.wrong(expected))?)
            }
            DeValue::Boolean(value) => toml::Value::Boolean(*value),
            DeValue::Datetime(value) => toml::Value::Datetime(*value),
            DeValue::Array(array) => {
                let values = array.iter().enumerate();
                let values = values.map(|(i, value)| inner(value, &(i + 1).to_string()));
                toml::Value::Array(values.collect::<Result<_, _>>()?)
            }
            DeValue::Table(table) => {
                let values = table.iter().map(|(key, value)| {
                    Ok((key.get_ref().clone().into_owned(), inner(value, key.get_ref())?))
                });
                toml::Value::Table(values.collect::<Result<_, _>>()?)
            }
        })
    }
}

/// A whole number of 64 bits.
fn whole(value: &DeValue<'_>) -> Option<i64> {
    let integer = value.as_integer()?;
    i64::from_str_radix(integer.as_str(), integer.radix()).ok()
}

/// A number, infinite or NaN only where it is written so.
fn number(value: &DeValue<'_>) -> Option<f64> {
    let Some(float) = value.as_float() else { return whole(value).map(|whole| whole as f64) };
    let number: f64 = float.as_str().parse().ok()?;
    (!number.is_infinite() || float.as_str().contains("inf")).then_some(number)
}

/// A key or a piece of text as a person can read it: one line, not long.
fn word(text: &str) -> String {
    quoted(text.as_bytes()).trim_matches('`').to_owned()
}

/// How many letters must be inserted, removed or replaced to turn one word into the other; words
/// far longer than any key are far from all of them.
#[must_use]
pub fn distance(known: &str, found: &str) -> usize {
    if found.len() > 2 * known.len() {
        return usize::MAX / 2;
    }
    let letters: Vec<char> = found.chars().collect();
    let mut row: Vec<usize> = (0..=letters.len()).collect();
    for (i, letter) in known.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, other) in letters.iter().enumerate() {
            let replaced = diagonal + usize::from(letter != *other);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[letters.len()]
}
