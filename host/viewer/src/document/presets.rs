//! Presets: named parameter values of a renderer, one file each.

use super::scene_file::values::{toml_of, value_of};
use super::state_folder::StateFolder;
use anyhow::{Context as _, anyhow, bail};
use std::path::PathBuf;
use surfelshop_api::params::Values;
use surfelshop_session::output::files;
use toml::Table;

/// Most bytes of a preset: more than all parameters at their longest.
const MOST_BYTES: u64 = 1 << 20;

impl StateFolder {
    fn presets(&self, renderer: &str) -> PathBuf {
        self.folder().join("presets").join(renderer.replace(['/', '\\', ':'], "-"))
    }

    /// Names of a renderer's presets, sorted.
    pub(crate) fn preset_names(&self, renderer: &str) -> Vec<String> {
        let listing = self.presets(renderer).read_dir().into_iter().flatten().flatten();
        let mut names: Vec<String> = listing
            .filter_map(|entry| {
                let path = entry.path();
                let is_preset = path.extension().is_some_and(|ending| ending == "toml");
                Some(path.file_stem()?.to_str()?.to_owned()).filter(|_| is_preset)
            })
            .collect();
        names.sort();
        names
    }

    /// Saves values under a name, and replaces an earlier preset of that name.
    pub(crate) fn save_preset(
        &self,
        renderer: &str,
        name: &str,
        values: &Values,
    ) -> anyhow::Result<()> {
        let path = self.preset_path(renderer, name)?;
        let table: Table = values.iter().map(|(id, value)| (id.clone(), toml_of(value))).collect();
        let folder = self.presets(renderer);
        std::fs::create_dir_all(&folder)
            .with_context(|| format!("{}: cannot be made", folder.display()))?;
        files::write_whole(&path, table.to_string().as_bytes())
    }

    /// The values of a preset, also those that the renderer no longer takes.
    pub(crate) fn load_preset(&self, renderer: &str, name: &str) -> anyhow::Result<Values> {
        let path = self.preset_path(renderer, name)?;
        let shown = path.display();
        let text = String::from_utf8(files::read_short(&path, MOST_BYTES)?)
            .with_context(|| format!("{shown}: cannot be read"))?;
        let table: Table = text
            .parse()
            .map_err(|error: toml::de::Error| anyhow!("{shown}: {}", error.message()))?;
        Ok(table.iter().filter_map(|(id, value)| Some((id.clone(), value_of(value)?))).collect())
    }

    fn preset_path(&self, renderer: &str, name: &str) -> anyhow::Result<PathBuf> {
        let name = name.trim();
        let plain = |c: char| c.is_alphanumeric() || " -_.,+".contains(c);
        if name.is_empty() || name.starts_with('.') || !name.chars().all(plain) || name.len() > 80 {
            bail!("expected a name of letters and digits for the preset, found `{name}`");
        }
        Ok(self.presets(renderer).join(format!("{name}.toml")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::params::Value;

    #[test]
    fn presets_come_back_as_they_were_saved() {
        let folder = tempfile::tempdir().unwrap();
        let state = StateFolder::in_folder(folder.path().to_owned());
        let values: Values = [
            ("on", Value::Bool(true)),
            ("count", Value::Int(-3)),
            ("size", Value::Float(0.1)),
            ("mode", Value::Text("fast \"one\"".to_owned())),
            ("tint", Value::Color([0.25, 1.0, 0.5])),
        ]
        .map(|(id, value)| (id.to_owned(), value))
        .into();
        state.save_preset("org.example/mine", "soft light", &values).unwrap();
        state.save_preset("org.example/mine", "a", &Values::new()).unwrap();
        assert_eq!(state.preset_names("org.example/mine"), ["a", "soft light"]);
        assert!(state.preset_names("other").is_empty());
        assert_eq!(state.load_preset("org.example/mine", "soft light").unwrap(), values);
        for bad in ["", "../up", ".hidden", "a/b"] {
            assert!(state.save_preset("mine", bad, &values).is_err(), "{bad}");
        }
        let path = folder.path().join("presets/org.example-mine/a.toml");
        std::fs::write(path, "size = = 1").unwrap();
        let error = state.load_preset("org.example/mine", "a").unwrap_err().to_string();
        assert!(error.contains("a.toml") && error.lines().count() == 1, "{error}");
    }
}
