//! What the numbers of a column look like in a sample.

use crate::text::number;

/// What the numbers of a column look like in a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Facts {
    /// Numbers, and words that are none or missing.
    pub(crate) n: usize,
    pub(crate) n_missing: usize,
    pub(crate) min: f64,
    pub(crate) max: f64,
    /// Whether all are whole numbers, however they are written.
    pub(crate) whole: bool,
    /// Whether any is written with a point or an exponent.
    pub(crate) pointed: bool,
    /// Whether `f32` holds all digits that are written.
    pub(crate) short: bool,
}

impl Default for Facts {
    fn default() -> Self {
        let (min, max) = (f64::INFINITY, f64::NEG_INFINITY);
        Self { n: 0, n_missing: 0, min, max, whole: true, pointed: false, short: true }
    }
}

impl Facts {
    fn take(&mut self, word: &[u8], value: f64) {
        if !value.is_finite() {
            self.n_missing += 1;
            return;
        }
        self.n += 1;
        self.min = self.min.min(value);
        self.max = self.max.max(value);
        self.whole &= value == value.trunc();
        self.pointed |= word.iter().any(|byte| matches!(byte, b'.' | b',' | b'e' | b'E'));
        self.short = self.short && is_short(value);
    }

    /// Those of several columns together.
    pub(crate) fn of_all<'a>(all: impl Iterator<Item = &'a Self>) -> Self {
        all.fold(Self::default(), |sum, facts| Self {
            n: sum.n + facts.n,
            n_missing: sum.n_missing + facts.n_missing,
            min: sum.min.min(facts.min),
            max: sum.max.max(facts.max),
            whole: sum.whole && facts.whole,
            pointed: sum.pointed || facts.pointed,
            short: sum.short && facts.short,
        })
    }

    /// Whether there are numbers, all of them whole, from 0 to `most`.
    pub(crate) fn are_whole_to(&self, most: f64) -> bool {
        self.n > 0 && self.n_missing == 0 && self.whole && self.min >= 0.0 && self.max <= most
    }
}

/// Whether a number of 32 bits, written with the fewest digits, is this number: then 32 bits hold all that a file
/// says.
fn is_short(value: f64) -> bool {
    (value as f32).to_string().parse() == Ok(value)
}

/// Numbers of a sample, row by row, and what each column looks like.
#[derive(Clone, Debug, Default)]
pub(crate) struct Numbers {
    n_columns: usize,
    values: Vec<f64>,
    pub(crate) facts: Vec<Facts>,
}

impl Numbers {
    pub(crate) fn new(n_columns: usize) -> Self {
        Self { n_columns, values: Vec::new(), facts: vec![Facts::default(); n_columns] }
    }

    /// Takes the words of a line; those of columns that hold no numbers count as missing. Whether all others are
    /// numbers.
    pub(crate) fn take(&mut self, words: &[&[u8]], decimal: u8, numeric: &[bool]) -> bool {
        let start = self.values.len();
        for (word, &is_numeric) in words.iter().zip(numeric) {
            match if is_numeric { number(word, decimal) } else { Some(f64::NAN) } {
                Some(value) => self.values.push(value),
                None => {
                    self.values.truncate(start);
                    return false;
                }
            }
        }
        for (i, word) in words.iter().enumerate() {
            self.facts[i].take(word, self.values[start + i]);
        }
        true
    }

    pub(crate) fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.values.chunks_exact(self.n_columns.max(1))
    }

    /// Whether the three columns from `first` on are directions: all of length 1, but a few that are 0 or missing.
    pub(crate) fn are_directions(&self, first: usize) -> bool {
        let (mut n_unit, mut n_other) = (0usize, 0usize);
        for row in self.rows() {
            let Some([x, y, z]) = row.get(first..first + 3).and_then(|v| v.first_chunk()) else {
                return false;
            };
            let length = (x * x + y * y + z * z).sqrt();
            // Two decimals are what some programs write.
            if (length - 1.0).abs() < 0.02 {
                n_unit += 1;
            } else if length > 0.0 {
                n_other += 1;
            }
        }
        n_unit > 0 && n_other * 20 <= n_unit
    }

    /// Whether the three columns from `first` on are colours: whole numbers to `most`, or fractions to 1.
    pub(crate) fn are_colors(&self, first: usize, most: f64) -> bool {
        let Some(three) = self.facts.get(first..first + 3) else { return false };
        let facts = Facts::of_all(three.iter());
        let fractions = facts.n > 0
            && facts.n_missing == 0
            && three.iter().all(|facts| facts.pointed)
            && facts.min >= 0.0
            && facts.max <= 1.0;
        facts.are_whole_to(most) || fractions
    }
}
