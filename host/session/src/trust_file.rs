//! The file that remembers which plugins may run.
//!
//! ```toml
//! format = 1
//!
//! [[builds]]
//! sha256 = "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"
//! package = "org.example.rim 0.1.0"
//! file = "/home/me/rim/target/release/librim.so"
//!
//! [[places]]
//! file = "/home/me/rim/target/release/librim.so"
//!
//! [[isolated]]
//! package = "org.example.rim"
//! ```
//!
//! Of a build the digits count, `package` and `file` are for the reader. It is written whole or not at all,
//! and one that is damaged is a failure: read as empty it would lose what was trusted with the next yes.

use crate::output::files;
use anyhow::{Context as _, anyhow, ensure};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use surfelshop_api::manifest::Manifest;
use surfelshop_runtime::plugins::{Contents, Trust, user_plugins_folder};

const FORMAT: u32 = 1;
/// Thousands of plugins.
const LARGEST_FILE: u64 = 1 << 20;

/// What a trust file holds.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrustFile {
    format: u32,
    /// Trusted builds.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub builds: Vec<Build>,
    /// Trusted places.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub places: Vec<TrustedPlace>,
    /// Packages whose libraries run in processes of their own, trusted or not.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub isolated: Vec<IsolatedPackage>,
}

/// A package whose library runs in processes of its own.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IsolatedPackage {
    /// Its id.
    pub package: String,
}

/// A file that is trusted by its contents.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Build {
    /// SHA-256 of the file, in hexadecimal digits.
    pub sha256: String,
    /// The package, for the reader.
    #[serde(default)]
    pub package: String,
    /// The file.
    #[serde(default)]
    pub file: PathBuf,
}

/// A path that is trusted whatever stands there.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrustedPlace {
    /// The file.
    pub file: PathBuf,
}

impl TrustFile {
    /// Where the list of this name lies, or else the user's own; a failure where the system names no folder
    /// for it.
    pub fn path(named: Option<&Path>) -> anyhow::Result<PathBuf> {
        if let Some(path) = named {
            return Ok(path.to_owned());
        }
        let folder = user_plugins_folder().and_then(|plugins| Some(plugins.parent()?.to_owned()));
        let folder = folder.ok_or_else(|| {
            anyhow!(
                "this system names no folder for your data (HOME is not set); name a --trust-file"
            )
        })?;
        Ok(folder.join("trust.toml"))
    }

    /// The list of this name, which must be there; without one the user's own, which may be missing.
    pub fn named(path: Option<&Path>) -> anyhow::Result<Self> {
        match path {
            Some(path) => Self::read(path),
            None => match Self::path(None) {
                Ok(path) => Self::read_or_new(&path),
                // Where there is no place for a list nothing was ever trusted.
                Err(_) => Ok(Self::default()),
            },
        }
    }

    /// Reads a file that may not be there yet.
    pub fn read_or_new(path: &Path) -> anyhow::Result<Self> {
        if matches!(path.metadata(), Err(error) if error.kind() == ErrorKind::NotFound) {
            return Ok(Self::default());
        }
        Self::read(path)
    }

    /// Reads a file.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let name = path.display();
        let text = String::from_utf8(files::read_short(path, LARGEST_FILE)?).map_err(|_error| {
            anyhow!("{name}: expected a list of trusted plugins, found no text")
        })?;
        Self::parse(&text).map_err(|what| {
            anyhow!("{name}: {what}; correct the file, or remove it and trust your plugins again")
        })
    }

    fn parse(text: &str) -> Result<Self, String> {
        let file: Self = toml::from_str(text).map_err(|error| {
            let before = error.span().and_then(|span| text.get(..span.start));
            let line = before.map(|before| before.matches('\n').count() + 1);
            let line = line.map(|line| format!("line {line}: ")).unwrap_or_default();
            format!("{line}{}", error.message().replace('\n', " "))
        })?;
        if file.format != FORMAT {
            return Err(format!("expected format {FORMAT}, found {}", file.format));
        }
        match file.builds.iter().find(|build| Contents::from_sha256(&build.sha256).is_none()) {
            Some(Build { sha256, .. }) => {
                Err(format!("expected a SHA-256 of 64 hexadecimal digits, found `{sha256}`"))
            }
            None => Ok(file),
        }
    }

    /// Writes it, whole or not at all.
    fn write(&self, path: &Path) -> anyhow::Result<()> {
        let text = toml::to_string_pretty(&Self { format: FORMAT, ..self.clone() })
            .with_context(|| format!("{}: cannot be written", path.display()))?;
        let head =
            "# Plugins whose code Surfelshop may run; `surfelshop plugins trust` adds to them.\n";
        files::write_whole(path, format!("{head}{text}").as_bytes())
    }

    /// Changes a list that no other program changes meanwhile; one that is damaged is not touched.
    pub fn change<T>(
        path: &Path,
        work: impl FnOnce(&mut Self) -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        let name = path.display();
        if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder)
                .with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
        }
        let lock = path.with_extension("lock");
        let file =
            File::create(&lock).with_context(|| format!("{}: cannot be made", lock.display()))?;
        // Freed when this ends, however it does.
        file.lock().with_context(|| format!("{name}: another program is changing it"))?;
        let mut list = Self::read_or_new(path)?;
        let done = work(&mut list)?;
        list.write(path)?;
        Ok(done)
    }

    /// Takes trust back from a build.
    pub fn forget(&mut self, contents: Contents) {
        self.builds.retain(|build| Contents::from_sha256(&build.sha256) != Some(contents));
    }

    /// Has a package run in processes of its own, or not any more; says whether that is new.
    pub fn isolate(&mut self, package: &str, is_isolated: bool) -> bool {
        let before = self.isolated.len();
        self.isolated.retain(|known| known.package != package);
        let was_isolated = self.isolated.len() < before;
        if is_isolated {
            self.isolated.push(IsolatedPackage { package: package.to_owned() });
        }
        was_isolated != is_isolated
    }

    /// What it says may run, and how.
    pub fn trust(&self) -> Trust {
        let mut trust = Trust::default();
        for contents in self.builds.iter().filter_map(|build| Contents::from_sha256(&build.sha256))
        {
            trust.build(contents);
        }
        for place in &self.places {
            trust.place(&place.file);
        }
        for isolated in &self.isolated {
            trust.isolate(&isolated.package);
        }
        trust
    }

    /// Adds a build, or its place.
    pub fn add(
        &mut self,
        path: &Path,
        manifest: &Manifest,
        contents: Contents,
        place: bool,
    ) -> anyhow::Result<()> {
        // Where it really lies, whatever leads there: a link may lead elsewhere tomorrow.
        let file = path
            .canonicalize()
            .with_context(|| format!("{}: its place cannot be told", path.display()))?;
        // What is not text could not be found again in the file.
        ensure!(file.to_str().is_some(), "{}: the path is not UTF-8; rename it", path.display());
        if place {
            if !self.places.iter().any(|known| known.file == file) {
                self.places.push(TrustedPlace { file });
            }
            return Ok(());
        }
        let (sha256, package) =
            (contents.to_string(), format!("{} {}", manifest.id, manifest.version));
        if !self.builds.iter().any(|known| known.sha256.eq_ignore_ascii_case(&sha256)) {
            self.builds.push(Build { sha256, package, file });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_back_and_damage_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/trust.toml");
        assert_eq!(TrustFile::read_or_new(&path).unwrap(), TrustFile::default());
        let contents = Contents::from_sha256(&"0aF".repeat(22)[..64]).unwrap();
        let plugin = folder.path().join("a.so");
        std::fs::write(&plugin, "").unwrap();
        // All at once, as programs side by side do.
        std::thread::scope(|scope| {
            for i in 0..8 {
                let (path, plugin) = (&path, &plugin);
                scope.spawn(move || {
                    let add = |list: &mut TrustFile| {
                        let own = Contents::from_sha256(&i.to_string().repeat(64)).unwrap();
                        list.add(plugin, &Manifest::default(), own, false)?;
                        list.add(plugin, &Manifest::default(), contents, i % 2 == 0)
                    };
                    TrustFile::change(path, add).unwrap();
                });
            }
        });
        let file = TrustFile::read(&path).unwrap();
        assert_eq!((file.builds.len(), file.places.len()), (9, 1));
        assert_ne!(file.trust(), Trust::default());
        let refused = |_: &mut TrustFile| -> anyhow::Result<()> { anyhow::bail!("no") };
        assert!(TrustFile::change(&path, refused).is_err());
        assert_eq!(TrustFile::read(&path).unwrap(), file);

        for (text, expected) in [
            ("", "missing field `format`"),
            ("format = 2", "expected format 1, found 2"),
            ("format = 1\nbuild = 3", "line 2: unknown field `build`"),
            ("format = 1\n[[builds]]\nsha256 = \"12\"", "expected a SHA-256 of 64"),
        ] {
            let line = TrustFile::parse(text).unwrap_err();
            assert!(line.contains(expected), "{line}");
        }
    }
}
