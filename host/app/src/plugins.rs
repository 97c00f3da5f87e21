//! `surfelshop plugins`: what is installed, what was refused and why. Runs no plugin's code.

use crate::arguments::PluginsArguments;
use crate::terminal;
use serde_json::{Value, json};
use surfelshop_api::manifest::Manifest;
use surfelshop_engine::plugins::{Entry, Origin, Place, Registry, SearchPath, State};

/// Runs the command.
pub(crate) fn run(arguments: &PluginsArguments) -> anyhow::Result<()> {
    let search = SearchPath::standard(arguments.plugin.clone());
    let registry = Registry::scan(&search);
    if arguments.json {
        return terminal::json(&json!({
            "command": "plugins",
            "version": env!("CARGO_PKG_VERSION"),
            "plugins": registry.entries().iter().map(object).collect::<Vec<_>>(),
            "searched": places(&search).map(|place| json!({
                "path": place.path.display().to_string(),
                "origin": place.origin,
                "exists": place.path.exists(),
            })).collect::<Vec<_>>(),
        }));
    }
    for entry in registry.entries() {
        terminal::line(text(entry))?;
    }
    if registry.entries().is_empty() {
        terminal::line("no plugin was found")?;
    }
    terminal::line("looked in:")?;
    for place in places(&search) {
        let missing = if place.path.exists() { "" } else { ", does not exist" };
        terminal::line(format!("  {} ({}{missing})", place.path.display(), origin(place.origin)))?;
    }
    Ok(())
}

fn places(search: &SearchPath) -> impl Iterator<Item = &Place> {
    search.folders.iter().chain(&search.files)
}

fn origin(origin: Origin) -> &'static str {
    match origin {
        Origin::BesideProgram => "beside the program",
        Origin::UserFolder => "your own plugins",
        Origin::Environment => "SURFELSHOP_PLUGINS",
        Origin::CommandLine => "--plugin",
    }
}

fn object(entry: &Entry) -> Value {
    let (state, manifest, reason) = match &entry.state {
        State::Available(manifest) => ("available", Some(manifest), None),
        State::Shadowed { manifest, by } => {
            ("shadowed", Some(manifest), Some(format!("replaced by {}", by.display())))
        }
        State::Refused(reason) => ("refused", None, Some(reason.clone())),
    };
    json!({
        "file": entry.path.display().to_string(),
        "origin": entry.origin,
        "state": state,
        "reason": reason,
        "manifest": manifest,
    })
}

fn text(entry: &Entry) -> String {
    let path = entry.path.display();
    match &entry.state {
        State::Available(manifest) => available(manifest, entry),
        State::Shadowed { manifest, by } => {
            let Manifest { id, version, .. } = manifest;
            format!("{id} {version}\n  file      {path}\n  not used  replaced by {}", by.display())
        }
        State::Refused(reason) => format!("refused: {path} {reason}"),
    }
}

fn available(manifest: &Manifest, entry: &Entry) -> String {
    let Manifest { id, version, abi_major, abi_minor, .. } = manifest;
    let mut text = format!("{id} {version}\n  file      {}", entry.path.display());
    text += &format!("\n  found     {}, ABI {abi_major}.{abi_minor}", origin(entry.origin));
    for unit in &manifest.units {
        let word = unit.kind.word();
        text += &format!("\n  {word:<9} {} ({}): {}", unit.id, unit.title, unit.summary);
    }
    text
}
