//! `surfelshop plugins add` and `remove`: the user's own folder.

use super::pack::archive::{Packed, is_pack};
use super::{inspected, named};
use crate::plugins::arguments::PluginsArguments;
use anyhow::{Context as _, anyhow, bail, ensure};
use serde_json::json;
use std::env::consts::DLL_SUFFIX;
use std::path::{Path, PathBuf};
use surfelshop_api::manifest::Manifest;
use surfelshop_runtime::plugins::{
    self, Contents, Entry, Origin, Place, Registry, SearchPath, State, is_module,
    user_plugins_folder,
};
use surfelshop_session::output::{files, terminal};
use surfelshop_session::plugin_facts::packed_with;
use surfelshop_session::trust_file::TrustFile;

fn folder() -> anyhow::Result<PathBuf> {
    user_plugins_folder().ok_or_else(|| {
        anyhow!(
            "this system names no folder for your own plugins (HOME is not set); use --plugin FILE"
        )
    })
}

/// A plugin that is to be copied.
struct NewPlugin {
    /// The file that was named.
    file: PathBuf,
    target: PathBuf,
    manifest: Manifest,
    from: From,
}

/// What a plugin is copied from.
enum From {
    /// A file of these contents.
    File(Contents),
    Pack(Packed),
}

impl NewPlugin {
    /// # Errors
    /// One line where a file is neither a plugin nor a packed one.
    fn new(file: &Path, folder: &Path) -> anyhow::Result<Self> {
        if !is_pack(file) {
            let (manifest, contents) = inspected(file)?;
            let target = folder.join(file.file_name().unwrap_or_default());
            let from = From::File(contents);
            return Ok(Self { file: file.to_owned(), target, manifest, from });
        }
        let pack = Packed::read(file)?;
        let manifest = plugins::inspect_bytes(&pack.module)
            .map_err(|refused| anyhow!("{}: its {} {refused}", file.display(), pack.name))?;
        Ok(Self {
            file: file.to_owned(),
            target: folder.join(&pack.name),
            manifest,
            from: From::Pack(pack),
        })
    }

    /// Copies it.
    fn put(&self, list: &mut TrustFile) -> anyhow::Result<()> {
        let Self { file, target, manifest, from } = self;
        let contents = match from {
            From::File(contents) => contents,
            From::Pack(pack) => {
                let beside = packed_with(target);
                std::fs::create_dir_all(&beside)
                    .with_context(|| format!("{}: the folder cannot be made", beside.display()))?;
                for (name, bytes) in pack.texts() {
                    files::write_whole(&beside.join(name), bytes)?;
                }
                return files::write_whole(target, &pack.module);
            }
        };
        let bytes = files::read_short(file, plugins::MAX_FILE_LEN)?;
        files::write_whole(target, &bytes)?;
        let (_, copied) = inspected(target)?;
        ensure!(copied == *contents, "{}: the file changed meanwhile", file.display());
        // A module runs in a sandbox, and needs no trust.
        if !is_module(&bytes) {
            list.add(target, manifest, *contents, false)?;
        }
        Ok(())
    }
}

/// Copies plugins into the user's folder, and trusts those that need it.
pub(super) fn add(arguments: &PluginsArguments, given: &[PathBuf]) -> anyhow::Result<()> {
    let folder = folder()?;
    std::fs::create_dir_all(&folder)
        .with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
    let list_path = TrustFile::path(arguments.trust_file.as_deref())?;
    // Everything is judged before anything is copied.
    let mut all: Vec<NewPlugin> = Vec::new();
    for file in given {
        let new = NewPlugin::new(file, &folder)?;
        ensure!(
            plugins::has_library_extension(&new.target),
            "{}: expected a name that ends in {DLL_SUFFIX}, which every start looks for; rename it",
            file.display()
        );
        if let Some(other) = all.iter().find(|other| other.target == new.target) {
            bail!("{} and {} have one name; rename one", other.file.display(), file.display());
        }
        if let Ok((there, _)) = plugins::inspect(&new.target)
            && there.id != new.manifest.id
        {
            bail!(
                "{}: {} has that name in {} already; rename the file, or `surfelshop plugins remove` that",
                file.display(),
                there.id,
                folder.display()
            );
        }
        all.push(new);
    }
    TrustFile::change(&list_path, |list| all.iter().try_for_each(|one| one.put(list)))?;
    let added = all.into_iter().map(|one| (one.target, one.manifest));
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
        if let Some(by) = shadowed(&file, arguments)? {
            terminal::line(format!(
                "  not used  {} has the same package; `--plugin {}` uses this one",
                by.display(),
                file.display()
            ))?;
        }
    }
    Ok(())
}

/// The plugin of the same package that is used instead of one in the user's folder.
fn shadowed(file: &Path, arguments: &PluginsArguments) -> anyhow::Result<Option<PathBuf>> {
    let list = TrustFile::named(arguments.trust_file.as_deref())?;
    let registry = Registry::scan(&SearchPath::standard(Vec::new(), list.trust()));
    let entry = registry.entries().iter().find(|entry| entry.path == file);
    Ok(entry.and_then(|entry| match &entry.state {
        State::Shadowed { by, .. } => Some(by.clone()),
        _ => None,
    }))
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
            let beside = packed_with(path);
            if beside.is_dir() {
                std::fs::remove_dir_all(&beside)
                    .with_context(|| format!("{}: cannot be removed", beside.display()))?;
            }
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
