//! The file of the preferences: read at the start, and written when they change.

use super::{Preferences, UI_SCALES};
use std::path::{Path, PathBuf};
use surfelshop_session::output::files;

/// Most bytes of the file: many times what all shortcuts take.
const LONGEST: u64 = 1 << 20;

/// The file, and what it holds.
#[derive(Default)]
pub(crate) struct PreferenceFile {
    /// `None` where nothing is written: the system names no folder, or the file cannot be read.
    path: Option<PathBuf>,
    written: Preferences,
}

/// The file of the user; `None` where the system names no folder for it.
fn of_user() -> Option<PathBuf> {
    let folder = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|f| f.is_absolute());
    let base = if cfg!(windows) {
        folder("APPDATA")?.join("Surfelshop")
    } else if cfg!(target_os = "macos") {
        folder("HOME")?.join("Library/Application Support/Surfelshop")
    } else {
        let usual = || Some(folder("HOME")?.join(".config"));
        folder("XDG_CONFIG_HOME").or_else(usual)?.join("surfelshop")
    };
    Some(base.join("settings.toml"))
}

impl PreferenceFile {
    /// Reads the user's file; a line where it cannot be used, and stays as it is then.
    pub(crate) fn open() -> (Self, Preferences, Option<String>) {
        match of_user() {
            Some(path) => Self::open_at(path),
            None => (Self::default(), Preferences::default(), None),
        }
    }

    fn open_at(path: PathBuf) -> (Self, Preferences, Option<String>) {
        if !path.exists() {
            return (
                Self { path: Some(path), written: Preferences::default() },
                Preferences::default(),
                None,
            );
        }
        match read(&path) {
            Ok(preferences) => {
                let file = Self { path: Some(path), written: preferences.clone() };
                (file, preferences, None)
            }
            Err(reason) => {
                let line = format!(
                    "{reason}; the usual settings are used, and changes are not saved until the file \
                     is mended or removed"
                );
                (Self::default(), Preferences::default(), Some(line))
            }
        }
    }

    /// Where the file is.
    pub(crate) fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Writes preferences that have changed; a line where that fails, after which no more is written.
    pub(crate) fn save(&mut self, preferences: &Preferences) -> Option<String> {
        if self.written == *preferences {
            return None;
        }
        self.written = preferences.clone();
        let path = self.path.clone()?;
        let written = write(&path, preferences).err();
        written.map(|error| {
            self.path = None;
            format!("{}: settings were not saved: {error:#}", path.display())
        })
    }
}

fn read(path: &Path) -> Result<Preferences, String> {
    let bytes = files::read_short(path, LONGEST).map_err(|error| format!("{error:#}"))?;
    let name = path.display();
    let text =
        String::from_utf8(bytes).map_err(|error| format!("{name}: expected text: {error}"))?;
    let mut preferences: Preferences = toml::from_str(&text).map_err(|error| {
        let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
        format!("{name}: line {}: {}", before.matches('\n').count() + 1, error.message())
    })?;
    let [smallest, .., largest] = UI_SCALES;
    if !(smallest..=largest).contains(&preferences.ui_scale) {
        preferences.ui_scale = 1.0;
    }
    Ok(preferences)
}

fn write(path: &Path, preferences: &Preferences) -> anyhow::Result<()> {
    let text = toml::to_string(preferences)?;
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    files::write_whole(path, text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preferences::ThemeChoice;
    use surfelshop_cloud::scene::Axis;

    #[test]
    fn what_is_written_is_read_again_with_keys_that_nobody_knows() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/settings.toml");
        let (mut file, mut preferences, line) = PreferenceFile::open_at(path.clone());
        assert!(line.is_none() && preferences == Preferences::default());
        assert_eq!(file.save(&preferences), None);
        assert!(!path.exists(), "nothing was chosen");
        preferences.theme = ThemeChoice::Light;
        preferences.ui_scale = 1.25;
        preferences.up.insert("ply".to_owned(), Axis::MinusZ);
        preferences.shortcuts.insert("split".to_owned(), vec!["Ctrl+2".to_owned()]);
        preferences.unknown.insert("later".to_owned(), true.into());
        assert_eq!(file.save(&preferences), None);
        let (_, again, line) = PreferenceFile::open_at(path);
        assert_eq!((again, line), (preferences, None));
    }

    #[test]
    fn a_file_that_is_wrong_is_named_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("settings.toml");
        std::fs::write(&path, "axes = true\ntheme = \"pink\"\n").unwrap();
        let (mut file, mut preferences, line) = PreferenceFile::open_at(path.clone());
        let line = line.unwrap();
        assert!(line.contains("settings.toml") && line.contains("line 2"), "{line}");
        preferences.grid = !preferences.grid;
        assert_eq!(file.save(&preferences), None);
        assert!(std::fs::read_to_string(path).unwrap().contains("pink"));
    }
}
