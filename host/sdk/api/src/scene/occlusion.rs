//! What ambient occlusion darkens: one choice for all renderers that know it.

use crate::graph::{Members, Pass};
use crate::scene::cloud_facts::CloudFacts;
use crate::uniform::Uniform;
use crate::{choices, params};

choices! {
    /// What of the light on a surface its ambient accessibility darkens. Each choice takes in those
    /// before it; a renderer that has no such light does without.
    #[derive(PartialOrd, Ord)]
    pub enum AoAffects {
        /// Light from everywhere around, on matte surfaces.
        Ambient = "ambient",
        /// All light on matte surfaces, that of lights included.
        Diffuse = "diffuse",
        /// What is mirrored of the surroundings, too.
        Reflections = "reflections",
        /// Everything, highlights of lights included.
        All = "all",
    }
}

params! {
    /// The parameters of ambient occlusion, which renderers share. ABI 3.7.
    pub struct Occlusion {
        /// How much of the cloud's ambient occlusion counts, where it has any: 0 is none.
        ao_strength: f32 { default: 1.0, range: 0.0..=1.0 },
        /// What ambient occlusion darkens: light from everywhere around on matte surfaces, all
        /// light on them (diffuse), reflections of the surroundings too, or all, highlights
        /// included.
        ao_affects: AoAffects { default: AoAffects::Ambient },
    }
}

impl Occlusion {
    /// All of the occlusion, on these parts of the light.
    #[must_use]
    pub fn affecting(ao_affects: AoAffects) -> Self {
        Self { ao_affects, ..Self::default() }
    }
}

impl Uniform {
    /// Appends `ao_strength: f32, ao_affects: u32` for `share` of the WGSL module
    /// `surfelshop::occlusion`.
    ///
    /// Without a column `ao` there is nothing to darken by, and what is appended does not depend on
    /// the parameters.
    #[must_use]
    pub fn occlusion(self, strength: f32, affects: AoAffects, cloud: &CloudFacts) -> Self {
        match cloud.has(crate::columns::AO) {
            true => self.f32(strength).u32(affects as u32),
            false => self.f32(0.0).u32(0),
        }
    }
}

impl Members {
    /// Sets `ao_strength: f32` and `ao_affects: u32` for `share` of the WGSL module
    /// `surfelshop::occlusion`; without a column `ao` they do not depend on the parameters. ABI 3.7.
    #[must_use]
    pub fn occlusion(self, strength: f32, affects: AoAffects, cloud: &CloudFacts) -> Self {
        let (strength, affects) = match cloud.has(crate::columns::AO) {
            true => (strength, affects as u32),
            false => (0.0, 0),
        };
        self.f32("ao_strength", strength).u32("ao_affects", affects)
    }
}

impl Pass {
    /// Says whether occlusion counts, for a shader that imports `surfelshop::occlusion` and guards what
    /// looks at `Surface::ao` with `if occlusion::counts() { ... }`, or leaves it to `surfelshop::phong`.
    /// ABI 3.3.
    #[must_use]
    pub fn occluded(self, strength: f32, cloud: &CloudFacts) -> Self {
        let counts = strength > 0.0 && cloud.has(crate::columns::AO);
        self.feature("surfelshop::occlusion::COUNTS", counts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_accessibility_parameters_change_nothing() {
        let without = CloudFacts::default();
        let with = CloudFacts { columns: vec!["ao".to_owned()], ..CloudFacts::default() };
        let uniform = |strength, affects, cloud| Uniform::new().occlusion(strength, affects, cloud);
        let nothing = uniform(0.0, AoAffects::Ambient, &without);
        assert_eq!(uniform(1.0, AoAffects::All, &without), nothing);
        assert_eq!(uniform(0.5, AoAffects::All, &with), Uniform::new().f32(0.5).u32(3));
        let counts = |strength, cloud| {
            let pass = Pass::shading("p", "", "f").occluded(strength, cloud);
            pass.features["surfelshop::occlusion::COUNTS"]
        };
        assert!(counts(0.5, &with));
        assert!(!counts(0.0, &with) && !counts(1.0, &without));
    }
}
