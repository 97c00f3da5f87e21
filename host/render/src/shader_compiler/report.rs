//! The composer's reports of many lines, in one.

use surfelshop_api::graph::Module;
use thiserror::Error;

/// What the text of a pass is called.
pub(super) const OWN_FILE: &str = "shader";

/// Why WGSL was refused.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{message}")]
pub(crate) struct ShaderError {
    /// One line: where and what.
    pub(crate) message: String,
}

impl ShaderError {
    pub(crate) fn new(message: impl Into<String>) -> Self {
        Self { message: message.into() }
    }

    /// The same with the name of the file in front whose function it names, where it names one
    /// without a line.
    pub(super) fn in_file(self, modules: &[Module]) -> Self {
        let named = |module: &&Module| {
            let function = format!("'{}::", module.path);
            self.message.contains(&function) && !self.message.contains(&module.file)
        };
        match modules.iter().find(named) {
            Some(module) => Self::new(format!("{}: {}", module.file, self.message)),
            None => self,
        }
    }
}

/// The composer's many-line report as one line: `line 3: what (token)`. A line was put before some files.
pub(super) fn one_line(report: &str, shifted_files: &[&str]) -> ShaderError {
    let what = report.lines().next().unwrap_or_default().trim_start_matches("error: ").trim();
    let place = place_in(report, shifted_files);
    let note = report
        .lines()
        .find_map(|line| line.trim_start().strip_prefix("= "))
        .map(str::trim)
        .filter(|note| !what.contains(note) && !note.contains(what))
        .map(|note| format!(" ({note})"))
        .unwrap_or_default();
    ShaderError::new(format!("{place}{what}{note}"))
}

/// Where the composer's report says that something is: `line 3: `.
fn place_in(report: &str, shifted_files: &[&str]) -> String {
    report
        .lines()
        .find_map(|line| line.trim_start().strip_prefix("┌─ "))
        .and_then(|place| {
            let (file, line) = place.rsplit_once(':')?.0.rsplit_once(':')?;
            let above = u32::from(shifted_files.contains(&file));
            let line = line.parse::<u32>().ok()?.saturating_sub(above);
            // The pass's own text has no name but the pass's.
            let file = if file == OWN_FILE { String::new() } else { format!("{file}, ") };
            Some(format!("{file}line {line}: "))
        })
        .unwrap_or_default()
}
