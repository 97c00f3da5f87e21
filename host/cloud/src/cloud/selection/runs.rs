//! Surfels by number, as files tell of them.

use super::{Selection, SelectionError};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD_NO_PAD;
use serde::{Deserialize, Serialize};

/// Some surfels of a cloud, as scenes note those that are hidden and strokes those that they concerned: how many there are in
/// all, and how many follow each other that are not among them, are, are not and so on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct SurfelRuns {
    len: u64,
    runs: Vec<u64>,
}

impl SurfelRuns {
    /// Those of a selection.
    #[must_use]
    pub fn of(selection: &Selection) -> Self {
        Self::of_rows(selection.len(), selection.indices())
    }

    /// Those of these numbers, which ascend, of a cloud of `len` surfels.
    #[must_use]
    pub(crate) fn of_rows(len: usize, rows: impl Iterator<Item = usize>) -> Self {
        let mut runs: Vec<u64> = Vec::new();
        let mut end = 0;
        for row in rows {
            match runs.last_mut() {
                Some(length) if row == end => *length += 1,
                _ => runs.extend([row.saturating_sub(end) as u64, 1]),
            }
            end = row + 1;
        }
        Self { len: len as u64, runs }
    }

    /// The surfels, of a cloud of `len`.
    ///
    /// # Errors
    /// Where it is of another number of surfels, or there is no memory.
    pub fn selection(&self, len: usize) -> Result<Selection, SelectionError> {
        if self.len != len as u64 {
            let found = usize::try_from(self.len).unwrap_or(usize::MAX);
            return Err(SelectionError::Length { expected: len, found });
        }
        let mut selection = Selection::none(len)?;
        let mut at = 0;
        for (i, run) in self.runs.iter().enumerate() {
            let end = at + *run as usize;
            if i % 2 == 1 {
                (at..end).for_each(|index| selection.insert(index));
            }
            at = end;
        }
        Ok(selection)
    }

    /// As text: its numbers, of seven bits a byte, in base 64.
    #[must_use]
    pub fn text(&self) -> String {
        let mut bytes = Vec::new();
        for number in std::iter::once(&self.len).chain(&self.runs) {
            let mut left = *number;
            while left >= 0x80 {
                bytes.push(left as u8 | 0x80);
                left >>= 7;
            }
            bytes.push(left as u8);
        }
        STANDARD_NO_PAD.encode(bytes)
    }

    /// Reads such a text; `None` where it is none.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let bytes = STANDARD_NO_PAD.decode(text).ok()?;
        let (mut numbers, mut number, mut shift) = (Vec::new(), 0u64, 0);
        for byte in bytes {
            // A cloud has at most 2^32 surfels.
            if shift > 28 {
                return None;
            }
            number |= u64::from(byte & 0x7f) << shift;
            shift += 7;
            if byte < 0x80 {
                numbers.push(number);
                (number, shift) = (0, 0);
            }
        }
        let (len, runs) = numbers.split_first()?;
        let is_whole = shift == 0 && runs.iter().sum::<u64>() <= *len;
        // Only the first may be empty: the first surfel is among them then.
        let is_short = runs.iter().skip(1).all(|run| *run > 0);
        (is_whole && is_short).then(|| Self { len: *len, runs: runs.to_vec() })
    }
}

impl From<SurfelRuns> for String {
    fn from(runs: SurfelRuns) -> Self {
        runs.text()
    }
}

impl TryFrom<String> for SurfelRuns {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        Self::parse(&text).ok_or_else(|| "expected surfels by number, in base64".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn surfels_are_read_as_they_were_written(bits in proptest::collection::vec(any::<bool>(), 0..700)) {
            let selection = Selection::of(bits.len(), |index| bits[index]).unwrap();
            let noted = SurfelRuns::of(&selection);
            let again = SurfelRuns::parse(&noted.text()).unwrap();
            prop_assert_eq!(&again, &noted);
            prop_assert_eq!(again.selection(bits.len()).unwrap(), selection);
            prop_assert!(again.selection(bits.len() + 1).is_err());
        }

        #[test]
        fn any_text_is_read_or_refused(text in "[A-Za-z0-9+/=]{0,40}") {
            if let Some(read) = SurfelRuns::parse(&text) {
                prop_assert_eq!(SurfelRuns::parse(&read.text()), Some(read));
            }
        }
    }
}
