//! `surfelshop papers`: the figures, tables and errata of three papers, made again and measured.
//!
//! What a paper shows is an *entry* of a TOML file in `entries`: where it is printed, what it says, the
//! commands of this program that make it, and which numbers are measured. [`run`] makes what is not made
//! yet, a folder for each entry, and writes the pages from what lies there. Formulas that no renderer has,
//! since they are wrong as printed, are evaluated by `computed`.
//!
//! Invariants: an entry's folder appears whole or not at all; what was made of other data, options or
//! builds counts for nothing; a page is made of the folders alone, so the same folders make the same page;
//! no page asks anything of a network.

#![allow(
    clippy::missing_errors_doc,
    reason = "errors are lines for the user, as in the crate that measures"
)]

mod arguments;
mod clouds;
mod commands;
mod computed;
mod data;
pub mod effects;
pub mod entries;
mod gallery;
mod harvest;
pub mod outcome;
mod page;
mod passes;
mod steps;
mod work;

pub use arguments::{PaperChoice, PapersArguments};
pub use steps::RunCommand;

use anyhow::{Context as _, bail};
use entries::{Entry, Paper};
use outcome::Made;
use serde_json::json;
use surfelshop_session::interrupt;
use surfelshop_session::output::files::write_whole;
use surfelshop_session::output::terminal;
use work::Work;

/// Runs the command; `command` runs the steps of entries.
pub fn run(arguments: &PapersArguments, command: RunCommand<'_>) -> anyhow::Result<()> {
    let papers = entries::papers()?;
    let chosen: Vec<&Paper> =
        papers.iter().filter(|paper| arguments.has_paper(&paper.id)).collect();
    let is_chosen = |entry: &&Entry| match arguments.only.is_empty() {
        true => arguments.gallery.is_none() || !entry.gallery.is_empty(),
        false => arguments.has_entry(&entry.id),
    };
    check_names(arguments, &chosen)?;
    if arguments.list {
        return list(arguments, &chosen);
    }
    let out = arguments.folder();
    std::fs::create_dir_all(out)
        .with_context(|| format!("{}: the folder cannot be made", out.display()))?;
    let mut work = Work::open(arguments, command)?;
    let n_all = chosen.iter().flat_map(|paper| paper.entry.iter().filter(is_chosen)).count();
    let mut n_done = 0;
    let mut failures = Vec::new();
    let mut made: Vec<(&Paper, Vec<Made<'_>>)> = Vec::new();
    for paper in &chosen {
        let mut of_paper = Vec::new();
        for entry in paper.entry.iter().filter(is_chosen) {
            n_done += 1;
            if arguments.part.is_some_and(|part| !part.takes(n_done - 1)) {
                continue;
            }
            let made = make(&mut work, paper, entry);
            // A step that stopped in order is no failure of its entry: the same command goes on there.
            if interrupt::was_asked() {
                bail!("cancelled; start the same command again to go on");
            }
            if !arguments.report.json {
                terminal::line(progress(n_done, n_all, paper, &made))?;
            }
            if let Err(line) = &made.outcome {
                failures.push(format!("{} of {}: {line}", entry.id, paper.id));
            }
            of_paper.push(made);
        }
        made.push((paper, of_paper));
    }
    let object = outcome::object(&made);
    let mut written = Vec::new();
    if arguments.part.is_none() {
        written = page::write(arguments, &made)?;
        write_whole(&out.join("papers.json"), serde_json::to_string_pretty(&object)?.as_bytes())?;
    }
    if let Some(folder) = &arguments.gallery {
        written.extend(gallery::write(folder, &made)?);
    }
    if arguments.report.json {
        terminal::json(&json!({ "command": "papers", "pages": written, "papers": object }))?;
    } else {
        written.iter().try_for_each(terminal::line)?;
    }
    match failures.split_first() {
        None => Ok(()),
        Some((first, more)) => {
            more.iter().for_each(terminal::note);
            bail!("{first}")
        }
    }
}

/// Refuses names that no entry has.
fn check_names(arguments: &PapersArguments, chosen: &[&Paper]) -> anyhow::Result<()> {
    let known = |id: &String| {
        chosen.iter().any(|paper| paper.entry.iter().any(|entry| entry.is_called(id)))
    };
    if let Some(unknown) = arguments.only.iter().find(|id| !known(id)) {
        bail!(
            "there is no figure, table or erratum `{unknown}`; `surfelshop papers --list` names all"
        );
    }
    Ok(())
}

/// Makes an entry, or finds it.
fn make<'e>(work: &mut Work<'_>, paper: &Paper, entry: &'e Entry) -> Made<'e> {
    let outcome = work.outcome(paper, entry);
    let found = outcome.and_then(|outcome| Ok((effects::of(entry, &outcome)?, outcome)));
    match found {
        Ok((effect, outcome)) => Made { entry, outcome: Ok(outcome), effect },
        Err(error) => Made { entry, outcome: Err(format!("{error:#}")), effect: None },
    }
}

/// Prints what there is.
fn list(arguments: &PapersArguments, papers: &[&Paper]) -> anyhow::Result<()> {
    let entries =
        || papers.iter().flat_map(|paper| paper.entry.iter().map(|entry| (*paper, entry)));
    if arguments.report.json {
        let object = |(paper, entry): (&Paper, &Entry)| {
            json!({
                "paper": paper.id,
                "id": entry.id,
                "shows": entry.shows,
                "steps": entry.steps,
                "computed": entry.computed,
                "impossible": entry.impossible,
            })
        };
        return terminal::json(&entries().map(object).collect::<Vec<_>>());
    }
    for (paper, entry) in entries() {
        terminal::line(format!("{:<16} {:<14} {}", paper.id, entry.id, entry.shows))?;
    }
    Ok(())
}

/// A line about an entry that is done.
fn progress(n_done: usize, n_all: usize, paper: &Paper, made: &Made<'_>) -> String {
    let state = match &made.outcome {
        Ok(outcome) if outcome.was_there => "was there".to_owned(),
        Ok(outcome) if outcome.pictures.is_empty() && outcome.seconds == 0.0 => {
            outcome.state.word().to_owned()
        }
        Ok(outcome) => format!("{}, {:.1} s", outcome.state.word(), outcome.seconds),
        Err(line) => format!("failed: {line}"),
    };
    format!("{n_done}/{n_all} {} {}: {state}", paper.id, made.entry.id)
}
