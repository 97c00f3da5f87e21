//! A job: what it runs, step by step, as lines of a shell that every runner takes.

use anyhow::{Context as _, bail, ensure};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use surfelshop_session::output::command_line;

/// Most input files that are parameters of a template, which may have 50; of more the folder alone is one.
const MOST_INPUTS: usize = 40;

/// A job.
pub(super) struct Job {
    /// For people: `report of scan.ply`.
    pub(super) name: String,
    /// Where it was ordered: names that were typed are relative to this folder.
    pub(super) folder: PathBuf,
    /// The folder of the job.
    pub(super) place: PathBuf,
    /// Input files that are parameters, absolute.
    pub(super) inputs: Vec<PathBuf>,
    pub(super) steps: Vec<Step>,
}

/// A step; each begins when the one before is done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Step {
    /// Its name.
    pub(super) name: String,
    /// Tasks that it has, numbered from 1 in `$PART`; `None` where there is one, without a number.
    pub(super) parts: Option<u32>,
    /// The lines of its script. They find `$PROGRAM`, `$FOLDER`, `$JOB`, `$PART` and `$INPUT1`.
    pub(super) lines: Vec<String>,
}

/// What a job is made of.
pub(super) struct JobOrder<'a> {
    /// The command that parts run: `report`.
    pub(super) command: &'a str,
    /// Words that were typed behind it, outputs and parts left out.
    pub(super) words: Vec<String>,
    /// The files among them.
    pub(super) files: &'a [PathBuf],
    /// The folder of the job.
    pub(super) place: &'a Path,
    pub(super) parts: u32,
}

impl JobOrder<'_> {
    /// The job, with these steps: their names, tasks and further words.
    pub(super) fn job(&self, steps: &[(&str, Option<u32>, String)]) -> anyhow::Result<Job> {
        let folder = std::env::current_dir().context("the current folder is gone")?;
        let named: &[PathBuf] = if self.files.len() > MOST_INPUTS { &[] } else { self.files };
        let absolute =
            |path: &PathBuf| std::path::absolute(path).with_context(|| path.display().to_string());
        let inputs: Vec<PathBuf> = named.iter().map(absolute).collect::<anyhow::Result<_>>()?;
        let place = absolute(&self.place.to_owned())?;
        for path in inputs.iter().chain([&folder, &place]) {
            check(&path.display().to_string())?;
        }
        let mut words = Vec::with_capacity(self.words.len());
        let before = std::iter::once("").chain(self.words.iter().map(String::as_str));
        for (word, before) in self.words.iter().zip(before) {
            check(word)?;
            // What stands behind an option may be its value.
            let may_be_file = !before.starts_with('-') || before.contains('=');
            let input =
                named.iter().position(|file| may_be_file && file.as_os_str() == word.as_str());
            words.push(match input {
                Some(i) => format!("\"$INPUT{}\"", i + 1),
                None => command_line::quoted(word.clone()),
            });
        }
        let typed = words.join(" ");
        let step = |(name, parts, more): &(&str, Option<u32>, String)| Step {
            name: (*name).to_owned(),
            parts: *parts,
            lines: match *name {
                "Merge" => lines(more),
                _ => lines(&format!("{} {typed} {more}", self.command)),
            },
        };
        let names: Vec<_> = self.files.iter().filter_map(|file| file.file_name()).collect();
        let first = names.first().map(|name| name.to_string_lossy()).unwrap_or_default();
        let more = match names.len() {
            0 | 1 => String::new(),
            n => format!(" and {} more", n - 1),
        };
        // Without files a command takes its own.
        let of = if names.is_empty() { String::new() } else { format!(" of {first}{more}") };
        Ok(Job {
            name: format!("{}{of} in {} parts", self.command, self.parts),
            folder,
            place,
            inputs,
            steps: steps.iter().map(step).collect(),
        })
    }
}

/// The lines that run the program; a failure is told in the words of Open Job Description.
fn lines(arguments: &str) -> Vec<String> {
    [
        "cd \"$FOLDER\"",
        "mkdir -p \"$JOB/parts\"",
        "LOG=$(mktemp)",
        "trap 'rm -f \"$LOG\"' EXIT",
        "echo \"openjd_progress: 0\"",
        &format!("if \"$PROGRAM\" {arguments} 2>\"$LOG\"; then"),
        "  cat \"$LOG\" >&2",
        "  echo \"openjd_progress: 100\"",
        "else",
        "  STATUS=$?",
        "  cat \"$LOG\" >&2",
        // A command line that was not understood is told in lines up to a blank one; notes stand above other
        // failures, and a program that was killed said nothing.
        "  case $STATUS in",
        "  2) REASON=$(sed '/^$/q' \"$LOG\" | tr -s '\\n ' ' ') ;;",
        "  *) REASON=$(tail -n 1 \"$LOG\") ;;",
        "  esac",
        "  echo \"openjd_fail: ${REASON:-the program was ended, exit status $STATUS}\"",
        "  exit 1",
        "fi",
    ]
    .map(str::to_owned)
    .to_vec()
}

/// Refuses what shells or templates would take for something else.
fn check(word: &str) -> anyhow::Result<()> {
    for (signs, why) in [
        ("{{", "templates take it for a parameter"),
        ("\n", "it ends a line"),
        ("\r", "templates have no place for it"),
        ("\u{fffd}", "it is no Unicode"),
    ] {
        if word.contains(signs) {
            bail!("{word:?}: {why}; name it otherwise");
        }
    }
    Ok(())
}

/// A path as a shell takes it between single quotes.
pub(super) fn in_quotes(path: &Path) -> anyhow::Result<String> {
    let text = path.to_str().with_context(|| format!("{}: expected UTF-8", path.display()))?;
    ensure!(!text.contains('\''), "{text}: a job takes no path with '; name it otherwise");
    Ok(format!("'{text}'"))
}
