//! Surfels by number, as files tell of them.

use super::{Selection, SelectionError};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD_NO_PAD;
use serde::{Deserialize, Serialize};

/// Some surfels of a cloud, as text: so many that are not among them, so many that are, and so on in turns, each number in
/// bytes of seven bits, the lowest first, and all of these in base64. Where surfels lie scattered that takes 3 bytes each.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct SurfelRuns(String);

impl SurfelRuns {
    /// Those of these numbers, which ascend.
    #[must_use]
    pub fn of(rows: &[u32]) -> Self {
        let mut runs: Vec<u32> = Vec::new();
        let mut end = 0;
        for &row in rows {
            match runs.last_mut() {
                Some(length) if row == end => *length += 1,
                _ => runs.extend([row.saturating_sub(end), 1]),
            }
            end = row.saturating_add(1);
        }
        let mut bytes = Vec::new();
        for mut run in runs {
            while run >= 0x80 {
                bytes.push(0x80 | (run & 0x7f) as u8);
                run >>= 7;
            }
            bytes.push(run as u8);
        }
        Self(STANDARD_NO_PAD.encode(bytes))
    }

    /// Those of a cloud of `len` surfels.
    ///
    /// # Errors
    /// Where the text is damaged, they reach beyond the cloud, or there is no memory.
    pub fn selection(&self, len: usize) -> Result<Selection, SelectionError> {
        let bytes = STANDARD_NO_PAD
            .decode(&self.0)
            .map_err(|error| SelectionError::Runs(error.to_string()))?;
        let mut selection = Selection::none(len)?;
        let (mut at, mut is_among) = (0usize, false);
        let (mut length, mut shift) = (0u64, 0u32);
        for byte in bytes {
            if shift > 28 {
                return Err(SelectionError::Runs("a number of more than 35 bits".to_owned()));
            }
            length |= u64::from(byte & 0x7f) << shift;
            shift += 7;
            if byte >= 0x80 {
                continue;
            }
            let end = at.saturating_add(length as usize);
            if end > len {
                return Err(SelectionError::Length { expected: len, found: end });
            }
            if is_among {
                (at..end).for_each(|row| selection.insert(row));
            }
            (at, is_among, length, shift) = (end, !is_among, 0, 0);
        }
        Ok(selection)
    }
}

impl From<SurfelRuns> for String {
    fn from(runs: SurfelRuns) -> Self {
        runs.0
    }
}

impl From<&str> for SurfelRuns {
    fn from(text: &str) -> Self {
        Self(text.to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_from_runs_and_may_not_reach_beyond_the_cloud() {
        for rows in [vec![], vec![0], vec![0, 1, 2, 7], vec![3, 5, 6, 9], vec![300, 70_000]] {
            let runs = SurfelRuns::of(&rows);
            let text = serde_json::to_string(&runs).unwrap();
            let read: SurfelRuns = serde_json::from_str(&text).unwrap();
            let found: Vec<usize> = read.selection(70_001).unwrap().indices().collect();
            assert_eq!(found, rows.iter().map(|row| *row as usize).collect::<Vec<_>>(), "{text}");
        }
        assert_eq!(SurfelRuns::of(&[3, 5, 6, 9]), SurfelRuns("AwEBAgIB".to_owned()));
        assert!(SurfelRuns::of(&[10]).selection(10).is_err());
        assert!(SurfelRuns::of(&[u32::MAX]).selection(10).is_err());
        for damaged in ["?", "////////////////", "AwEBAgI$"] {
            assert!(SurfelRuns(damaged.to_owned()).selection(10).is_err(), "{damaged}");
        }
    }
}
