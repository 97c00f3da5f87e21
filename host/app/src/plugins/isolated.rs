//! `surfelshop plugins isolate`: which libraries run in processes of their own.

use super::inspected;
use crate::plugins::arguments::PluginsArguments;
use anyhow::ensure;
use serde_json::json;
use std::path::Path;
use surfelshop_runtime::plugins::is_package_id;
use surfelshop_session::options::is_plugin_file;
use surfelshop_session::output::terminal;
use surfelshop_session::plugin_facts::ISOLATED;
use surfelshop_session::trust_file::TrustFile;

/// Has packages run in processes of their own from now on, or in the program again.
pub(super) fn run(arguments: &PluginsArguments, what: &[String], undo: bool) -> anyhow::Result<()> {
    ensure!(
        cfg!(unix) || undo,
        "plugins isolate: processes of their own for plugins need a Unix system"
    );
    let packages = what.iter().map(|text| package(text)).collect::<anyhow::Result<Vec<_>>>()?;
    let path = TrustFile::path(arguments.trust_file.as_deref())?;
    TrustFile::change(&path, |list| {
        for package in &packages {
            let is_new = list.isolate(package, !undo);
            ensure!(is_new || !undo, "{package}: {} isolates no such package", path.display());
        }
        Ok(())
    })?;
    if arguments.json {
        return terminal::json(&json!({
            "command": "plugins isolate",
            "list": path.display().to_string(),
            "isolated": !undo,
            "packages": packages,
        }));
    }
    let how = if undo { "in the program" } else { ISOLATED };
    for package in packages {
        terminal::line(format!("{package} runs {how} from its next start on"))?;
    }
    terminal::line(format!("written to {}", path.display()))
}

/// The package that was typed, or that of the file.
fn package(text: &str) -> anyhow::Result<String> {
    if is_plugin_file(text) {
        return Ok(inspected(Path::new(text))?.0.id);
    }
    ensure!(
        is_package_id(text),
        "{text}: expected the id of a package, as in org.example.rim, or a plugin file"
    );
    Ok(text.to_owned())
}
