//! Nodes of a pyramid with what is selected of them tinted.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::selection::{Reach, RegionSelection, SelectionError, Tint, tinted};
use surfelshop_pyramid::{Pyramid, PyramidError};

/// What is selected of a pyramid, with the nodes that show it.
pub(super) struct TintedNodes {
    selection: Arc<RegionSelection>,
    /// Of each node what it looks like otherwise.
    known: Mutex<HashMap<u32, [Arc<Cloud>; 2]>>,
}

impl TintedNodes {
    /// Nothing is tinted yet.
    pub(super) fn new(selection: &Arc<RegionSelection>) -> Self {
        Self { selection: Arc::clone(selection), known: Mutex::default() }
    }

    /// Nodes with what is selected of them tinted.
    pub(super) fn of(
        &self,
        pyramid: &Pyramid,
        parts: Vec<Arc<Cloud>>,
        nodes: &[u32],
    ) -> Result<Vec<Arc<Cloud>>, PyramidError> {
        let tint = |part: &Arc<Cloud>, node: u32| -> Result<Arc<Cloud>, SelectionError> {
            let may_be = pyramid.ball(node).is_none_or(|(middle, radius)| {
                self.selection.reach(middle, radius) != Reach::Nothing
            });
            if !may_be || part.is_empty() {
                return Ok(Arc::clone(part));
            }
            let selected = self.selection.select_in_world(part)?;
            Ok(Arc::new(tinted(part, &selected, None, Tint::Full)?))
        };
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let tinted: Vec<[Arc<Cloud>; 2]> = parts
            .into_iter()
            .zip(nodes)
            .map(|(part, &node)| match known.get(&node) {
                Some([before, tinted]) if Arc::ptr_eq(before, &part) => {
                    Ok([part, Arc::clone(tinted)])
                }
                _ => {
                    let tinted = tint(&part, node).map_err(|error| {
                        PyramidError::Points(format!("{}: {error}", pyramid.path().display()))
                    })?;
                    Ok([part, tinted])
                }
            })
            .collect::<Result<_, PyramidError>>()?;
        // Those whose nodes have gone go, too.
        known.retain(|_, [before, _]| Arc::strong_count(before) > 1);
        known.extend(nodes.iter().copied().zip(tinted.iter().cloned()));
        Ok(tinted.into_iter().map(|[_, tinted]| tinted).collect())
    }
}
