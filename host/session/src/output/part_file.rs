//! What a part of work that is divided among processes or machines leaves behind: a folder with its results, and in it
//! a file that says what they are. It is written last, so that a folder without it is not done.

use crate::cpu_time::cpu_time;
use crate::options::part::Part;
use crate::output::command_line;
use crate::output::digest::FileDigest;
use crate::output::files;
use crate::output::machine::Machine;
use anyhow::{Context as _, bail, ensure};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The file of a part in its folder.
pub const PART_FILE: &str = "part.json";

/// Most bytes of such a file.
const MOST_BYTES: u64 = 1 << 30;

/// What a part is of, and what came of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PartFile<T> {
    /// The command.
    pub command: String,
    /// The program's version.
    pub version: String,
    /// Which part.
    pub part: Part,
    /// Everything that results depend on besides files: options, parameters, cameras.
    pub options: String,
    /// The files that were read, plugins among them.
    pub inputs: Vec<FileDigest>,
    /// What it ran on.
    pub machine: Machine,
    /// Seconds by the clock, of the last process that worked on the part.
    pub seconds: f64,
    /// Seconds of CPU time of that process; where the system tells.
    pub cpu_seconds: Option<f64>,
    /// The command line that made it.
    pub typed: Vec<String>,
    /// The results.
    pub of: T,
}

/// When work on a part began.
#[derive(Clone, Copy, Debug)]
pub struct PartStart(Instant);

impl PartStart {
    /// Now.
    #[must_use]
    pub fn now() -> Self {
        Self(Instant::now())
    }
}

impl<T: Serialize> PartFile<T> {
    /// What a part of a command was made of: its options and the files that were read.
    #[must_use]
    pub fn new(
        (command, part): (&str, Part),
        (options, inputs): (String, Vec<FileDigest>),
        (machine, started): (Machine, PartStart),
        of: T,
    ) -> Self {
        Self {
            command: command.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            part,
            options,
            inputs,
            machine,
            seconds: started.0.elapsed().as_secs_f64(),
            cpu_seconds: cpu_time().map(|time| time.as_secs_f64()),
            typed: command_line::typed_words().collect(),
            of,
        }
    }

    /// Writes it into the folder of the part, which is done by that.
    ///
    /// # Errors
    /// One line where it cannot be written.
    pub fn write(&self, folder: &Path) -> anyhow::Result<()> {
        let text = serde_json::to_string(self)?;
        files::write_whole(&folder.join(PART_FILE), text.as_bytes())
    }
}

/// All parts of one work, in their order.
#[derive(Debug)]
pub struct PartSet {
    all: Vec<(PathBuf, PartFile<serde_json::Value>)>,
}

impl PartSet {
    /// Reads the parts in folders, each that of one part or one with the folders of parts in it.
    ///
    /// # Errors
    /// One line where a part is missing or there twice, or where parts are of different commands, options, inputs or
    /// versions: it names the part.
    pub fn read(places: &[PathBuf]) -> anyhow::Result<Self> {
        let mut all: BTreeMap<Part, (PathBuf, PartFile<serde_json::Value>)> = BTreeMap::new();
        let mut unfinished = Vec::new();
        for folder in folders(places)? {
            let path = folder.join(PART_FILE);
            if !path.exists() {
                unfinished.push(folder);
                continue;
            }
            let part: PartFile<serde_json::Value> =
                serde_json::from_slice(&files::read_short(&path, MOST_BYTES)?)
                    .with_context(|| format!("{}: it is no part", path.display()))?;
            if let Some((other, _)) = all.get(&part.part) {
                let (folder, other) = (folder.display(), other.display());
                bail!("{folder}: {} is in {other}, too; leave one out", part.part);
            }
            all.insert(part.part, (folder, part));
        }
        let all: Vec<_> = all.into_values().collect();
        check(&all)?;
        complete(&all, &unfinished)?;
        Ok(Self { all })
    }

    /// The command that the parts are of.
    #[must_use]
    pub fn command(&self) -> &str {
        self.all.first().map_or("", |(_, part)| part.command.as_str())
    }

    /// The parts with their folders, their results as those of a command.
    ///
    /// # Errors
    /// One line where results are of another form.
    pub fn parts<T: DeserializeOwned>(self) -> anyhow::Result<Vec<(PathBuf, PartFile<T>)>> {
        let typed = |(folder, file): (PathBuf, PartFile<serde_json::Value>)| {
            let of = T::deserialize(&file.of)
                .with_context(|| format!("{}: it is no part", folder.join(PART_FILE).display()))?;
            Ok((folder, file.with(of)))
        };
        self.all.into_iter().map(typed).collect()
    }
}

impl<T> PartFile<T> {
    fn with<U>(self, of: U) -> PartFile<U> {
        let Self { command, version, part, options, inputs, machine, .. } = self;
        let (seconds, cpu_seconds, typed) = (self.seconds, self.cpu_seconds, self.typed);
        PartFile {
            command,
            version,
            part,
            options,
            inputs,
            machine,
            seconds,
            cpu_seconds,
            typed,
            of,
        }
    }

    /// A line on the part, for people.
    #[must_use]
    pub fn line(&self) -> String {
        let cpu = self.cpu_seconds.map(|s| format!(", {s:.1} CPU s")).unwrap_or_default();
        format!("{}: {:.1} s{cpu}, {}", self.part, self.seconds, self.machine)
    }
}

/// The folders of parts: those that were named, and those in a folder of parts.
fn folders(places: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut all = Vec::new();
    for place in places {
        if place.join(PART_FILE).exists() {
            all.push(place.clone());
            continue;
        }
        let entries = std::fs::read_dir(place).with_context(|| {
            let place = place.display();
            format!("{place}: expected a folder of parts (`convert` joins clouds)")
        })?;
        let mut found = Vec::new();
        for entry in entries {
            let entry = entry.with_context(|| place.display().to_string())?;
            if is_of_part(&entry.file_name().to_string_lossy()) {
                found.push(entry.path());
            }
        }
        if found.is_empty() {
            let own = place.file_name().unwrap_or_default().to_string_lossy().into_owned();
            ensure!(
                is_of_part(&own),
                "{}: expected the folder of a part, such as part-3-of-8, or one with such in it",
                place.display()
            );
            found.push(place.clone());
        }
        found.sort();
        all.extend(found);
    }
    Ok(all)
}

/// Whether a folder is called like one of a part.
fn is_of_part(name: &str) -> bool {
    let number = |text: &str| text.parse::<u32>().is_ok();
    let numbers = name.strip_prefix("part-").and_then(|rest| rest.split_once("-of-"));
    numbers.is_some_and(|(k, n)| number(k) && number(n))
}

/// Refuses parts of different works.
fn check(all: &[(PathBuf, PartFile<serde_json::Value>)]) -> anyhow::Result<()> {
    let Some((_, first)) = all.first() else { return Ok(()) };
    for (folder, other) in all {
        let place = format!("{}: {}", folder.display(), other.part);
        let differs = |what: &str, expected: &str, found: &str| -> anyhow::Error {
            anyhow::anyhow!(
                "{place}: expected {what} {expected}, as of {}, found {found}",
                first.part
            )
        };
        if other.command != first.command {
            return Err(differs("the command", &first.command, &other.command));
        }
        if other.part.of != first.part.of {
            let [expected, found] = [first, other].map(|file| file.part.of.to_string());
            return Err(differs("this number of parts:", &expected, &found));
        }
        if other.version != first.version {
            return Err(differs("version", &first.version, &other.version));
        }
        for (ours, theirs) in [(&first.inputs, &other.inputs), (&other.inputs, &first.inputs)] {
            if let Some(file) = ours.iter().find(|file| !theirs.contains(file)) {
                bail!(
                    "{place}: it read another {} than {}; run one of them again with the file of the other",
                    file.name,
                    first.part
                );
            }
        }
        if other.options != first.options {
            bail!(
                "{place}: it was made with other options than {}; the one was `surfelshop {}`, the other \
                 `surfelshop {}`",
                first.part,
                other.typed.join(" "),
                first.typed.join(" ")
            );
        }
    }
    Ok(())
}

/// Refuses a set that lacks a part.
fn complete(
    all: &[(PathBuf, PartFile<serde_json::Value>)],
    unfinished: &[PathBuf],
) -> anyhow::Result<()> {
    let Some((_, first)) = all.first() else {
        match unfinished.first() {
            Some(folder) => bail!("{}: the part is not done; run it again", folder.display()),
            None => bail!("there are no parts to merge"),
        }
    };
    let of = first.part.of;
    let is_missing = |number: &u32| !all.iter().any(|(_, file)| file.part.number == *number);
    let missing: Vec<u32> = (1..=of).filter(is_missing).collect();
    let Some(number) = missing.first() else { return Ok(()) };
    let begun = Part { number: *number, of }.folder();
    let begun = unfinished.iter().find(|folder| folder.file_name().is_some_and(|n| *n == *begun));
    let what = match begun {
        Some(folder) => format!("is not done in {}", folder.display()),
        None => "is missing".to_owned(),
    };
    let more = match missing.len() {
        1 => String::new(),
        n => format!(", and {} more", n - 1),
    };
    bail!("part {number} of {of} {what}{more}; run it again with --part {number}/{of}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(number: u32, of: u32) -> PartFile<serde_json::Value> {
        let machine = Machine::this("none");
        let begun = (machine, PartStart::now());
        let part = Part { number, of };
        let read = ("options".to_owned(), Vec::new());
        PartFile::new(("report", part), read, begun, serde_json::json!(number))
    }

    fn read(
        change: impl Fn(&mut PartFile<serde_json::Value>),
        numbers: &[u32],
    ) -> Result<Vec<u32>, String> {
        let folder = tempfile::tempdir().unwrap();
        for &number in numbers {
            let mut part = part(number, 3);
            if number == 2 {
                change(&mut part);
            }
            let own = folder.path().join(part.part.folder());
            std::fs::create_dir_all(&own).unwrap();
            part.write(&own).unwrap();
        }
        let set =
            PartSet::read(&[folder.path().to_owned()]).map_err(|error| format!("{error:#}"))?;
        let parts = set.parts::<u32>().map_err(|error| format!("{error:#}"))?;
        Ok(parts.into_iter().map(|(_, part)| part.of).collect())
    }

    /// Invariant: parts are merged only where all are there, of the same options, inputs and version
    #[test]
    fn sets_that_are_incomplete_or_unlike_are_refused_by_name() {
        assert_eq!(read(|_| (), &[1, 2, 3]), Ok(vec![1, 2, 3]));
        let missing = read(|_| (), &[1, 3]).unwrap_err();
        assert!(missing.contains("part 2 of 3 is missing") && missing.contains("--part 2/3"));
        let refused = |change: &dyn Fn(&mut PartFile<serde_json::Value>), word: &str| {
            let line = read(change, &[1, 2, 3]).unwrap_err();
            assert!(line.contains("part 2 of 3") && line.contains(word), "{line}");
        };
        refused(&|part| part.options = "others".to_owned(), "other options");
        refused(&|part| part.version = "0.0.1".to_owned(), "0.0.1");
        refused(&|part| part.command = "compare".to_owned(), "compare");
        let (name, sum) = ("a.ply".to_owned(), String::new());
        let input = FileDigest { name, bytes: 1, sum };
        refused(&|part| part.inputs = vec![input.clone()], "another a.ply");
    }

    #[test]
    fn a_folder_without_its_file_is_not_done() {
        let folder = tempfile::tempdir().unwrap();
        for number in [1, 2] {
            let own = folder.path().join(Part { number, of: 2 }.folder());
            std::fs::create_dir_all(&own).unwrap();
        }
        part(1, 2).write(&folder.path().join("part-1-of-2")).unwrap();
        let line = PartSet::read(&[folder.path().to_owned()]).unwrap_err().to_string();
        assert!(line.contains("part 2 of 2 is not done"), "{line}");
        let line = PartSet::read(&[folder.path().join("none")]).unwrap_err().to_string();
        assert!(line.contains("expected a folder of parts"), "{line}");
    }
}
