//! `surfelshop plugins list`: what is installed, whether it may run, and what was refused and why.

use super::named;
use crate::plugins::arguments::PluginsArguments;
use serde_json::{Value, json};
use surfelshop_api::UnitKind;
use surfelshop_api::format::Recognition;
use surfelshop_api::manifest::Manifest;
use surfelshop_runtime::plugins::{Entry, Origin, Place, Registry, SearchPath, State};
use surfelshop_session::output::terminal;
use surfelshop_session::plugin_facts::{ISOLATED, api_range, author_of, licence, preview, trusted};
use surfelshop_session::trust_file::TrustFile;

/// Runs the command.
pub(crate) fn run(arguments: &PluginsArguments) -> anyhow::Result<()> {
    let list = TrustFile::named(arguments.trust_file.as_deref())?;
    let search = SearchPath::standard(arguments.plugin.clone(), list.trust());
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
        State::Waiting { manifest, meanwhile } => (
            "waiting",
            Some(manifest),
            Some(format!("not trusted; {} is used", meanwhile.display())),
        ),
        State::Refused(reason) => ("refused", None, Some(reason.clone())),
    };
    json!({
        "file": entry.path.display().to_string(),
        "leads_to": entry.file.display().to_string(),
        "origin": entry.origin,
        "state": state,
        "reason": reason,
        "sha256": entry.contents().to_string(),
        "trust": entry.trust,
        "isolated": entry.is_isolated(),
        "preview": preview(entry).map(|preview| preview.display().to_string()),
        "manifest": manifest,
    })
}

fn text(entry: &Entry) -> String {
    let path = entry.path.display();
    match &entry.state {
        State::Available(manifest) => available(manifest, entry),
        State::Shadowed { manifest, by } => {
            let by = by.display();
            format!("{}\n  file      {path}\n  not used  replaced by {by}", named(manifest))
        }
        State::Waiting { manifest, meanwhile } => {
            let meanwhile = meanwhile.display();
            format!(
                "{}\n  not used  until it is trusted; meanwhile {meanwhile} is",
                available(manifest, entry)
            )
        }
        State::Refused(reason) => format!("refused: {path} {reason}"),
    }
}

fn available(manifest: &Manifest, entry: &Entry) -> String {
    let Manifest { id, version, .. } = manifest;
    let mut text = format!("{id} {version}");
    let mut row = |what: &str, is: &str| text += &format!("\n  {what:<9} {is}");
    row("file", &entry.path.display().to_string());
    let is_link = std::path::absolute(&entry.path).is_ok_and(|path| path != entry.file);
    if is_link {
        row("leads to", &entry.file.display().to_string());
    }
    row("sha256", &entry.contents().to_string());
    row("found", origin(entry.origin));
    row("trusted", trusted(entry.trust));
    if entry.is_isolated() {
        row("runs", ISOLATED);
    }
    row("api", &api_range(manifest));
    if let Some(preview) = preview(entry) {
        row("preview", &preview.display().to_string());
    }
    row("by", &author_of(manifest, entry.trust));
    row("licence", licence(manifest));
    for unit in &manifest.units {
        row(unit.kind.word(), &format!("{} ({}): {}", unit.id, unit.title, unit.summary));
        if unit.kind == UnitKind::Format {
            row("files", &files(&unit.files));
        }
    }
    text
}

/// The endings of a format's files, and whether it writes them: `.las, .laz; read and written`.
fn files(files: &Recognition) -> String {
    let ending = |ending: &String| match ending.contains('.') {
        // Which may be the whole name of a file.
        true => ending.clone(),
        false => format!(".{ending}"),
    };
    let endings = files.endings.iter().map(ending).collect::<Vec<_>>();
    let endings = if endings.is_empty() { "of any name".to_owned() } else { endings.join(", ") };
    let written = if files.written { "read and written" } else { "read" };
    let several = if files.several { ", scans apart" } else { "" };
    let grids = if files.grid { ", grids" } else { "" };
    let beside = match files.beside.is_empty() {
        true => String::new(),
        false => format!("; opens {} beside it", files.beside.join(", ")),
    };
    format!("{endings}; {written}{several}{grids}{beside}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_formats_are_said_in_a_row() {
        let mut las = Recognition {
            endings: vec!["las".to_owned(), "laz".to_owned()],
            ..Recognition::default()
        };
        assert_eq!(files(&las), ".las, .laz; read");
        (las.written, las.several) = (true, true);
        assert_eq!(files(&las), ".las, .laz; read and written, scans apart");
        las.grid = true;
        assert_eq!(files(&las), ".las, .laz; read and written, scans apart, grids");
        assert_eq!(files(&Recognition::default()), "of any name; read");
        let potree = Recognition {
            endings: vec!["metadata.json".to_owned()],
            beside: vec!["hierarchy.bin".to_owned(), "*.bin".to_owned()],
            ..Recognition::default()
        };
        assert_eq!(files(&potree), "metadata.json; read; opens hierarchy.bin, *.bin beside it");
    }
}
