//! Selections: some of a cloud's surfels, as a bit for each.
//!
//! [`Region`] says which surfels lie where in space or have which numbers, [`ScreenRegion`] which are seen in a part
//! of a picture. Selections are combined, inverted, grown and shrunk; [`deleted`], [`extracted`] and [`with_value`]
//! do something with what is selected, and [`tinted`] shows it. Nothing here changes a cloud. Of clouds that are larger
//! than memory a [`RegionSelection`] says what is selected whatever is read of them, and an [`EditLayer`] what was done.
//!
//! Invariants: what is selected depends on the cloud and on what is asked for alone, never on threads
//! (`neighbours_are_found_alike_on_any_number_of_threads`).

mod depth;
mod edits;
mod error;
mod layer;
mod led;
mod neighbours;
mod placement;
mod region;
mod regions;
mod runs;
mod screen;
#[cfg(test)]
mod tests;
mod tint;

pub use depth::DepthPicture;
pub use edits::{deleted, extracted, set_column, with_value};
pub use error::SelectionError;
pub use layer::{Ball, EditLayer, HiddenOnes, LayerChange, LayerEdit};
pub use led::{NamedStroke, StrokeTools};
pub use neighbours::{component, connected, grown, shrunk, usual_distance};
pub use region::{Reach, Region};
pub use regions::{RegionSelection, RegionStep};
pub use runs::SurfelRuns;
pub use screen::{ScreenRegion, ScreenShape};
pub use tint::{Tint, tinted};

use crate::memory::with_room;
use serde::{Deserialize, Serialize};

/// Bits of a word.
const BITS: usize = u64::BITS as usize;

/// Some of a cloud's surfels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Selection {
    len: usize,
    /// Bits behind the last surfel are 0.
    words: Vec<u64>,
}

/// What a new selection does with the one before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Combine {
    /// It takes its place.
    #[default]
    Replace,
    /// Both are selected.
    Add,
    /// What is in the new one is selected no more.
    Subtract,
    /// What is in both is selected.
    Intersect,
}

impl Selection {
    /// None of `len` surfels.
    ///
    /// # Errors
    /// Where there is no memory for it.
    pub fn none(len: usize) -> Result<Self, SelectionError> {
        let n_words = len.div_ceil(BITS);
        let mut words = with_room(n_words)?;
        words.resize(n_words, 0);
        Ok(Self { len, words })
    }

    /// The surfels for which `test` is true; it is asked on several threads.
    ///
    /// # Errors
    /// Where there is no memory for it.
    pub fn of(
        len: usize,
        test: impl Fn(usize) -> bool + Sync + Send,
    ) -> Result<Self, SelectionError> {
        use rayon::prelude::*;
        let mut selection = Self::none(len)?;
        let words = selection.words.par_iter_mut().enumerate().with_min_len(64);
        words.for_each(|(i, word)| {
            let first = i * BITS;
            let bit = |bit: usize| u64::from(test(first + bit)) << bit;
            *word = (0..BITS.min(len - first)).map(bit).fold(0, |word, bit| word | bit);
        });
        Ok(selection)
    }

    /// Number of surfels, selected or not.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// How many are selected.
    #[must_use]
    pub fn count(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Whether none is selected.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.words.iter().all(|word| *word == 0)
    }

    /// Whether a surfel is selected; one that is not there is not.
    #[must_use]
    pub fn contains(&self, index: usize) -> bool {
        self.words.get(index / BITS).is_some_and(|word| word >> (index % BITS) & 1 == 1)
    }

    /// Selects a surfel; one that is not there is passed over.
    pub fn insert(&mut self, index: usize) {
        if index < self.len {
            self.words[index / BITS] |= 1 << (index % BITS);
        }
    }

    /// The selected surfels, ascending.
    pub fn indices(&self) -> impl Iterator<Item = usize> + '_ {
        let word = |(i, word): (usize, &u64)| {
            let (mut left, first) = (*word, i * BITS);
            std::iter::from_fn(move || {
                let bit = left.trailing_zeros() as usize;
                (left != 0).then(|| {
                    left &= left - 1;
                    first + bit
                })
            })
        };
        self.words.iter().enumerate().flat_map(word)
    }

    /// An entry for each surfel: whether it is selected.
    #[must_use]
    pub fn mask(&self) -> Vec<bool> {
        (0..self.len).map(|index| self.contains(index)).collect()
    }

    /// The surfels that are not selected.
    #[must_use]
    pub fn inverted(&self) -> Self {
        let mut words: Vec<u64> = self.words.iter().map(|word| !word).collect();
        if let (Some(last), behind @ 1..) = (words.last_mut(), self.len % BITS) {
            *last &= (1 << behind) - 1;
        }
        Self { len: self.len, words }
    }

    /// The same of the cloud after an edit: without surfels that are gone, where `stays` says which are not, and with those
    /// that were added behind the others.
    ///
    /// # Errors
    /// Where `stays` is of another number of surfels, or there is no memory.
    pub fn followed(&self, stays: Option<&[bool]>, n_added: usize) -> Result<Self, SelectionError> {
        let left: Vec<usize> = match stays {
            Some(stays) if stays.len() != self.len => {
                return Err(SelectionError::Length { expected: self.len, found: stays.len() });
            }
            Some(stays) => (0..self.len).filter(|i| stays[*i]).collect(),
            None => (0..self.len).collect(),
        };
        Self::of(left.len() + n_added, |i| left.get(i).is_none_or(|before| self.contains(*before)))
    }

    /// This selection with another one of the same cloud.
    ///
    /// # Errors
    /// Where the other one is of another number of surfels.
    pub fn combined(&self, other: &Self, how: Combine) -> Result<Self, SelectionError> {
        if other.len != self.len {
            return Err(SelectionError::Length { expected: self.len, found: other.len });
        }
        let word = |(own, new): (&u64, &u64)| match how {
            Combine::Replace => *new,
            Combine::Add => own | new,
            Combine::Subtract => own & !new,
            Combine::Intersect => own & new,
        };
        let words = self.words.iter().zip(&other.words).map(word).collect();
        Ok(Self { len: self.len, words })
    }
}
