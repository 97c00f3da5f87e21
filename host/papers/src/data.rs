//! Files that entries show: the papers' own where the user has them, else what stands in.

use crate::clouds;
use anyhow::{Context as _, anyhow, bail};
use serde::Deserialize;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use surfelshop_cloud::{Contents, ReadOptions, inspect};
use surfelshop_session::input::sample::find_sample;

/// What `data.toml` lists.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Listed {
    file: Vec<OfPaper>,
    own: Vec<Own>,
    prepared: Vec<Prepared>,
}

/// A file of a paper.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OfPaper {
    key: String,
    names: Vec<String>,
    of: String,
    /// Points it has; of probes 0.
    #[serde(default)]
    points: u64,
    /// What the paper shows where this is another model.
    #[serde(default)]
    instead_of: String,
    stand_in: String,
    /// Options with which it is drawn, where a step has none of them: from where it is seen, what is up.
    #[serde(default)]
    view: String,
}

/// A file of this program, or a cloud that it makes.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Own {
    key: String,
    of: String,
    #[serde(default)]
    asset: String,
    #[serde(default)]
    made: String,
}

/// A file that steps make of others.
#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Prepared {
    pub(crate) key: String,
    pub(crate) of: String,
    pub(crate) file: String,
    pub(crate) steps: Vec<String>,
}

/// What a name stands for.
#[derive(Clone)]
pub(crate) enum Meaning {
    /// A file that is there, and what it shows.
    File { path: PathBuf, of: String },
    /// Something to be prepared.
    Prepared(Prepared),
}

/// A name's meaning, and for what of the paper it stands in.
#[derive(Clone)]
pub(crate) struct Found {
    pub(crate) meaning: Meaning,
    pub(crate) stands_in_for: Option<String>,
    /// Options with which it is drawn.
    pub(crate) view: String,
}

/// All that entries may name.
pub(crate) struct Data {
    listed: Listed,
    /// Files of the user's folder by name.
    files: HashMap<String, PathBuf>,
    assets: PathBuf,
    made: PathBuf,
}

/// How deep folders of the user's are searched.
const DEEPEST: usize = 4;

/// Most files of the user's folder that are looked at.
const MOST_FILES: usize = 100_000;

impl Data {
    /// Looks what is there; clouds that are made are written into `made`.
    pub(crate) fn find(folder: Option<&Path>, made: &Path) -> anyhow::Result<Self> {
        let listed: Listed = toml::from_str(include_str!("entries/data.toml"))
            .context("data.toml: it is no list of files")?;
        let mut files = HashMap::new();
        if let Some(folder) = folder {
            if !folder.is_dir() {
                bail!("{}: expected a folder of models, found none", folder.display());
            }
            // From the root, so that commands can be typed in any folder.
            let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
            search(&folder, DEEPEST, &mut files)?;
        }
        let sample = find_sample()?;
        let assets = sample.parent().unwrap_or(Path::new("")).to_owned();
        let assets = std::path::absolute(&assets).unwrap_or(assets);
        Ok(Self { listed, files, assets, made: made.to_owned() })
    }

    /// What a name stands for.
    pub(crate) fn found(&self, key: &str) -> anyhow::Result<Found> {
        if let Some(file) = self.listed.file.iter().find(|file| file.key == key) {
            let path = file.names.iter().find_map(|name| self.files.get(name));
            let other = Some(file.instead_of.clone()).filter(|of| !of.is_empty());
            return match path {
                Some(path) => {
                    let (of, stands_in_for) = match file.is(path) {
                        true => (file.of.clone(), other),
                        false => (called(path), other.or_else(|| Some(file.of.clone()))),
                    };
                    let meaning = Meaning::File { path: path.clone(), of };
                    Ok(Found { meaning, stands_in_for, view: file.view.clone() })
                }
                None => {
                    let found = self.found(&file.stand_in)?;
                    Ok(Found { stands_in_for: other.or_else(|| Some(file.of.clone())), ..found })
                }
            };
        }
        let meaning = match self.listed.own.iter().find(|own| own.key == key) {
            Some(own) if own.made.is_empty() => {
                let path = self.assets.join(&own.asset);
                if !path.is_file() {
                    bail!("{}: expected {}, found no file", path.display(), own.of);
                }
                Meaning::File { path, of: own.of.clone() }
            }
            Some(own) => {
                let path = clouds::file(&own.made, &self.made)?;
                Meaning::File { path, of: own.of.clone() }
            }
            None => {
                let prepared = self.listed.prepared.iter().find(|prepared| prepared.key == key);
                let prepared = prepared.ok_or_else(|| anyhow!("no file is called `{key}`"))?;
                Meaning::Prepared(prepared.clone())
            }
        };
        Ok(Found { meaning, stands_in_for: None, view: String::new() })
    }
}

impl OfPaper {
    /// Whether a file of its name has as many points. What cannot be read is said by the step that reads it.
    fn is(&self, path: &Path) -> bool {
        let found = || inspect(path, &ReadOptions::default());
        let n_points =
            |found: Contents| found.clouds.iter().map(|cloud| cloud.n_points).sum::<u64>();
        self.points == 0 || found().is_ok_and(|found| self.points == n_points(found))
    }
}

/// What a file shows of which nothing is known but its name.
fn called(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    format!("another {}", name.display())
}

/// The files below a folder by name; of two with one name the first in the order of their paths counts.
fn search(folder: &Path, depth: usize, files: &mut HashMap<String, PathBuf>) -> anyhow::Result<()> {
    let listed = std::fs::read_dir(folder)
        .with_context(|| format!("{}: the folder cannot be read", folder.display()))?;
    let mut paths = Vec::new();
    for entry in listed {
        let entry = entry.with_context(|| format!("{}: it cannot be read", folder.display()))?;
        paths.push(entry.path());
    }
    paths.sort();
    for path in paths {
        if path.is_dir() {
            if depth > 0 {
                search(&path, depth - 1, files)?;
            }
        } else if let Some(name) = path.file_name().and_then(|name| name.to_str()) {
            if files.len() >= MOST_FILES {
                bail!("{}: expected at most {MOST_FILES} files", folder.display());
            }
            files.entry(name.to_owned()).or_insert(path);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_files_count_where_they_are_there_and_else_say_what_stands_in() {
        let folder = tempfile::tempdir().unwrap();
        let data = Data::find(None, folder.path()).unwrap();
        let found = data.found("igea").unwrap();
        assert!(found.stands_in_for.is_some_and(|of| of.contains("134,345")));
        std::fs::create_dir(folder.path().join("models")).unwrap();
        let of = |n: usize| {
            let head = "ply\nformat binary_little_endian 1.0\nelement vertex ";
            let head = format!("{head}{n}\nproperty float x\nproperty float y\nproperty float z\n");
            [format!("{head}end_header\n").into_bytes(), vec![0; 12 * n]].concat()
        };
        let igea = folder.path().join("models/igea_points.ply");
        // A file is not what its name says where it has other points.
        std::fs::write(&igea, of(3)).unwrap();
        let found = Data::find(Some(folder.path()), folder.path()).unwrap().found("igea").unwrap();
        assert!(found.stands_in_for.is_some_and(|of| of.contains("134,345")));
        assert!(
            matches!(found.meaning, Meaning::File { of, .. } if of == "another igea_points.ply")
        );
        std::fs::write(&igea, of(134_345)).unwrap();
        let data = Data::find(Some(folder.path()), folder.path()).unwrap();
        let found = data.found("igea").unwrap();
        assert!(found.stands_in_for.is_none());
        // Another model stands in, whosever it is.
        std::fs::write(folder.path().join("models/horse_points.ply"), "ply").unwrap();
        for user in [None, Some(folder.path())] {
            let found = Data::find(user, folder.path()).unwrap().found("gnome").unwrap();
            assert_eq!(found.stands_in_for.as_deref(), Some("the Gnome, 54,772 points"));
        }
        assert!(
            matches!(found.meaning, Meaning::File { path, .. } if path.ends_with("igea_points.ply"))
        );
        assert!(data.found("nothing").is_err());
    }

    #[test]
    fn whatever_stands_in_exists() {
        let folder = tempfile::tempdir().unwrap();
        let data = Data::find(None, folder.path()).unwrap();
        for file in &data.listed.file {
            data.found(&file.key).unwrap();
        }
        for prepared in &data.listed.prepared {
            data.found(&prepared.key).unwrap();
        }
    }

    /// Costs 0.2 s.
    #[test]
    fn clouds_that_are_made_have_as_many_surfels_as_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let data = Data::find(None, folder.path()).unwrap();
        for own in data.listed.own.iter().filter(|own| !own.made.is_empty()) {
            let file = clouds::file(&own.made, folder.path()).unwrap();
            let bytes = std::fs::read(file).unwrap();
            let head = String::from_utf8_lossy(&bytes[..bytes.len().min(4096)]).into_owned();
            let line = head.lines().find_map(|line| line.strip_prefix("element vertex "));
            let n: u64 = line.unwrap().trim().parse().unwrap();
            let said = own.of.split(' ').map(|word| word.replace(',', ""));
            let said: Vec<u64> = said.filter_map(|word| word.parse().ok()).collect();
            assert_eq!(said, [n], "{}", own.of);
        }
    }
}
