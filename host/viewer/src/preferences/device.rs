//! What draws, as the user chose it: the options of the command line, where none is typed.

use serde::{Deserialize, Serialize};
use surfelshop_session::options::{BackendChoice, DeviceArguments, SurfelChoice};

/// The choices, in the words of the command line; empty for the usual.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub(crate) struct DevicePreferences {
    /// How surfels are drawn.
    pub(crate) surfels: String,
    /// The graphics interface.
    pub(crate) backend: String,
    /// The adapter: any part of its name.
    pub(crate) adapter: String,
}

impl DevicePreferences {
    /// What is typed, and where nothing is, what was chosen; a line for each choice that is none.
    pub(crate) fn under(&self, typed: &DeviceArguments) -> (DeviceArguments, Vec<String>) {
        let mut device = typed.clone();
        let mut wrong = Vec::new();
        let mut refused = |key: &str, found: &str, expected: Vec<String>| {
            let expected = expected.join(", ");
            wrong.push(format!(
                "settings.toml: device: {key}: expected {expected} or nothing, found `{found}`"
            ));
        };
        if matches!(device.surfels, SurfelChoice::Auto) && !self.surfels.is_empty() {
            match chosen::<SurfelChoice>(&self.surfels) {
                Ok(surfels) => device.surfels = surfels,
                Err(expected) => refused("surfels", &self.surfels, expected),
            }
        }
        if device.backend.is_none() && !self.backend.is_empty() {
            match chosen::<BackendChoice>(&self.backend) {
                Ok(backend) => device.backend = Some(backend),
                Err(expected) => refused("backend", &self.backend, expected),
            }
        }
        if device.adapter.is_none() && !self.adapter.is_empty() {
            device.adapter = Some(self.adapter.clone());
        }
        (device, wrong)
    }
}

/// The words of a choice.
pub(super) fn words<T: clap::ValueEnum>() -> Vec<String> {
    let all = T::value_variants().iter().filter_map(clap::ValueEnum::to_possible_value);
    all.map(|value| value.get_name().to_owned()).collect()
}

fn chosen<T: clap::ValueEnum>(text: &str) -> Result<T, Vec<String>> {
    T::from_str(text, true).map_err(|_expected| words::<T>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_typed_goes_before_what_was_chosen() {
        let chosen = DevicePreferences {
            surfels: "cpu".to_owned(),
            backend: "vulkan".to_owned(),
            adapter: "radeon".to_owned(),
        };
        let (device, wrong) = chosen.under(&DeviceArguments::default());
        assert!(wrong.is_empty() && matches!(device.surfels, SurfelChoice::Cpu));
        assert!(device.backend.is_some() && device.adapter.as_deref() == Some("radeon"));
        let typed = DeviceArguments {
            surfels: SurfelChoice::Quads,
            adapter: Some("intel".to_owned()),
            ..DeviceArguments::default()
        };
        let (device, _) = chosen.under(&typed);
        assert!(matches!(device.surfels, SurfelChoice::Quads));
        assert_eq!(device.adapter.as_deref(), Some("intel"));
        let odd = DevicePreferences { surfels: "magic".to_owned(), ..Default::default() };
        let (device, wrong) = odd.under(&DeviceArguments::default());
        assert!(matches!(device.surfels, SurfelChoice::Auto));
        assert!(wrong[0].contains("`magic`") && wrong[0].contains("quads"), "{wrong:?}");
    }
}
