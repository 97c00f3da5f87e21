//! Surfels that changed: whether they are few, and where they stand.

use rayon::prelude::*;

/// One surfel of so many may differ: where more do, all are sent at once.
const SHARE: usize = 4;

/// Whether so few surfels differ that they are changed one by one.
pub(crate) fn few(n_changed: usize, n_surfels: usize) -> bool {
    n_changed.saturating_mul(SHARE) <= n_surfels
}

/// Places of some surfels in an order, ascending.
pub(crate) fn places_of(rows: &[u32], order: &[u32]) -> Vec<u32> {
    // A bit each: what is looked up for every surfel stays in the caches.
    let mut differs = vec![0u64; order.len().div_ceil(64)];
    for row in rows {
        if let Some(bits) = differs.get_mut(*row as usize / 64) {
            *bits |= 1 << (row % 64);
        }
    }
    let differs =
        |row: u32| differs.get(row as usize / 64).is_some_and(|bits| bits >> (row % 64) & 1 == 1);
    let place = |(place, row): (usize, &u32)| differs(*row).then_some(place as u32);
    order.par_iter().enumerate().filter_map(place).collect()
}
