//! Which renderer suits clouds, by what manifests say that it needs.

use super::find::UnitRef;
use super::registry::Registry;
use surfelshop_api::manifest::UnitEntry;
use surfelshop_api::{CloudInfo, Need, UnitKind};

/// Whether all clouds that have surfels have what a renderer cannot do without.
fn fits(unit: &UnitEntry, clouds: &[CloudInfo]) -> bool {
    let mut filled = clouds.iter().filter(|cloud| cloud.n_surfels > 0);
    filled.all(|cloud| cloud.lacks(&unit.needs).next().is_none())
}

impl Registry {
    /// The renderer for clouds that have columns which others do not read: the one that needs most of them, and the first
    /// of equal ones; those that nobody asked for stand back. None of a file that nobody has trusted; `None` where there is
    /// none, and without a surfel.
    #[must_use]
    pub fn suited(&self, clouds: &[CloudInfo]) -> Option<UnitRef> {
        if clouds.iter().all(|cloud| cloud.n_surfels == 0) {
            return None;
        }
        let reads = |unit: &UnitEntry| !unit.needs.is_empty() && fits(unit, clouds);
        let renderers = self.units(UnitKind::Renderer);
        let found: Vec<_> =
            renderers.filter(|(entry, _, unit)| !entry.asks_for_trust() && reads(unit)).collect();
        // The last of equal ones is the largest.
        let best = found.into_iter().rev().max_by_key(|(entry, _, unit)| {
            (entry.trust.is_asked_for(entry.origin), unit.needs.len())
        });
        best.map(|(entry, manifest, unit)| entry.unit(manifest, unit))
    }

    /// The columns that a unit reads, by its manifest; none where it is not there.
    #[must_use]
    pub fn needs(&self, reference: &UnitRef) -> Vec<Need> {
        let mut units = self.units(reference.kind);
        let found = units.find(|(_, manifest, unit)| {
            manifest.id == reference.package && unit.id == reference.id
        });
        found.map(|(_, _, unit)| unit.needs.clone()).unwrap_or_default()
    }

    /// Whether clouds have what a renderer of this name cannot do without; yes where there is no such renderer.
    #[must_use]
    pub fn suits(&self, name: &str, clouds: &[CloudInfo]) -> bool {
        let Ok(reference) = self.find(UnitKind::Renderer, name) else { return true };
        let mut units = self.units(UnitKind::Renderer);
        units
            .find(|(_, manifest, unit)| manifest.id == reference.package && unit.id == reference.id)
            .is_none_or(|(_, _, unit)| fits(unit, clouds))
    }
}
