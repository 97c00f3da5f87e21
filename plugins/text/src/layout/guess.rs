//! Guesses what separates the words of lines, and where a header ends.

use super::delimiter::Delimiter;
use crate::text::number;
use std::collections::BTreeMap;

/// Columns of a line that are taken.
pub(crate) const MOST_COLUMNS: usize = 1024;

/// How lines are cut into words.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Cut {
    pub(crate) delimiter: Delimiter,
    /// The decimal point: `.` or `,`.
    pub(crate) decimal: u8,
    /// For each column whether it holds numbers.
    pub(crate) numeric: Vec<bool>,
}

impl Cut {
    /// The words of a line, where there are as many as columns; a delimiter at the end is passed over.
    pub(crate) fn words<'a>(&self, line: &'a [u8]) -> Option<Vec<&'a [u8]>> {
        let mut words = self.delimiter.split(line);
        let n = self.numeric.len();
        if words.len() == n + 1 && words.last().is_some_and(|word| word.is_empty()) {
            words.pop();
        }
        (words.len() == n).then_some(words)
    }

    /// Whether a line has numbers wherever they are expected, and not only missing ones.
    pub(crate) fn fits(&self, line: &[u8]) -> bool {
        let Some(words) = self.words(line) else { return false };
        let mut numeric = words.iter().zip(&self.numeric).filter(|(_, is)| **is);
        numeric.clone().all(|(word, _)| number(word, self.decimal).is_some())
            && numeric.any(|(word, _)| !word.is_empty())
    }
}

/// The cut that gives most numbers in lines that fit it, of those with one of the delimiters; where several do, the
/// first. `None` where none gives three numbers.
pub(crate) fn best_cut(lines: &[&[u8]], delimiters: &[Delimiter]) -> Option<Cut> {
    let mut best: Option<(usize, Cut)> = None;
    for &delimiter in delimiters {
        for decimal in [b'.', b','] {
            if delimiter.byte() == decimal {
                continue;
            }
            let Some(cut) = cut(lines, delimiter, decimal) else { continue };
            let n_fitting = lines.iter().filter(|line| cut.fits(line)).count();
            let n_numbers = n_fitting * cut.numeric.iter().filter(|is| **is).count();
            if n_numbers > best.as_ref().map_or(0, |(most, _)| *most) {
                best = Some((n_numbers, cut));
            }
        }
    }
    best.map(|(_, cut)| cut)
}

/// The number of words that most lines have, and which of them are numbers in at least half of these.
fn cut(lines: &[&[u8]], delimiter: Delimiter, decimal: u8) -> Option<Cut> {
    let split: Vec<Vec<&[u8]>> = lines.iter().map(|line| delimiter.split(line)).collect();
    let mut lengths: BTreeMap<usize, usize> = BTreeMap::new();
    for words in split.iter().filter(|words| (3..=MOST_COLUMNS).contains(&words.len())) {
        *lengths.entry(words.len()).or_default() += 1;
    }
    let (&n, &n_lines) = lengths.iter().max_by_key(|&(n, n_lines)| (*n_lines, *n))?;
    let mut counts = vec![(0usize, 0usize); n];
    for words in split.iter().filter(|words| words.len() == n) {
        for ((n_numbers, n_missing), word) in counts.iter_mut().zip(words) {
            *n_missing += usize::from(word.is_empty());
            *n_numbers += usize::from(!word.is_empty() && number(word, decimal).is_some());
        }
    }
    let is_numeric = |&(n_numbers, n_missing): &(usize, usize)| {
        n_numbers > 0 && (n_numbers + n_missing) * 2 >= n_lines
    };
    let numeric: Vec<bool> = counts.iter().map(is_numeric).collect();
    let enough = numeric.iter().filter(|is| **is).count() >= 3;
    enough.then_some(Cut { delimiter, decimal, numeric })
}
