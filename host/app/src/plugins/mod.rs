//! `surfelshop plugins`: what is installed, what was refused and why, what is trusted, and how a new one
//! begins. Runs no plugin's code.

mod installed;
mod list;
mod new;
mod trust_file;
mod trusted;

use crate::arguments::{PluginsAction, PluginsArguments};
use anyhow::anyhow;
pub(crate) use list::trusted;
use std::path::Path;
use surfelshop_api::manifest::Manifest;
use surfelshop_engine::plugins::{self, Contents};

pub(crate) use trust_file::TrustFile;

/// Runs the command.
pub(crate) fn run(arguments: &PluginsArguments) -> anyhow::Result<()> {
    match &arguments.action {
        None | Some(PluginsAction::List) => list::run(arguments),
        Some(PluginsAction::New(new)) => new::run(new, arguments.json),
        Some(PluginsAction::Trust { files, place }) => trusted::trust(arguments, files, *place),
        Some(PluginsAction::Distrust { what }) => trusted::distrust(arguments, what),
        Some(PluginsAction::Add { files }) => installed::add(arguments, files),
        Some(PluginsAction::Remove { what }) => installed::remove(arguments, what),
    }
}

/// What a plugin file says of itself, and its contents; a file that is no plugin is a failure.
fn inspected(path: &Path) -> anyhow::Result<(Manifest, Contents)> {
    plugins::inspect(path).map_err(|refused| anyhow!("{} {refused}", path.display()))
}

/// A plugin in a line: `org.example.rim 0.1.0 by A. Author (MIT)`.
fn named(manifest: &Manifest) -> String {
    let Manifest { id, version, .. } = manifest;
    format!("{id} {version} by {} ({})", author(manifest), licence(manifest))
}

/// Who made a plugin.
pub(crate) fn author(manifest: &Manifest) -> String {
    // As Cargo joins them.
    let authors = manifest.authors.replace(':', ", ");
    if authors.is_empty() { "nobody named".to_owned() } else { authors }
}

/// Under which licence a plugin is.
pub(crate) fn licence(manifest: &Manifest) -> &str {
    if manifest.license.is_empty() { "none named" } else { &manifest.license }
}

/// Which hosts a plugin works in.
pub(crate) fn api_range(manifest: &Manifest) -> String {
    let Manifest { api, abi_major: major, abi_minor: minor, .. } = manifest;
    let next = u32::from(*major) + 1;
    // C has no version of the crate.
    let of = if api.is_empty() { String::new() } else { format!("{api}, ") };
    format!("{of}for hosts of ABI {major}.{minor} and later, before {next}.0")
}
