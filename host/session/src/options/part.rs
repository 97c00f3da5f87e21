//! One part of work that several processes or machines share, as it is typed: `3/8`.

use serde::{Deserialize, Serialize};

/// Most parts that work is divided into.
const MOST: u32 = 100_000;

/// Part `number` of `of` parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Part {
    /// From 1 to [`Self::of`]; 0 where only what all parts need is made.
    pub number: u32,
    /// All parts, 1 or more.
    pub of: u32,
}

impl Part {
    /// Reads `K/N`, K from 1 to N.
    ///
    /// # Errors
    /// What was expected.
    pub fn parse(text: &str) -> Result<Self, String> {
        Self::parse_with_shared(text).and_then(|part| match part.number {
            0 => Err(format!("expected a part from 1 on, such as 1/{}", part.of)),
            _ => Ok(part),
        })
    }

    /// Reads `K/N`, K from 0 to N: 0 is what all parts need.
    ///
    /// # Errors
    /// What was expected.
    pub fn parse_with_shared(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(number, of)| {
            Some((number.trim().parse::<u32>().ok()?, of.trim().parse::<u32>().ok()?))
        });
        match numbers {
            Some((number, of)) if (1..=MOST).contains(&of) && number <= of => {
                Ok(Self { number, of })
            }
            _ => Err(format!("expected a part as K/N, such as 3/8, with N from 1 to {MOST}")),
        }
    }

    /// Whether the piece of work with this number, from 0 on, belongs to the part. Neighbours belong to different parts,
    /// so that work that grows along the way is divided evenly.
    #[must_use]
    pub fn takes(self, piece: usize) -> bool {
        self.number > 0 && piece % self.of as usize == self.number as usize - 1
    }

    /// The name of the folder that the part writes.
    #[must_use]
    pub fn folder(self) -> String {
        format!("part-{}-of-{}", self.number, self.of)
    }
}

impl std::fmt::Display for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "part {} of {}", self.number, self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_read_or_refused() {
        assert_eq!(Part::parse("3/8"), Ok(Part { number: 3, of: 8 }));
        assert_eq!(Part::parse_with_shared("0/8"), Ok(Part { number: 0, of: 8 }));
        for text in ["0/8", "9/8", "1/0", "3", "-1/8", "1/8/2", "a/b", ""] {
            assert!(Part::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn every_piece_belongs_to_one_part() {
        for of in [1, 3, 8, 200] {
            let parts: Vec<Part> = (1..=of).map(|number| Part { number, of }).collect();
            for piece in 0..100 {
                assert_eq!(parts.iter().filter(|part| part.takes(piece)).count(), 1);
            }
            let n = |part: &Part| (0..100).filter(|&piece| part.takes(piece)).count();
            let sizes: Vec<usize> = parts.iter().map(n).collect();
            assert!(sizes.iter().max().unwrap() - sizes.iter().min().unwrap() <= 1);
        }
        assert!(!(Part { number: 0, of: 8 }).takes(0));
    }
}
