//! `surfelshop plugins add` and `remove`: the user's own folder.

use super::{inspected, named};
use crate::plugins::arguments::PluginsArguments;
use anyhow::{Context as _, anyhow, bail, ensure};
use serde_json::json;
use std::env::consts::DLL_SUFFIX;
use std::path::{Path, PathBuf};
use surfelshop_api::manifest::Manifest;
use surfelshop_runtime::plugins::{
    self, Contents, Entry, Origin, Place, Registry, SearchPath, is_module, user_plugins_folder,
};
use surfelshop_session::output::{files, terminal};
use surfelshop_session::trust_file::TrustFile;

fn folder() -> anyhow::Result<PathBuf> {
    user_plugins_folder().ok_or_else(|| {
        anyhow!(
            "this system names no folder for your own plugins (HOME is not set); use --plugin FILE"
        )
    })
}

/// Copies plugins into the user's folder, and trusts those that need it.
pub(super) fn add(arguments: &PluginsArguments, given: &[PathBuf]) -> anyhow::Result<()> {
    let folder = folder()?;
    std::fs::create_dir_all(&folder)
        .with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
    let list_path = TrustFile::path(arguments.trust_file.as_deref())?;
    // Everything is judged before anything is copied.
    let mut wanted: Vec<(&PathBuf, PathBuf, Manifest, Contents)> = Vec::new();
    for file in given {
        let (manifest, contents) = inspected(file)?;
        let target = folder.join(file.file_name().unwrap_or_default());
        ensure!(
            plugins::has_library_extension(&target),
            "{}: expected a name that ends in {DLL_SUFFIX}, which every start looks for; rename it",
            file.display()
        );
        if let Some((other, ..)) = wanted.iter().find(|(_, taken, ..)| *taken == target) {
            bail!("{} and {} have one name; rename one", other.display(), file.display());
        }
        if let Ok((there, _)) = plugins::inspect(&target)
            && there.id != manifest.id
        {
            bail!(
                "{}: {} has that name in {} already; rename the file, or `surfelshop plugins remove` that",
                file.display(),
                there.id,
                folder.display()
            );
        }
        wanted.push((file, target, manifest, contents));
    }
    let added = TrustFile::change(&list_path, |list| {
        for (file, target, manifest, contents) in &wanted {
            let bytes = files::read_short(file, plugins::MAX_FILE_LEN)?;
            files::write_whole(target, &bytes)?;
            let (_, copied) = inspected(target)?;
            ensure!(copied == *contents, "{}: the file changed meanwhile", file.display());
            // A module runs in a sandbox, and needs no trust.
            if !is_module(&bytes) {
                list.add(target, manifest, *contents, false)?;
            }
        }
        Ok(wanted.into_iter().map(|(_, target, manifest, _)| (target, manifest)))
    })?;
    let added: Vec<(PathBuf, Manifest)> = added.collect();
    if arguments.json {
        return terminal::json(&json!({
            "command": "plugins add",
            "added": added.iter().map(|(file, manifest)| json!({
                "file": file.display().to_string(),
                "manifest": manifest,
            })).collect::<Vec<_>>(),
        }));
    }
    for (file, manifest) in added {
        let units = manifest.units.iter().map(|unit| format!("{} {}", unit.kind.word(), unit.id));
        let units = units.collect::<Vec<_>>().join(", ");
        terminal::line(format!("{}: {units}\n  file      {}", named(&manifest), file.display()))?;
    }
    Ok(())
}

/// Removes plugins from the user's folder.
pub(super) fn remove(arguments: &PluginsArguments, what: &[String]) -> anyhow::Result<()> {
    let folder = folder()?;
    let folders = vec![Place::new(&folder, Origin::UserFolder)];
    let registry = Registry::scan(&SearchPath { folders, ..SearchPath::default() });
    let mut removed = Vec::new();
    for text in what {
        let is_meant = |entry: &&Entry| {
            let package = entry.manifest().is_some_and(|manifest| manifest.id == *text);
            let file = entry.path.file_name() == Path::new(text).file_name();
            package
                || file && (Path::new(text).components().count() == 1 || same(&entry.path, text))
        };
        let meant: Vec<&Entry> = registry.entries().iter().filter(is_meant).collect();
        if meant.is_empty() {
            bail!("{text}: there is no such plugin in {}", folder.display());
        }
        removed.extend(meant.into_iter().map(|entry| entry.path.clone()));
    }
    removed.sort();
    removed.dedup();
    let list_path = TrustFile::path(arguments.trust_file.as_deref())?;
    TrustFile::change(&list_path, |list| {
        for path in &removed {
            let contents = Contents::of_file(path);
            std::fs::remove_file(path)
                .with_context(|| format!("{}: cannot be removed", path.display()))?;
            // What is gone is trusted no more, wherever a copy of it may lie.
            list.forget(contents);
        }
        Ok(())
    })?;
    let removed: Vec<String> = removed.iter().map(|path| path.display().to_string()).collect();
    if arguments.json {
        return terminal::json(&json!({ "command": "plugins remove", "removed": removed }));
    }
    terminal::line(format!("removed {}", removed.join(", ")))
}

fn same(path: &Path, text: &str) -> bool {
    path.canonicalize().ok().is_some_and(|path| Path::new(text).canonicalize().ok() == Some(path))
}
