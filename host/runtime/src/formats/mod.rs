//! Formats of plugins at work: found by the bytes and names of files, loaded when a file needs them, run on
//! threads of their own.
//!
//! Invariants: to find a format runs no code; a command whose files need none loads none ([`PluginFormats::n_loaded`]);
//! nobody waits for a format that gives no sign of life ([`SILENCE`]) or reads in circles, and what it holds is
//! left behind with it; a sink takes nothing after its reader gave up.

mod job;
mod watch;

use crate::boundary::Fault;
use crate::plugins::{LoadedUnit, Registry, Timeouts, on_own_thread};
use job::FormatJob;
use std::collections::HashMap;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use surfelshop_api::abi::format_table::ReadCall;
use surfelshop_api::format::{
    CloudHeader, CloudSinkHost, CloudSourceHost, FileHost, PointNode, Recognition,
};
use surfelshop_api::params::{ParamDecl, Value, Values};
use surfelshop_api::{CloudView, HostInfo, UnitKind};
use surfelshop_cloud::files::return_to_folder;
use surfelshop_cloud::{FormatCall, Formats, Progress, ReadFault, SharedSink, WriteFault};
use watch::{Watch, WatchedFile};

/// A format that neither reads, writes, hands over nor tells progress for so long is given up.
pub const SILENCE: Duration = Duration::from_secs(20);

/// How often a caller is asked whether to go on.
const TICK: Duration = Duration::from_millis(50);

/// How formats are run.
#[derive(Clone, Copy, Debug)]
pub struct FormatRunner {
    /// How long to wait for an instance, and for a call to stop that was asked to.
    pub timeouts: Timeouts,
    /// How long a format may give no sign of life.
    pub silence: Duration,
}

impl FormatRunner {
    /// Reads a file into a sink.
    ///
    /// # Errors
    /// Where the format fails or hangs, or `progress` asked to stop.
    pub fn read(
        &self,
        unit: &LoadedUnit,
        call: ReadCall,
        (name, file): (&str, Arc<dyn FileHost>),
        sink: SharedSink,
        progress: Progress<'_>,
    ) -> Result<(), Ended> {
        let (name, watch) = (name.to_owned(), Arc::new(Watch::new()));
        let watched = WatchedFile::new(file, Arc::clone(&watch));
        let mut sink = WatchedSink { sink, watch: Arc::clone(&watch), n_warned: 0 };
        self.run(unit, &watch, progress, move |instance, job| {
            instance.read(&call, (&name, &watched), &mut sink, job)
        })
    }

    /// Writes clouds to a file; what the format cannot hold, in lines.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn write(
        &self,
        unit: &LoadedUnit,
        values: Values,
        mut clouds: Box<dyn CloudSourceHost + Send>,
        (name, file): (&str, Arc<dyn FileHost>),
        progress: Progress<'_>,
    ) -> Result<Vec<String>, Ended> {
        let (name, watch) = (name.to_owned(), Arc::new(Watch::new()));
        let watched = WatchedFile::new(file, Arc::clone(&watch));
        let at_work = Arc::clone(&watch);
        self.run(unit, &watch, progress, move |instance, job| {
            let mut source =
                WatchedSource { source: &mut *clouds, watch: at_work, rows: 0, done: 0 };
            instance.write(&values, &mut source, (&name, &watched), job)
        })
    }

    /// Runs a call on a format's thread until it has ended, was asked to stop, or is given up.
    fn run<T: Send + 'static>(
        &self,
        unit: &LoadedUnit,
        watch: &Arc<Watch>,
        progress: Progress<'_>,
        call: impl FnOnce(&mut crate::boundary::Instance, &FormatJob) -> Result<T, Fault>
        + Send
        + 'static,
    ) -> Result<T, Ended> {
        let (plugin, index) = (unit.plugin, unit.unit_index);
        let (answer, answers) = mpsc::channel();
        let job = FormatJob::new(Arc::clone(watch));
        let at_work = Arc::clone(watch);
        on_own_thread(move || {
            let version = env!("CARGO_PKG_VERSION").to_owned();
            let host = HostInfo { host_version: version, ..HostInfo::default() };
            let called = plugin.create(index, &host).and_then(|mut instance| {
                at_work.sign();
                let called = call(&mut instance, &job);
                return_to_folder();
                called
            });
            // Nobody receives where the host stopped waiting.
            drop(answer.send(called));
        })
        .map_err(Ended::Failed)?;
        let mut asked_to_stop = None;
        loop {
            match answers.recv_timeout(TICK) {
                Ok(_) if asked_to_stop.is_some() => return Err(Ended::Cancelled),
                Ok(called) => return called.map_err(Ended::Failed),
                Err(RecvTimeoutError::Disconnected) => {
                    let line = "it ended its thread".to_owned();
                    return Err(Ended::Failed(Fault::Misbehaved(line)));
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
            if progress(watch.fraction()).is_break() {
                watch.cancel();
                asked_to_stop.get_or_insert_with(std::time::Instant::now);
            }
            if asked_to_stop.is_some_and(|since| since.elapsed() > self.timeouts.cancel) {
                watch.end();
                return Err(Ended::Cancelled);
            }
            if watch.silent_for() > self.silence {
                watch.end();
                if asked_to_stop.is_some() {
                    return Err(Ended::Cancelled);
                }
                return Err(Ended::Failed(Fault::TimedOut(self.silence)));
            }
            if let Some(line) = watch.in_circles() {
                watch.end();
                return Err(Ended::Failed(Fault::Misbehaved(line)));
            }
        }
    }
}

/// The formats of a registry's plugins.
pub struct PluginFormats {
    registry: Arc<Registry>,
    runner: FormatRunner,
    loaded: Mutex<HashMap<String, LoadedUnit>>,
}

impl std::fmt::Debug for PluginFormats {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PluginFormats").field("n_loaded", &self.n_loaded()).finish_non_exhaustive()
    }
}

impl PluginFormats {
    /// The formats of these plugins; none is loaded yet.
    #[must_use]
    pub fn new(registry: Arc<Registry>, timeouts: Timeouts) -> Self {
        let runner = FormatRunner { timeouts, silence: SILENCE };
        Self { registry, runner, loaded: Mutex::default() }
    }

    /// The same, giving up on formats that are silent for so long.
    #[must_use]
    pub fn with_silence(self, silence: Duration) -> Self {
        Self { runner: FormatRunner { silence, ..self.runner }, ..self }
    }

    /// Formats that were loaded so far.
    #[must_use]
    pub fn n_loaded(&self) -> usize {
        self.loaded.lock().unwrap_or_else(PoisonError::into_inner).len()
    }

    /// All formats, each as people type it, with the files it recognises; later ones take precedence. Those that nobody
    /// asked for come first: they take no other one's files.
    fn known(&self) -> impl Iterator<Item = (String, &Recognition)> {
        self.known_if(false).chain(self.known_if(true))
    }

    /// Those that somebody asked for, or the others.
    fn known_if(&self, asked: bool) -> impl Iterator<Item = (String, &Recognition)> {
        self.registry
            .units(UnitKind::Format)
            .filter(move |(entry, ..)| entry.trust.is_asked_for(entry.origin) == asked)
            .map(|(_, manifest, unit)| (format!("{}/{}", manifest.id, unit.id), &unit.files))
    }

    /// The names of all formats that can be loaded, as they are typed.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        self.registry.names(UnitKind::Format)
    }

    /// A format in memory.
    ///
    /// # Errors
    /// A line that names the plugin, where it is not to be found, not trusted, or cannot be loaded.
    pub fn load(&self, id: &str) -> Result<LoadedUnit, String> {
        let mut loaded = self.loaded.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(unit) = loaded.get(id) {
            return Ok(unit.clone());
        }
        let unit = self.registry.find(UnitKind::Format, id).map_err(|error| error.to_string())?;
        let unit = unit.load(&self.runner.timeouts).map_err(|error| error.to_string())?;
        loaded.insert(id.to_owned(), unit.clone());
        Ok(unit)
    }

    /// The values of a format's parameters.
    ///
    /// # Errors
    /// Where one is set that the format does not have.
    fn values(unit: &LoadedUnit, given: Option<&Values>) -> Result<Values, String> {
        let declared = &unit.description.params;
        let given = given.cloned().unwrap_or_default();
        if let Some(unknown) = given.keys().find(|id| !declared.iter().any(|p| p.id == **id)) {
            let known: Vec<&str> = declared.iter().map(|p| p.id.as_str()).collect();
            let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            return Err(format!(
                "format `{}` has no parameter `{unknown}`; it has {known}",
                unit.unit.id
            ));
        }
        let value = |p: &ParamDecl| match given.get(&p.id) {
            // As it was typed.
            Some(Value::Text(text)) => p.parse(text).map(|value| (p.id.clone(), value)),
            other => Ok((p.id.clone(), p.sanitise(other))),
        };
        declared.iter().map(value).collect()
    }
}

/// How a call ended that did not end well.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ended {
    /// It was asked to stop.
    Cancelled,
    /// It failed.
    Failed(Fault),
}

/// What a format said of a file that it does not read, with what to do where it does not say that itself.
fn advised(line: String) -> String {
    let advises = line.contains(';') || line.ends_with('?');
    let is_damage = ["damaged", "cut short"].iter().any(|word| line.contains(word));
    match (advises, is_damage) {
        (true, _) => line,
        (false, true) => line + "; check the copy or download",
        (false, false) => {
            line + "; check the copy, or save it again with the program that it is from"
        }
    }
}

/// What a format said, as the line of its file.
fn line(unit: &LoadedUnit, fault: &Fault) -> String {
    match fault {
        // What it says of the file is the line.
        Fault::Error(line) => line.clone(),
        other => format!("the format `{}/{}` {other}", unit.manifest.id, unit.unit.id),
    }
}

impl Formats for PluginFormats {
    fn by_bytes(&self, head: &[u8]) -> Option<String> {
        // Names come after bytes: here one that nobody asked for would take files from those known by name.
        let asked = self.known_if(true);
        asked.filter(|(_, files)| files.knows_bytes(head)).last().map(|(id, _)| id)
    }

    fn by_name(&self, name: &str, written: bool) -> Option<String> {
        let knows = |files: &Recognition| files.knows_name(name) && (files.written || !written);
        self.known().filter(|(_, files)| knows(files)).last().map(|(id, _)| id)
    }

    fn takes_several(&self, id: &str) -> bool {
        self.known().any(|(known, files)| known == id && files.several)
    }

    fn takes_grids(&self, id: &str) -> bool {
        self.known().any(|(known, files)| known == id && files.grid)
    }

    fn beside(&self, id: &str) -> Vec<String> {
        let found = self.known().find(|(known, _)| known == id);
        found.map(|(_, files)| files.beside.clone()).unwrap_or_default()
    }

    fn endings(&self, written: bool) -> Vec<String> {
        let known = self.known().filter(|(_, files)| files.written || !written);
        let mut endings: Vec<String> = known.flat_map(|(_, files)| files.endings.clone()).collect();
        endings.sort();
        endings.dedup();
        endings
    }

    fn read(
        &self,
        id: &str,
        file: Arc<dyn FileHost>,
        call: FormatCall<'_>,
        sink: SharedSink,
        progress: Progress<'_>,
    ) -> Result<(), ReadFault> {
        let fault = |line: String| ReadFault::Format { format: id.to_owned(), line };
        let unit = self.load(id).map_err(fault)?;
        let values = Self::values(&unit, call.values).map_err(fault)?;
        let wanted = ReadCall {
            values,
            columns: call.columns.map(<[String]>::to_vec),
            nodes: call.nodes.map(<[PointNode]>::to_vec),
            beside: file.beside(),
        };
        let read = self.runner.read(&unit, wanted, (call.name, file), sink, progress);
        read.map_err(|ended| match ended {
            Ended::Cancelled => ReadFault::Cancelled,
            Ended::Failed(Fault::Error(said)) => fault(advised(said)),
            Ended::Failed(failed) => fault(line(&unit, &failed)),
        })
    }

    fn write(
        &self,
        id: &str,
        clouds: Box<dyn CloudSourceHost + Send>,
        file: Arc<dyn FileHost>,
        call: FormatCall<'_>,
        progress: Progress<'_>,
    ) -> Result<Vec<String>, WriteFault> {
        let unit = self.load(id).map_err(WriteFault::Line)?;
        let values = Self::values(&unit, call.values).map_err(WriteFault::Line)?;
        let written = self.runner.write(&unit, values, clouds, (call.name, file), progress);
        written.map_err(|ended| match ended {
            Ended::Cancelled => WriteFault::Cancelled,
            Ended::Failed(failed) => WriteFault::Line(line(&unit, &failed)),
        })
    }
}

/// Most warnings that are taken of a call; files have a few.
const MOST_WARNINGS: u32 = 10_000;

/// A sink whose calls are signs of life.
struct WatchedSink {
    sink: SharedSink,
    watch: Arc<Watch>,
    n_warned: u32,
}

impl WatchedSink {
    fn with<T>(
        &self,
        call: impl FnOnce(&mut dyn CloudSinkHost) -> surfelshop_api::Result<T>,
    ) -> surfelshop_api::Result<T> {
        self.watch.check()?;
        let mut sink = self.sink.lock().unwrap_or_else(PoisonError::into_inner);
        let called = call(&mut *sink);
        self.watch.sign();
        called
    }
}

impl CloudSinkHost for WatchedSink {
    fn begin(&mut self, header: &CloudHeader) -> surfelshop_api::Result<bool> {
        self.with(|sink| sink.begin(header))
    }

    fn batch(
        &mut self,
        values: &[surfelshop_api::columns::Values<'_>],
    ) -> surfelshop_api::Result<()> {
        self.with(|sink| sink.batch(values))
    }

    fn faces(&mut self, triangles: &[[u32; 3]]) -> surfelshop_api::Result<()> {
        self.with(|sink| sink.faces(triangles))
    }

    fn warn(&mut self, line: &str) {
        self.n_warned = self.n_warned.saturating_add(1);
        // Those without end are no sign of life.
        if self.n_warned > MOST_WARNINGS {
            return;
        }
        // Nobody reads warnings of a call that is given up.
        drop(self.with(|sink| {
            sink.warn(line);
            Ok(())
        }));
    }
}

/// A source whose calls are signs of life, and tell how far the work is.
struct WatchedSource<'a> {
    source: &'a mut dyn CloudSourceHost,
    watch: Arc<Watch>,
    rows: u64,
    done: u64,
}

impl CloudSourceHost for WatchedSource<'_> {
    fn next_cloud(&mut self) -> surfelshop_api::Result<Option<CloudHeader>> {
        self.watch.check()?;
        let header = self.source.next_cloud()?;
        self.watch.sign();
        if let Some(header) = &header {
            (self.rows, self.done) = (header.rows.unwrap_or(0), 0);
        }
        Ok(header)
    }

    fn next_batch(&mut self) -> surfelshop_api::Result<Option<CloudView<'_>>> {
        self.watch.check()?;
        // What makes the batch may take its time: that is not the format's.
        self.watch.pause();
        let batch = self.source.next_batch();
        self.watch.sign();
        if let Ok(Some(batch)) = &batch {
            self.done += batch.len as u64;
            if self.rows > 0 {
                self.watch.set(self.done as f64 / self.rows as f64);
            }
        }
        batch
    }
}

#[cfg(test)]
mod tests {
    use super::advised;

    #[test]
    fn what_a_format_says_ends_with_what_to_do() {
        for (said, expected) in [
            ("expected 7, found 9; write fewer", "expected 7, found 9; write fewer"),
            ("found a zero: is it a text file?", "found a zero: is it a text file?"),
            (
                "found 3 bytes: the file is cut short",
                "found 3 bytes: the file is cut short; check the copy or download",
            ),
            (
                "expected coder 0, found 15",
                "expected coder 0, found 15; check the copy, or save it again with the program that it is from",
            ),
        ] {
            assert_eq!(advised(said.to_owned()), expected);
        }
    }
}
