//! Which surfels filters let through, and the columns of these.

use super::cache;
use super::error::DisplayError;
use super::filter::{Filter, FilterAction, FilterTest};
use super::hidden::{self, HIDDEN};
use super::scalar::{BLOCK, Scalar};
use super::settings::Attribute;
use crate::cloud::Cloud;
use crate::cloud::axis::Axis;
use crate::cloud::column::Column;
use crate::faces;
use crate::memory::ask;
use rayon::prelude::*;
use std::sync::Arc;
use surfelshop_api::columns::COLOR;

/// The cloud of the surfels that all filters let through and nobody has hidden, and their indices in the other one; `None` where
/// all surfels are shown. Columns are found again by their generations and the filters.
///
/// # Errors
/// Where a column has fewer components, or there is no memory.
pub(super) fn filtered(
    cloud: &Cloud,
    filters: &[Filter],
    up: Axis,
) -> Result<Option<Rows>, DisplayError> {
    let by_hand = Filter {
        attribute: Attribute::column(HIDDEN),
        action: FilterAction::Hide,
        test: FilterTest::Values(vec![1]),
    };
    let by_hand = hidden::values(cloud).map(|_| &by_hand);
    let mut tests = Vec::with_capacity(filters.len() + 1);
    for filter in filters.iter().chain(by_hand) {
        if let Some(scalar) = Scalar::of(cloud, &filter.attribute, up)? {
            tests.push((scalar, filter));
        }
    }
    if tests.is_empty() {
        return Ok(None);
    }
    if u32::try_from(cloud.len()).is_err() {
        return Err(DisplayError::TooMany { found: cloud.len() });
    }
    let key = tests.iter().map(|(scalar, f)| (scalar.key(), f.action, f.test.clone())).collect();
    let (number, indices) = cache::rows(key, || -> Result<_, DisplayError> {
        // A byte for each surfel, and the indices twice.
        ask((cloud.len() as u64).saturating_mul(9))?;
        let shown = shown(cloud.len(), &tests);
        let all = shown.par_iter().enumerate();
        let indices: Vec<u32> = all.filter(|(_, shown)| **shown).map(|(i, _)| i as u32).collect();
        Ok(indices.into())
    })?;
    Ok((indices.len() < cloud.len()).then_some(Rows { number, indices }))
}

/// Whether each surfel is shown.
fn shown(len: usize, tests: &[(Scalar<'_>, &Filter)]) -> Vec<bool> {
    let mut shown = vec![true; len];
    shown.par_chunks_mut(BLOCK).enumerate().for_each_init(
        || vec![0.0; BLOCK],
        |numbers, (i, shown)| {
            let numbers = &mut numbers[..shown.len()];
            for (scalar, filter) in tests {
                scalar.read(i * BLOCK, numbers);
                for (shown, number) in shown.iter_mut().zip(numbers.iter()) {
                    *shown &= filter.shows(*number);
                }
            }
        },
    );
    shown
}

/// Some of a cloud's surfels.
pub(super) struct Rows {
    /// Equal for equal indices.
    number: u64,
    /// In ascending order.
    pub(super) indices: Arc<[u32]>,
}

impl Rows {
    /// A cloud of these surfels, with the triangles all of whose corners are among them, and without colours
    /// where it gets others.
    pub(super) fn of(&self, cloud: &Cloud, recolors: bool) -> Result<Cloud, DisplayError> {
        let columns = cloud.columns().iter().filter(|c| !recolors || c.name() != COLOR);
        let columns = columns.filter(|c| c.name() != HIDDEN);
        let columns = columns.map(|column| self.column(column));
        let columns: Vec<Column> = columns.collect::<Result<_, _>>()?;
        let faces = match cloud.faces().is_empty() {
            true => Vec::new(),
            false => {
                let mut mask = vec![false; cloud.len()];
                self.indices.iter().for_each(|&i| mask[i as usize] = true);
                faces::kept(cloud.faces(), &mask)
            }
        };
        Ok(cloud.with_rows(columns, self.indices.len(), faces))
    }

    fn column(&self, column: &Column) -> Result<Column, DisplayError> {
        cache::selected(column.generation(), self.number, || Ok(column.gather(&self.indices)?))
    }
}
