//! Parts of a report: each value is from one part, with the machine that measured it.

use super::{MergeArguments, make, note_parts};
use crate::report::cells::Cell;
use crate::report::page::{self, Target};
use crate::report::parted::ReportPart;
use crate::report::verdict;
use anyhow::ensure;
use std::collections::HashMap;
use std::path::PathBuf;
use surfelshop_session::output::command_line;
use surfelshop_session::output::part_file::PartFile;
use surfelshop_session::output::terminal;

/// Merges them.
pub(super) fn merge(
    arguments: &MergeArguments,
    parts: Vec<(PathBuf, PartFile<ReportPart>)>,
) -> anyhow::Result<()> {
    let Some((_, first)) = parts.first() else { return Ok(()) };
    for (folder, part) in &parts {
        ensure!(
            part.of.reference == first.of.reference,
            "{}: {} was measured against another reference than {}; run `surfelshop {}` first, which makes one \
             for all, and then both again",
            folder.display(),
            part.part,
            first.part,
            for_all(&part.typed, part.part.of)
        );
    }
    let mut cells: HashMap<(String, String), Cell> = HashMap::new();
    for (_, part) in &parts {
        for cell in part.of.swept.all.iter().flat_map(|(_, cells)| cells) {
            let machine = Some(part.machine.clone());
            let key = (cell.knob.clone(), cell.value.clone());
            cells.insert(key, Cell { machine, ..cell.clone() });
        }
    }
    let mut swept = first.of.swept.clone();
    swept.all = Vec::with_capacity(first.of.plan.len());
    for (knob, values) in &first.of.plan {
        let known: Vec<Cell> = values
            .iter()
            .filter_map(|value| cells.remove(&(knob.clone(), value.clone())))
            .collect();
        if known.len() < values.len() {
            let n = values.len() - known.len();
            terminal::note(format!(
                "{knob}: {n} values are left out, behind ones that took too long"
            ));
        }
        swept.all.push((knob.clone(), known));
    }
    make(&arguments.out)?;
    note_parts(arguments, &parts)?;
    let target =
        Target { folder: &arguments.out, json: arguments.report.json, words: &first.typed };
    page::write(&target, &swept)?;
    verdict(&swept.all)
}

/// The command that makes the reference for all parts.
fn for_all(typed: &[String], of: u32) -> String {
    let mut words = command_line::without(typed, &["--part"]);
    words.push(format!("--part=0/{of}"));
    words.join(" ")
}
