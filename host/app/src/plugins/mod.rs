//! `surfelshop plugins`: what is installed, what was refused and why, what is trusted, and how a new one
//! begins. Runs no plugin's code.

pub(crate) mod arguments;
mod installed;
mod isolated;
mod list;
mod names;
mod new;
mod pack;
mod sdk;
mod trusted;

use crate::plugins::arguments::{PluginsAction, PluginsArguments};
use anyhow::anyhow;
use std::path::Path;
use surfelshop_api::manifest::Manifest;
use surfelshop_runtime::plugins::{self, Contents};
use surfelshop_session::plugin_facts::{author, licence};

/// Runs the command.
pub(crate) fn run(arguments: &PluginsArguments) -> anyhow::Result<()> {
    match &arguments.action {
        None | Some(PluginsAction::List) => list::run(arguments),
        Some(PluginsAction::New(new)) => new::run(new, arguments.json),
        Some(PluginsAction::Sdk(sdk)) => sdk::run(sdk, arguments.json),
        Some(PluginsAction::Pack(pack)) => pack::run(arguments, pack),
        Some(PluginsAction::Trust { files, place }) => trusted::trust(arguments, files, *place),
        Some(PluginsAction::Distrust { what }) => trusted::distrust(arguments, what),
        Some(PluginsAction::Isolate { what, undo }) => isolated::run(arguments, what, *undo),
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
