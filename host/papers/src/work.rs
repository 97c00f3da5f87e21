//! Runs what entries are made of, one folder each, and finds again what earlier runs made.

use crate::data::{Data, Meaning, Prepared};
use crate::entries::{Entry, Paper};
use crate::outcome::{Outcome, Shown, State};
use crate::steps::RunCommand;
use crate::{PapersArguments, commands, computed, harvest, steps};
use anyhow::{Context as _, anyhow, bail};
use sha2::{Digest as _, Sha256};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::{Instant, SystemTime};
use surfelshop_api::params::Values;
use surfelshop_cloud::ToolRun;
use surfelshop_session::interrupt;
use surfelshop_session::options::is_plugin_file;
use surfelshop_session::output::digest::FileDigest;
use surfelshop_session::output::{command_line, files, terminal};
use surfelshop_session::session;

/// What an outcome is stored in.
const OUTCOME: &str = "outcome.json";
/// What a folder is of that is not whole yet, or of something prepared.
const HASH: &str = "hash";
/// Most bytes of a model or a probe.
const MOST_BYTES: u64 = 16 << 30;

/// The folders of all entries.
pub(crate) struct Work<'a> {
    pub(crate) arguments: &'a PapersArguments,
    command: RunCommand<'a>,
    folder: PathBuf,
    data: Data,
    program: String,
    digests: HashMap<PathBuf, String>,
}

/// A file that a step names.
#[derive(Clone)]
pub(crate) struct Used {
    path: PathBuf,
    digest: String,
    shown: Vec<Shown>,
    /// Commands that prepared it.
    commands: Vec<String>,
    /// Options with which it is drawn.
    view: String,
}

fn hex(hasher: Sha256) -> String {
    hasher.finalize().iter().take(12).map(|byte| format!("{byte:02x}")).collect()
}

/// A hash of texts.
fn digest<'a>(parts: impl IntoIterator<Item = &'a str>) -> String {
    let mut hasher = Sha256::new();
    for part in parts {
        hasher.update((part.len() as u64).to_le_bytes());
        hasher.update(part.as_bytes());
    }
    hex(hasher)
}

impl<'a> Work<'a> {
    pub(crate) fn open(
        arguments: &'a PapersArguments,
        command: RunCommand<'a>,
    ) -> anyhow::Result<Self> {
        let folder = arguments.folder().join("work");
        let made = folder.join("clouds");
        std::fs::create_dir_all(&made)
            .with_context(|| format!("{}: the folder cannot be made", made.display()))?;
        let data = Data::find(arguments.data.as_deref(), &made)?;
        let registry = session::registry(&arguments.plugins)?;
        let mut program = vec![env!("CARGO_PKG_VERSION").to_owned()];
        // What files hold, not when they were written: another machine's part has the same.
        let own = std::env::current_exe()?;
        for file in std::iter::once(&own).chain(registry.entries().iter().map(|entry| &entry.file))
        {
            program.push(FileDigest::of(file)?.sum);
        }
        let program = digest(program.iter().map(String::as_str));
        Ok(Self { arguments, command, folder, data, program, digests: HashMap::new() })
    }

    /// What comes of an entry: of this run, or of an earlier one of the same.
    pub(crate) fn outcome(&mut self, paper: &Paper, entry: &Entry) -> anyhow::Result<Outcome> {
        if !entry.impossible.is_empty() {
            return Ok(Outcome::empty(State::Impossible));
        }
        let started = Instant::now();
        let used = self.used(entry)?;
        let hash = self.hash(entry, &used)?;
        let key = entry.folder(&paper.id);
        let folder = self.folder.join(&key);
        if let Some(outcome) = stored(&folder, &hash) {
            return Ok(outcome);
        }
        let part = self.begin(&key, &hash)?;
        let place = commands::from_root(&self.folder);
        let mut outcome = Outcome { hash, place, ..Outcome::empty(State::Made) };
        for (_, used) in &used {
            outcome.data.extend(used.shown.iter().cloned());
            outcome.commands.extend(used.commands.iter().cloned());
        }
        outcome.commands.dedup();
        self.steps(entry, &used, (&part, &folder), &mut outcome)?;
        if !entry.computed.is_empty() {
            let own = ["papers", paper.id.as_str(), "--only", entry.id.as_str()];
            let mut words: Vec<String> = own.map(str::to_owned).to_vec();
            words.extend(["--size".to_owned(), self.arguments.size.to_string()]);
            words.extend(["--samples".to_owned(), self.arguments.samples.to_string()]);
            if let Some(data) = &self.arguments.data {
                words.extend(["--data".to_owned(), commands::from_root(data)]);
            }
            words.extend(self.passed_on("papers"));
            words.extend(["-o".to_owned(), "again".to_owned()]);
            outcome.commands.push(command_line::words("surfelshop", words));
            let made = {
                let mut bench = computed::Bench { work: self, used: &used, folder: &part };
                computed::evaluate(&entry.computed, &mut bench)?
            };
            made.store(&part, &mut outcome)?;
        }
        let stands_in = outcome.data.iter().any(|shown| !shown.stands_in_for.is_empty());
        if stands_in || !entry.stand_in.is_empty() {
            outcome.state = State::StoodIn;
        }
        outcome.date = now();
        outcome.machine = machine();
        outcome.seconds = started.elapsed().as_secs_f64();
        let bytes = serde_json::to_vec_pretty(&outcome)?;
        files::write_whole(&part.join(OUTCOME), &bytes)?;
        finish(&part, &folder)?;
        Ok(Outcome { folder, ..outcome })
    }

    /// Runs the steps of an entry.
    fn steps(
        &mut self,
        entry: &Entry,
        used: &[(String, Used)],
        (part, folder): (&Path, &Path),
        outcome: &mut Outcome,
    ) -> anyhow::Result<()> {
        let mut places = Vec::new();
        for (number, step) in entry.steps.iter().enumerate() {
            let words = self.words(step, used, (part, number))?;
            let said = self.run(&words)?;
            outcome.commands.push(commands::shown(&words, &self.folder, part, folder));
            places.push(outcome.commands.len() - 1);
            harvest::take(outcome, part, &entry.pass, (number, &words, said))?;
        }
        for against in &entry.against {
            let words = entry.steps.get(against.step).map(|step| steps::words(step)).transpose()?;
            let file = words.as_ref().and_then(|words| words.first());
            let file = file.and_then(|command| harvest::file_of(command));
            let file = file.ok_or_else(|| anyhow!("step {} measures nothing", against.step))?;
            let object = harvest::json(&part.join(against.step.to_string()).join(file))?;
            let command = places.get(against.step).copied();
            outcome.numbers.push(harvest::against(against, &object, &entry.pass, command)?);
        }
        Ok(())
    }

    /// The words of a step, with the options that all steps of its command have.
    pub(crate) fn words(
        &self,
        step: &str,
        used: &[(String, Used)],
        (part, number): (&Path, usize),
    ) -> anyhow::Result<Vec<String>> {
        let samples = self.arguments.samples.to_string();
        let meaning = |name: &str| match name {
            "out" => Ok(part.display().to_string()),
            "samples" => Ok(samples.clone()),
            name => match used.iter().find(|(key, _)| key == name) {
                Some((_, used)) => Ok(used.path.display().to_string()),
                None => bail!("`{step}`: no file is called `{name}`"),
            },
        };
        let words = steps::words(step)?;
        let mut words: Vec<String> =
            words.iter().map(|word| steps::filled(word, meaning)).collect::<anyhow::Result<_>>()?;
        let command = words.first().cloned().unwrap_or_default();
        let has = |words: &[String], option: &str| words.iter().any(|word| word == option);
        let draws = matches!(command.as_str(), "render" | "compare" | "explain")
            || command == "report" && has(&words, "-r");
        let mut add = |option: &str, value: String| {
            if !words.iter().any(|word| word == option) {
                words.extend([option.to_owned(), value]);
            }
        };
        if draws {
            for (option, value) in views(step, used)? {
                add(&option, value);
            }
            add("--size", self.arguments.size.to_string());
        }
        if command == "bench" {
            // A scene has its own lights, and a benchmark takes no others.
            for (option, value) in views(step, used)?.into_iter().filter(|(o, _)| o != "--light") {
                add(&option, value);
            }
            add("--sizes", self.arguments.size.to_string());
            add("--frames", self.arguments.repeats.to_string());
        }
        if matches!(command.as_str(), "compare" | "report") {
            add("--repeats", self.arguments.repeats.to_string());
        }
        if matches!(command.as_str(), "bench" | "compare" | "report") {
            add("-o", part.join(number.to_string()).display().to_string());
        }
        words.extend(self.passed_on(&command));
        Ok(words)
    }

    /// Options about plugins and devices that the steps have in common with this command.
    fn passed_on(&self, command: &str) -> Vec<String> {
        let plugins = &self.arguments.plugins;
        let mut words = Vec::new();
        let mut add = |option: &str, value: Option<String>| {
            words.extend(value.into_iter().flat_map(|value| [option.to_owned(), value]));
        };
        for file in &plugins.plugin {
            add("--plugin", Some(commands::from_root(file)));
        }
        for plugin in &plugins.isolate {
            add(
                "--isolate",
                Some(match is_plugin_file(plugin) {
                    true => commands::from_root(Path::new(plugin)),
                    false => plugin.clone(),
                }),
            );
        }
        add("--trust-file", plugins.trust_file.as_deref().map(commands::from_root));
        if !matches!(command, "convert" | "info") {
            add("--adapter", self.arguments.device.adapter.clone());
        }
        if plugins.trust {
            words.push("--trust".to_owned());
        }
        words
    }

    /// Runs a command line, and says what it printed.
    pub(crate) fn run(&self, words: &[String]) -> anyhow::Result<String> {
        // Asked while the step before looked, which came to its end all the same.
        if interrupt::was_asked() {
            bail!("cancelled");
        }
        let whole: Vec<String> =
            std::iter::once("surfelshop".to_owned()).chain(words.iter().cloned()).collect();
        let (done, said) = terminal::captured(|| (self.command)(&whole));
        done.with_context(|| command_line::words("surfelshop", words.iter().cloned()))?;
        Ok(said)
    }

    /// The files that an entry names.
    fn used(&mut self, entry: &Entry) -> anyhow::Result<Vec<(String, Used)>> {
        let mut keys: Vec<String> = Vec::new();
        let named = entry.steps.iter().flat_map(|step| steps::names(step).map(str::to_owned));
        let needed = computed::needs(&entry.computed).iter().map(|key| (*key).to_owned());
        for key in named.chain(needed) {
            if !matches!(key.as_str(), "out" | "samples") && !keys.contains(&key) {
                keys.push(key);
            }
        }
        keys.into_iter().map(|key| Ok((key.clone(), self.file(&key)?))).collect()
    }

    /// A file by its name, prepared where it has to be.
    fn file(&mut self, key: &str) -> anyhow::Result<Used> {
        let found = self.data.found(key)?;
        let mut used = match found.meaning {
            Meaning::File { path, of } => {
                let digest = self.digest_of(&path)?;
                let shown = vec![Shown { of, stands_in_for: String::new() }];
                Used { path, digest, shown, commands: Vec::new(), view: found.view }
            }
            Meaning::Prepared(prepared) => self.prepared(&prepared)?,
        };
        if let (Some(of), Some(shown)) = (found.stands_in_for, used.shown.first_mut()) {
            shown.stands_in_for = of;
        }
        Ok(used)
    }

    /// Makes something that several entries use, unless it is there.
    fn prepared(&mut self, prepared: &Prepared) -> anyhow::Result<Used> {
        let mut used = Vec::new();
        for step in &prepared.steps {
            for name in steps::names(step).filter(|name| *name != "out") {
                used.push((name.to_owned(), self.file(name)?));
            }
        }
        let parts = used.iter().map(|(_, used)| used.digest.as_str());
        let own = prepared.steps.iter().map(String::as_str).chain([self.program.as_str()]);
        let hash = digest(parts.chain(own));
        let key = format!("prepared-{}", prepared.key);
        let folder = self.folder.join(&key);
        let path = folder.join(&prepared.file);
        let mut commands: Vec<String> =
            used.iter().flat_map(|(_, used)| used.commands.iter().cloned()).collect();
        let was_made = || std::fs::read_to_string(folder.join(HASH)).is_ok_and(|of| of == hash);
        let is_there = was_made();
        let part = match is_there {
            true => folder.clone(),
            false => self.begin(&key, &hash)?,
        };
        for (number, step) in prepared.steps.iter().enumerate() {
            let words = self.words(step, &used, (&part, number))?;
            if !is_there {
                self.run(&words)?;
            }
            commands.push(commands::shown(&words, &self.folder, &part, &folder));
        }
        if !is_there {
            finish_shared(&part, &folder, was_made)?;
        }
        let mut shown = Vec::new();
        for (key, used) in &used {
            for one in &used.shown {
                let of = prepared.of.replace(&format!("{{{key}}}"), &one.of);
                shown.push(Shown { of, ..one.clone() });
            }
        }
        let view = used.iter().map(|(_, used)| used.view.clone()).find(|view| !view.is_empty());
        Ok(Used { path, digest: hash, shown, commands, view: view.unwrap_or_default() })
    }

    /// An empty folder to work in, or what a run of the same left there. Each part of a run has its own.
    fn begin(&self, key: &str, hash: &str) -> anyhow::Result<PathBuf> {
        let part = match self.arguments.part {
            Some(part) => self.folder.join(format!("{key}.{}", part.folder())),
            None => self.folder.join(format!("{key}.part")),
        };
        let is_same = std::fs::read_to_string(part.join(HASH)).is_ok_and(|of| of == hash);
        if !is_same {
            remove(&part)?;
            std::fs::create_dir_all(&part)
                .with_context(|| format!("{}: the folder cannot be made", part.display()))?;
            files::write_whole(&part.join(HASH), hash.as_bytes())?;
        }
        Ok(part)
    }

    /// A hash of all that an entry is made of.
    fn hash(&self, entry: &Entry, used: &[(String, Used)]) -> anyhow::Result<String> {
        let options = &self.arguments;
        let numbers = format!("{} {} {}", options.size, options.samples, options.repeats);
        let entry = serde_json::to_string(entry)?;
        let adapter = options.device.adapter.clone().unwrap_or_default();
        let own = [self.program.as_str(), &numbers, &entry, &adapter];
        let of_files = used.iter().flat_map(|(_, used)| [used.digest.as_str(), used.view.as_str()]);
        Ok(digest(own.into_iter().chain(of_files)))
    }

    /// A hash of a file's bytes; of a scene also of the cloud of its name.
    fn digest_of(&mut self, path: &Path) -> anyhow::Result<String> {
        if let Some(known) = self.digests.get(path) {
            return Ok(known.clone());
        }
        let mut hasher = Sha256::new();
        hasher.update(files::read_short(path, MOST_BYTES)?);
        let name = path.display().to_string();
        if let Some(stem) = name.strip_suffix(".scene.toml") {
            hasher.update(files::read_short(Path::new(&format!("{stem}.ply")), MOST_BYTES)?);
        }
        let digest = hex(hasher);
        self.digests.insert(path.to_owned(), digest.clone());
        Ok(digest)
    }
}

impl computed::Bench<'_, '_> {
    /// The path of a file that the entry uses.
    pub(crate) fn path(&self, key: &str) -> anyhow::Result<&Path> {
        let found = self.used.iter().find(|(name, _)| name == key);
        found
            .map(|(_, used)| used.path.as_path())
            .ok_or_else(|| anyhow!("no file is called `{key}`"))
    }
}

/// What an earlier run made of the same.
fn stored(folder: &Path, hash: &str) -> Option<Outcome> {
    let outcome: Outcome =
        serde_json::from_slice(&std::fs::read(folder.join(OUTCOME)).ok()?).ok()?;
    let are_there = outcome.pictures.iter().all(|picture| folder.join(&picture.file).is_file());
    let place = commands::from_root(folder.parent().unwrap_or(folder));
    let here = |command: &String| command.replace(&outcome.place, &place);
    let commands = outcome.commands.iter().map(here).collect();
    (outcome.hash == hash && are_there).then(|| Outcome {
        folder: folder.to_owned(),
        was_there: true,
        // Where the folders were moved, or another machine made them, the clouds of commands are here.
        commands,
        ..outcome
    })
}

/// Options with which the files of a step are drawn, and their values.
fn views(step: &str, used: &[(String, Used)]) -> anyhow::Result<Vec<(String, String)>> {
    let lights = step.contains("--env ");
    let mut all = Vec::new();
    for name in steps::names(step) {
        let Some((_, used)) = used.iter().find(|(key, _)| key == name) else { continue };
        let words = steps::words(&used.view)?;
        let pairs = words.chunks_exact(2).map(|pair| (pair[0].clone(), pair[1].clone()));
        all.extend(pairs.filter(|(option, _)| lights || !option.starts_with("--env-")));
    }
    Ok(all)
}

fn remove(folder: &Path) -> anyhow::Result<()> {
    match std::fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("{}: cannot be removed", folder.display()))
        }
        _ => Ok(()),
    }
}

/// Gives a folder that is whole its name.
fn finish(part: &Path, folder: &Path) -> anyhow::Result<()> {
    remove(folder)?;
    std::fs::rename(part, folder).with_context(|| format!("{}: cannot be renamed", part.display()))
}

/// The same for what several parts make at a time: the first that is whole stays, since others may be reading it.
fn finish_shared(part: &Path, folder: &Path, was_made: impl Fn() -> bool) -> anyhow::Result<()> {
    // A folder takes the name of no other that holds something.
    if std::fs::rename(part, folder).is_ok() {
        return Ok(());
    }
    if was_made() {
        return remove(part);
    }
    match finish(part, folder) {
        Err(_) if was_made() => remove(part),
        done => done,
    }
}

/// The time: UTC, RFC 3339.
fn now() -> String {
    ToolRun::new(String::new(), String::new(), &Values::new(), SystemTime::now()).time
}

/// The machine in a few words.
fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|line| line.strip_prefix("model name"));
    let model = model.and_then(|rest| rest.split_once(':')).map(|(_, name)| name.trim());
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{}, {threads} threads", model.unwrap_or(std::env::consts::ARCH))
}
