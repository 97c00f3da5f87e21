//! Which renderer of a picture draws which of its clouds.

use crate::engine::renderer_view::{Companion, RendererView};
use surfelshop_api::CloudFacts;
use surfelshop_api::params::Values;

/// A renderer of a picture with its clouds.
pub(super) struct Drawer<'a> {
    pub(super) name: String,
    pub(super) view: &'a mut RendererView,
    pub(super) values: &'a Values,
    pub(super) clouds: Vec<u32>,
}

/// The renderers that have a cloud to draw: the view's own first, then the others.
pub(super) fn drawers<'a>(
    own: &'a mut RendererView,
    own_values: &'a Values,
    others: &'a mut [Companion],
    facts: &CloudFacts,
) -> Vec<Drawer<'a>> {
    let is_there =
        |cloud: &u32| facts.clouds.get(*cloud as usize).is_some_and(|info| info.n_surfels > 0);
    let filled = |clouds: &[u32]| clouds.iter().copied().filter(is_there).collect::<Vec<_>>();
    // The same renderer with the same parameters draws its clouds together.
    let is_own = |other: &Companion| other.view.scope == own.scope && other.values == *own_values;
    let named = others.iter().filter(|other| !is_own(other));
    let named: Vec<u32> = named.flat_map(|other| other.clouds.clone()).collect();
    let mut others: Vec<&mut Companion> =
        others.iter_mut().filter(|other| !is_own(other)).collect();
    // No order of the clouds shows: what draws them stands in that of names and values.
    others.sort_by_cached_key(|other| (other.view.scope.clone(), format!("{:?}", other.values)));
    let rest: Vec<u32> =
        (0..facts.clouds.len() as u32).filter(|cloud| !named.contains(cloud)).collect();
    let first =
        Drawer { name: own.name.clone(), view: own, values: own_values, clouds: filled(&rest) };
    let others = others.into_iter().map(|other| Drawer {
        name: other.name.clone(),
        view: &mut other.view,
        values: &other.values,
        clouds: filled(&other.clouds),
    });
    let mut all: Vec<Drawer<'a>> = std::iter::once(first).chain(others).collect();
    // Without a surfel the view's own draws what there is.
    if all.iter().all(|drawer| drawer.clouds.is_empty()) {
        all.truncate(1);
        return all;
    }
    all.retain(|drawer| !drawer.clouds.is_empty());
    all
}
