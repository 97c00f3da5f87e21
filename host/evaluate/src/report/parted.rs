//! A part of a report: some of its values, measured in a folder of its own against a reference that parts share.

use super::Stamp;
use super::cells::{Fingerprint, ResultsFile};
use super::knobs::Knob;
use super::page::Swept;
use crate::report::ReportArguments;
use anyhow::Context as _;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use surfelshop_session::options::part::Part;
use surfelshop_session::output::digest::FileDigest;
use surfelshop_session::output::machine::Machine;
use surfelshop_session::output::part_file::{PartFile, PartStart};
use surfelshop_session::output::terminal;

/// The folder of the reference that parts share, in that of the report.
const REFERENCE: &str = "reference";

/// The name of the command in files of parts.
pub(crate) const COMMAND: &str = "report";

/// A knob and its values.
type PlannedKnob = (String, Vec<String>);

/// What a part leaves behind.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct ReportPart {
    /// Its values.
    pub(crate) swept: Swept,
    /// The values of all parts, in their order.
    pub(crate) plan: Vec<PlannedKnob>,
    /// What tells the reference from others; none where it is a file.
    pub(crate) reference: Vec<Fingerprint>,
}

/// The folder in which a report keeps what it measures, made.
pub(super) fn folder(arguments: &ReportArguments) -> anyhow::Result<PathBuf> {
    let folder = match arguments.part {
        None => arguments.out.clone(),
        Some(Part { number: 0, .. }) => arguments.out.join(REFERENCE),
        Some(part) => arguments.out.join(part.folder()),
    };
    std::fs::create_dir_all(&folder)
        .with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
    Ok(folder)
}

/// What is known of a report.
pub(super) struct Known {
    /// Of its values.
    pub(super) cells: ResultsFile,
    /// Of the reference, where another part made it.
    shared: Option<ResultsFile>,
}

impl Known {
    /// Opens what was measured earlier; `key` says what numbers depend on, besides a device.
    pub(super) fn open(
        arguments: &ReportArguments,
        device: &str,
        key: impl Fn(&str) -> anyhow::Result<String>,
    ) -> anyhow::Result<Self> {
        let folder = folder(arguments)?;
        let Some(part) = arguments.part else {
            return Ok(Self { cells: ResultsFile::open(&folder, &key(device)?)?, shared: None });
        };
        // The reference is the same on all machines.
        let of_all = key("")?;
        if part.number == 0 {
            return Ok(Self { cells: ResultsFile::open(&folder, &of_all)?, shared: None });
        }
        let shared = ResultsFile::shared(&arguments.out.join(REFERENCE), &of_all)?;
        // Times of two machines are never in one part.
        let machine = Machine::this(device).to_string();
        Ok(Self { cells: ResultsFile::open(&folder, &key(&machine)?)?, shared })
    }

    /// What is known of the reference.
    pub(super) fn reference(&self) -> &ResultsFile {
        self.shared.as_ref().unwrap_or(&self.cells)
    }
}

/// The values of a part, of all.
pub(super) fn own(part: Option<Part>, knobs: Vec<Knob>) -> Vec<Knob> {
    let Some(part) = part else { return knobs };
    let mut piece = 0;
    let mut own = |_value: &String| {
        piece += 1;
        part.takes(piece - 1)
    };
    let values = |Knob { id, values }: Knob| {
        let values = values.into_iter().filter(&mut own).collect();
        Knob { id, values }
    };
    knobs.into_iter().map(values).collect()
}

/// What the parts of a report are of.
pub(super) struct Whole<'a> {
    pub(super) arguments: &'a ReportArguments,
    /// Everything that numbers depend on besides files, device and values.
    pub(super) options: String,
    pub(super) files: &'a [Stamp],
    pub(super) units: &'a [(String, Stamp)],
    pub(super) plan: Vec<PlannedKnob>,
    pub(super) started: PartStart,
}

impl Whole<'_> {
    /// All values in their order.
    pub(super) fn plan(knobs: &[Knob]) -> Vec<PlannedKnob> {
        knobs.iter().map(|knob| (knob.id.clone(), knob.values.clone())).collect()
    }

    /// Writes what a part leaves behind.
    pub(super) fn write(self, part: Part, known: &Known, swept: Swept) -> anyhow::Result<()> {
        let arguments = self.arguments;
        let folder = folder(arguments)?;
        if part.number == 0 {
            return terminal::line(format!("{}: the reference", folder.display()));
        }
        if known.shared.is_none() && !known.cells.truth_sums().is_empty() {
            terminal::note(format!(
                "{part} made a reference of its own; `--part 0/{}` makes one for all parts",
                part.of
            ));
        }
        let stamps = self.files.iter().chain(self.units.iter().map(|(_, stamp)| stamp));
        let inputs = FileDigest::of_all(stamps.map(|(path, ..)| Path::new(path)))?;
        let options = serde_json::to_string(&(
            &self.options,
            &self.plan,
            arguments.repeats,
            arguments.longest.as_secs_f64(),
        ))?;
        let machine = Machine::this(swept.device.clone());
        let reference = known.reference().truth_sums();
        let of = ReportPart { swept, plan: self.plan, reference };
        let file = PartFile::new((COMMAND, part), (options, inputs), (machine, self.started), of);
        file.write(&folder)?;
        match arguments.report.json {
            true => terminal::json(&file),
            false => terminal::line(format!("{}: {}", folder.display(), file.line())),
        }
    }
}
