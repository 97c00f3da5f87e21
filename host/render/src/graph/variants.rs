//! Variants of one entry point: its pipelines for other values of `override` constants.

use std::collections::BTreeMap;
use std::sync::Arc;
use surfelshop_api::graph::Pass;

/// Most variants kept of one entry point; what was used longest ago goes first. A parameter that is
/// made a constant has as many values as a slider has places.
pub(super) const MAX_VARIANTS: usize = 16;

/// Values of `override` constants.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Settings {
    /// Bits of each value: equal bits make equal pipelines.
    constants: BTreeMap<String, u64>,
    /// What is there; what is not changes nothing.
    features: BTreeMap<String, bool>,
}

impl Settings {
    /// Those of a pass.
    pub(crate) fn of(pass: &Pass) -> Self {
        let bits = |(name, value): (&String, &f64)| (name.clone(), value.to_bits());
        Self {
            constants: pass.constants.iter().map(bits).collect(),
            features: pass.features.clone(),
        }
    }

    /// The same with what the host knows to be there, where the pass says nothing of it.
    pub(super) fn with(mut self, features: &[(&str, bool)]) -> Self {
        for (name, is_there) in features {
            if !self.constants.contains_key(*name) {
                self.features.entry((*name).to_owned()).or_insert(*is_there);
            }
        }
        self
    }

    /// The same with all that may be there, which can stand in for every choice of features.
    pub(super) fn general(&self) -> Self {
        let mut all = self.clone();
        all.features.values_mut().for_each(|is_there| *is_there = true);
        all
    }

    /// Those that a shader knows.
    pub(crate) fn only(&self, is_known: impl Fn(&str) -> bool) -> Self {
        let mut known = self.clone();
        known.constants.retain(|name, _| is_known(name));
        known.features.retain(|name, _| is_known(name));
        known
    }

    /// What is known of boolean constants, by name.
    pub(super) fn flags(&self) -> BTreeMap<String, bool> {
        let constants = self.constants.iter();
        let constants = constants.map(|(name, bits)| (name.clone(), f64::from_bits(*bits) != 0.0));
        let features = self.features.iter().map(|(name, there)| (name.clone(), *there));
        constants.chain(features).collect()
    }

    /// Names and values, as pipelines are made with.
    pub(super) fn values(&self) -> Vec<(&str, f64)> {
        let constants = self.constants.iter().map(|(name, bits)| (name, f64::from_bits(*bits)));
        let features =
            self.features.iter().map(|(name, there)| (name, f64::from(u8::from(*there))));
        constants.chain(features).map(|(name, value)| (name.as_str(), value)).collect()
    }

    /// Whether what these values make draws the same picture as `wanted`: it has all that is there, and
    /// more.
    fn stands_in_for(&self, wanted: &Self) -> bool {
        let has = |(name, there): (&String, &bool)| {
            self.features.get(name).is_some_and(|own| own >= there)
        };
        self.constants == wanted.constants
            && self.features.len() == wanted.features.len()
            && wanted.features.iter().all(has)
    }

    fn n_there(&self) -> usize {
        self.features.values().filter(|there| **there).count()
    }
}

struct Variant<P> {
    settings: Settings,
    pipeline: Arc<P>,
    last_used: u64,
}

/// The variants of one entry point.
pub(super) struct Variants<P> {
    all: Vec<Variant<P>>,
}

impl<P> Default for Variants<P> {
    fn default() -> Self {
        Self { all: Vec::new() }
    }
}

impl<P> Variants<P> {
    /// The one of these values.
    pub(super) fn get(&mut self, settings: &Settings, now: u64) -> Option<Arc<P>> {
        let found = self.all.iter_mut().find(|variant| variant.settings == *settings)?;
        found.last_used = now;
        Some(found.pipeline.clone())
    }

    /// One that makes the same picture, with as little more as there is.
    pub(super) fn stand_in(&mut self, settings: &Settings, now: u64) -> Option<Arc<P>> {
        let able = self.all.iter_mut().filter(|variant| variant.settings.stands_in_for(settings));
        let least = able.min_by_key(|variant| variant.settings.n_there())?;
        least.last_used = now;
        Some(least.pipeline.clone())
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.all.len()
    }

    /// When each was used last.
    pub(super) fn uses(&self) -> impl Iterator<Item = u64> {
        self.all.iter().map(|variant| variant.last_used)
    }

    /// Lets go of those that were used last before this.
    pub(super) fn let_go_before(&mut self, first_kept: u64) {
        self.all.retain(|variant| variant.last_used >= first_kept);
    }

    /// Keeps one.
    pub(super) fn keep(&mut self, settings: Settings, pipeline: Arc<P>, now: u64) {
        // It may have been made twice at a time.
        self.all.retain(|variant| variant.settings != settings);
        if self.all.len() >= MAX_VARIANTS {
            let oldest = self.all.iter().enumerate().min_by_key(|(_, variant)| variant.last_used);
            if let Some((oldest, _)) = oldest {
                self.all.swap_remove(oldest);
            }
        }
        self.all.push(Variant { settings, pipeline, last_used: now });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(exponent: f64, features: &[(&str, bool)]) -> Settings {
        let mut pass = Pass::shading("p", "", "f").constant("EXPONENT", exponent);
        for (name, there) in features {
            pass = pass.feature(name, *there);
        }
        Settings::of(&pass)
    }

    #[test]
    fn the_least_variant_that_has_all_that_is_there_stands_in() {
        let mut variants = Variants::default();
        let all = settings(2.0, &[("AO", true), ("SUN", true)]);
        let sun = settings(2.0, &[("AO", false), ("SUN", true)]);
        variants.keep(all.clone(), Arc::new("all"), 1);
        variants.keep(sun.clone(), Arc::new("sun"), 1);
        let none = settings(2.0, &[("AO", false), ("SUN", false)]);
        assert_eq!(variants.get(&none, 2), None);
        assert_eq!(variants.stand_in(&none, 2).as_deref(), Some(&"sun"));
        let ao = settings(2.0, &[("AO", true), ("SUN", false)]);
        assert_eq!(variants.stand_in(&ao, 2).as_deref(), Some(&"all"));
        let other = settings(3.0, &[("AO", false), ("SUN", false)]);
        assert_eq!(variants.stand_in(&other, 2), None, "a constant changes the picture");
        assert_eq!(none.values(), [("EXPONENT", 2.0), ("AO", 0.0), ("SUN", 0.0)]);
    }

    #[test]
    fn variants_are_capped_and_the_oldest_goes() {
        let mut variants = Variants::default();
        for i in 0..MAX_VARIANTS {
            variants.keep(settings(i as f64, &[]), Arc::new(i), i as u64);
        }
        assert_eq!(variants.get(&settings(0.0, &[]), 100).as_deref(), Some(&0));
        variants.keep(settings(-1.0, &[]), Arc::new(99), 101);
        assert_eq!(variants.all.len(), MAX_VARIANTS);
        assert_eq!(variants.get(&settings(1.0, &[]), 102), None);
        assert!(variants.get(&settings(0.0, &[]), 103).is_some());
        assert!(variants.get(&settings(f64::NAN, &[]), 103).is_none());
    }
}
