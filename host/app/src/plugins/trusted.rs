//! `surfelshop plugins trust` and `distrust`.

use super::{inspected, named};
use crate::plugins::arguments::PluginsArguments;
use anyhow::bail;
use serde_json::json;
use std::path::{Path, PathBuf};
use surfelshop_session::output::terminal;
use surfelshop_session::trust_file::TrustFile;

/// Fewer digits of a SHA-256 are a slip rather than a name.
const LEAST_DIGITS: usize = 8;

/// Lets plugins run from now on.
pub(super) fn trust(
    arguments: &PluginsArguments,
    files: &[PathBuf],
    place: bool,
) -> anyhow::Result<()> {
    let path = TrustFile::path(arguments.trust_file.as_deref())?;
    let told = TrustFile::change(&path, |list| {
        let mut told = Vec::new();
        for file in files {
            // A link is resolved once: what is looked at is what is trusted.
            let lies = file.canonicalize().unwrap_or_else(|_| file.clone());
            let (manifest, contents) = inspected(&lies)?;
            list.add(&lies, &manifest, contents, place)?;
            let what = if place { "whatever is built there" } else { "this build" };
            told.push((file, named(&manifest), contents, what));
        }
        Ok(told)
    })?;
    if arguments.json {
        return terminal::json(&json!({
            "command": "plugins trust",
            "list": path.display().to_string(),
            "trusted": told.iter().map(|(file, package, contents, _)| json!({
                "file": file.display().to_string(),
                "package": package,
                "sha256": contents.to_string(),
                "place": place,
            })).collect::<Vec<_>>(),
        }));
    }
    for (file, package, contents, what) in told {
        terminal::line(format!("{package}\n  file      {}", file.display()))?;
        terminal::line(format!("  sha256    {contents}\n  trusted   {what}"))?;
    }
    terminal::line(format!("written to {}", path.display()))
}

/// Takes trust back.
pub(super) fn distrust(arguments: &PluginsArguments, what: &[String]) -> anyhow::Result<()> {
    let path = TrustFile::path(arguments.trust_file.as_deref())?;
    let n_all = TrustFile::change(&path, |list| {
        what.iter().try_fold(0, |n_all, text| match take_back(list, text) {
            0 => bail!("{text}: {} trusts no such file, build or place", path.display()),
            n => Ok(n_all + n),
        })
    })?;
    if arguments.json {
        return terminal::json(&json!({
            "command": "plugins distrust",
            "list": path.display().to_string(),
            "removed": n_all,
        }));
    }
    terminal::line(format!("{n_all} removed from {}", path.display()))
}

/// Removes what a file or the digits of a build name; says how many entries that were.
fn take_back(list: &mut TrustFile, text: &str) -> usize {
    let before = list.builds.len() + list.places.len();
    // Different ways may lead to one file, and one that is gone still has a name.
    let resolved = |path: &Path| {
        let absolute = || std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        path.canonicalize().unwrap_or_else(|_| absolute())
    };
    let file = resolved(Path::new(text));
    let now = inspected(Path::new(text)).ok().map(|(_, contents)| contents);
    let digits = text.len() >= LEAST_DIGITS && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    let prefix = digits.then(|| text.to_ascii_lowercase());
    if let Some(now) = now {
        list.forget(now);
    }
    list.builds.retain(|build| {
        let sha256 = build.sha256.to_ascii_lowercase();
        let by_digits = prefix.as_ref().is_some_and(|prefix| sha256.starts_with(prefix));
        !by_digits && resolved(&build.file) != file
    });
    list.places.retain(|place| resolved(&place.file) != file);
    before - list.builds.len() - list.places.len()
}
