//! Surfels by number, as files tell of them.

use super::{Selection, SelectionError};
use serde::{Deserialize, Serialize};

/// Some surfels of a cloud: so many that are not among them, so many that are, and so on in turns.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct SurfelRuns(Vec<u32>);

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
        Self(runs)
    }

    /// Those of a cloud of `len` surfels.
    ///
    /// # Errors
    /// Where they reach beyond it, or there is no memory.
    pub fn selection(&self, len: usize) -> Result<Selection, SelectionError> {
        let mut selection = Selection::none(len)?;
        let mut at = 0usize;
        for (i, &length) in self.0.iter().enumerate() {
            let end = at.saturating_add(length as usize);
            if end > len {
                return Err(SelectionError::Length { expected: len, found: end });
            }
            if i % 2 == 1 {
                (at..end).for_each(|row| selection.insert(row));
            }
            at = end;
        }
        Ok(selection)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_from_runs_and_may_not_reach_beyond_the_cloud() {
        for rows in [vec![], vec![0], vec![0, 1, 2, 7], vec![3, 5, 6, 9]] {
            let runs = SurfelRuns::of(&rows);
            let text = serde_json::to_string(&runs).unwrap();
            let read: SurfelRuns = serde_json::from_str(&text).unwrap();
            let found: Vec<usize> = read.selection(10).unwrap().indices().collect();
            assert_eq!(found, rows.iter().map(|row| *row as usize).collect::<Vec<_>>(), "{text}");
        }
        assert_eq!(serde_json::to_string(&SurfelRuns::of(&[3, 5, 6, 9])).unwrap(), "[3,1,1,2,2,1]");
        let far: SurfelRuns = serde_json::from_str("[4294967295,4294967295,4294967295,1]").unwrap();
        assert!(matches!(far.selection(10), Err(SelectionError::Length { .. })));
        assert!(SurfelRuns::of(&[10]).selection(10).is_err());
    }
}
