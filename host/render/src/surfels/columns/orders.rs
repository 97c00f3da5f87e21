//! Orders that are kept where edits are expected: a cloud that differs in attributes of some surfels is in the order of
//! the one before.

use crate::surfels::columns::changed::{few, places_of};
use crate::surfels::columns::order::{TIE_BREAKERS, attributes_in_order};
use std::sync::Arc;
use surfelshop_api::columns::{self, CloudView};
use surfelshop_cloud::changed_rows;

/// Names and generations of the columns that an order follows from.
pub(crate) type OrderedBy = Vec<(&'static str, u64)>;

/// The order a cloud is drawn in. The indices take as much memory as a column, and are kept where edits are expected.
pub(crate) struct Order {
    pub(crate) of: OrderedBy,
    /// Equal for equal orders.
    pub(crate) serial: u32,
    /// Surfels that are not cut, which come first.
    pub(crate) n_whole: u32,
    /// Hash of the indices, and of what divides them into chunks.
    pub(crate) hash: u64,
    pub(crate) indices: Option<Arc<Vec<u32>>>,
    pub(crate) last_used: u64,
}

/// What a cloud's order follows from.
pub(crate) fn ordered_by(cloud: &CloudView<'_>) -> OrderedBy {
    let names = [columns::POSITION].into_iter().chain(TIE_BREAKERS);
    names.filter_map(|name| Some((name, cloud.column(name)?.generation))).collect()
}

/// Whether what decides where surfels stand is the same in both, and not only what decides between those at one place.
fn stand_alike(one: &OrderedBy, other: &OrderedBy) -> bool {
    let decides = |name: &str| [columns::POSITION, columns::CLIP].contains(&name);
    one.len() == other.len()
        && one.iter().zip(other).all(|(a, b)| a.0 == b.0 && (a.1 == b.1 || !decides(a.0)))
}

/// The order of a cloud that follows from these columns, where it is a known one's: all that differs is attributes of few
/// surfels, which decide nothing.
pub(crate) fn order_as_before(
    orders: &[Order],
    cloud: &CloudView<'_>,
    of: &OrderedBy,
) -> Option<Order> {
    orders.iter().rev().find_map(|known| {
        let indices = known.indices.as_ref().filter(|_| stand_alike(&known.of, of))?;
        let differing = known.of.iter().zip(of).filter(|(known, own)| known != own);
        let mut rows = Vec::new();
        for ((_, one), (_, other)) in differing {
            rows.extend(changed_rows(*one, *other)?);
        }
        if !few(rows.len(), cloud.len) {
            return None;
        }
        let places = places_of(&rows, indices);
        let is_same = attributes_in_order(cloud, indices, &places, known.n_whole);
        is_same.then(|| Order { of: of.clone(), indices: Some(Arc::clone(indices)), ..*known })
    })
}
