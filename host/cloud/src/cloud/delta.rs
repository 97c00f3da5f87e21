//! A cloud as what differs from another one, for steps of undo.

use crate::cloud::Cloud;
use crate::cloud::buffer::Buffer;
use crate::cloud::changes::{self, changed_rows};
use crate::cloud::column::Column;
use crate::memory::{OutOfMemory, ask};
use std::sync::Arc;

/// A column is noted as what differs where that is at most this share of its surfels.
const MOST_SHARE: usize = 4;

/// A cloud that is made again from another one, the base: columns that both have are the base's, of others whose changes
/// are known only the values of surfels that differ are here, and the rest is here whole.
#[derive(Clone, Debug)]
pub struct CloudDelta {
    /// The cloud without its columns.
    bare: Cloud,
    columns: Vec<Part>,
}

#[derive(Clone, Debug)]
enum Part {
    /// The base's values; the column has none of its own.
    Shared(Column),
    /// Values of some rows, in the place of those of a column of the base, by its generation.
    Patch { column: Column, base: u64, rows: Arc<[u32]>, values: Buffer },
    /// All of it.
    Whole(Column),
}

impl CloudDelta {
    /// What of a cloud differs from a base; `None` where that would take no less memory.
    #[must_use]
    pub fn between(cloud: &Cloud, base: &Cloud) -> Option<Self> {
        if cloud.len() != base.len() {
            return None;
        }
        let columns: Vec<Part> = cloud.columns().iter().map(|column| part(column, base)).collect();
        let is_less = columns.iter().any(|part| matches!(part, Part::Patch { .. }));
        let bare = Cloud { columns: Vec::new(), ..cloud.clone() };
        is_less.then_some(Self { bare, columns })
    }

    /// The cloud again, of the base that it was noted against: the same columns, bit by bit and with their generations.
    ///
    /// # Errors
    /// Where there is no memory.
    pub fn applied(&self, base: &Cloud) -> Result<Cloud, OutOfMemory> {
        let find = |generation: u64| {
            base.columns().iter().find(|column| column.generation() == generation)
        };
        let mut columns = Vec::with_capacity(self.columns.len());
        for part in &self.columns {
            columns.extend(match part {
                Part::Whole(column) => Some(column.clone()),
                Part::Shared(column) => find(column.generation()).map(|of| column.refilled(of)),
                Part::Patch { column, base, rows, values } => match find(*base) {
                    Some(of) => Some(patched(column, of, rows, values)?),
                    None => None,
                },
            });
        }
        Ok(Cloud { columns, ..self.bare.clone() })
    }

    /// Generation and bytes of the columns that are here whole.
    pub fn columns(&self) -> impl Iterator<Item = (u64, u64)> {
        self.columns.iter().filter_map(|part| match part {
            Part::Whole(column) => {
                let bytes = column.values().len() * column.values().element().size();
                Some((column.generation(), bytes as u64))
            }
            Part::Shared(_) | Part::Patch { .. } => None,
        })
    }

    /// Bytes of what differs.
    #[must_use]
    pub fn patch_bytes(&self) -> u64 {
        let parts = self.columns.iter().map(|part| match part {
            Part::Patch { rows, values, .. } => {
                rows.len() * size_of::<u32>() + values.len() * values.element().size()
            }
            Part::Shared(_) | Part::Whole(_) => 0,
        });
        parts.sum::<usize>() as u64
    }
}

fn part(column: &Column, base: &Cloud) -> Part {
    let generation = column.generation();
    if base.columns().iter().any(|other| other.generation() == generation) {
        return Part::Shared(column.emptied());
    }
    let whole = || Part::Whole(column.clone());
    let Some(of) = base.column(column.name()) else { return whole() };
    let is_alike = of.components() == column.components()
        && of.values().element() == column.values().element();
    let rows = changed_rows(generation, of.generation())
        .filter(|rows| is_alike && rows.len() <= base.len() / MOST_SHARE);
    let Some(rows) = rows else { return whole() };
    match column.values().gather(column.components() as usize, &rows) {
        Ok(values) => {
            let (column, base) = (column.emptied(), of.generation());
            Part::Patch { column, base, rows: rows.into(), values }
        }
        // Where there is no memory for the difference, the column stays as it is.
        Err(_out) => whole(),
    }
}

fn patched(
    column: &Column,
    of: &Column,
    rows: &Arc<[u32]>,
    new: &Buffer,
) -> Result<Column, OutOfMemory> {
    ask((of.values().len() * of.values().element().size()) as u64)?;
    let mut values = of.values().clone();
    values.scatter(of.components() as usize, rows, new);
    // A device that has the one gets the other by what differs.
    if changed_rows(of.generation(), column.generation()).is_none() {
        changes::note(of.generation(), column.generation(), Arc::clone(rows));
    }
    Ok(column.filled(values))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::selection::{Selection, with_value};
    use glam::DVec3;

    fn cloud(n: usize) -> Cloud {
        let floats = |k: usize| (0..n * k).map(|i| (i % 977) as f32).collect::<Vec<f32>>();
        let colors = (0..3 * n).map(|i| (i % 251) as u8).collect();
        let columns = vec![
            Column::new("position", 3, Buffer::F32(floats(3))),
            Column::new("color", 3, Buffer::U8(colors)),
            Column::new("class", 1, Buffer::U16(vec![0; n])),
        ];
        Cloud::new(DVec3::X * 4e6, columns).unwrap()
    }

    fn generations(cloud: &Cloud) -> Vec<u64> {
        cloud.columns().iter().map(Column::generation).collect()
    }

    /// Invariant: a cloud that is made again of what differs is the same, bit by bit, generation by generation
    #[test]
    fn a_cloud_is_made_again_of_what_differs() {
        let before = cloud(10_000);
        let chosen = Selection::of(10_000, |i| i % 100 == 7).unwrap();
        let after = with_value(&before, &chosen, "class", &[5.0]).unwrap();
        for (cloud, base) in [(&before, &after), (&after, &before)] {
            let delta = CloudDelta::between(cloud, base).unwrap();
            // Each surfel's number and its value.
            assert_eq!(delta.patch_bytes(), 100 * (4 + 2));
            assert_eq!(delta.columns().count(), 0);
            let again = delta.applied(base).unwrap();
            assert_eq!(generations(&again), generations(cloud));
            for (a, b) in again.columns().iter().zip(cloud.columns()) {
                assert_eq!((a.name(), a.values()), (b.name(), b.values()));
            }
            assert_eq!((again.origin(), again.len()), (cloud.origin(), cloud.len()));
        }
        // Where nobody knows what differs, or much does, it takes no less.
        assert!(CloudDelta::between(&before, &cloud(10_000)).is_none());
        assert!(CloudDelta::between(&before, &cloud(9)).is_none());
        let most = Selection::of(10_000, |i| i % 2 == 0).unwrap();
        let other = with_value(&before, &most, "class", &[5.0]).unwrap();
        assert!(CloudDelta::between(&before, &other).is_none());
    }
}
