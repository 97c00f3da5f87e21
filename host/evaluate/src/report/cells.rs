//! What has been measured, kept in the folder as it comes, so that a report that was interrupted goes on
//! where it was.

use anyhow::{Context as _, bail};
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::collections::HashMap;
use std::fs::File;
use std::hash::{DefaultHasher, Hasher as _};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use surfelshop_api::graph::Output;
use surfelshop_image::metrics::Errors;
use surfelshop_image::{Image, exr};
use surfelshop_session::output::files;
use surfelshop_session::output::machine::Machine;
use surfelshop_session::timing::{Run, all_of};

/// One value of one knob.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// The parameter that is turned.
    pub knob: String,
    /// The value.
    pub value: String,
    /// Named errors; empty where there are none.
    pub errors: Vec<(String, f64)>,
    /// Root of the reference's own mean squared error.
    pub noise: f64,
    /// Milliseconds of the first run, everything that had to be made for it included.
    pub first_ms: f64,
    /// Runs after the first.
    pub runs: Vec<Run>,
    /// Passes that ran in the first frame, each a pipeline; of renderers.
    pub n_passes: Option<usize>,
    /// Bytes of the textures and buffers of its graph; of renderers.
    pub graph_bytes: Option<u64>,
    /// Why nothing was measured.
    pub fault: Option<String>,
    /// What it ran on, where that is not the same for all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub machine: Option<Machine>,
}

impl Cell {
    /// A value that could not be measured.
    pub fn faulty(knob: &str, value: &str, fault: String) -> Self {
        Self {
            knob: knob.to_owned(),
            value: value.to_owned(),
            errors: Vec::new(),
            noise: 0.0,
            first_ms: 0.0,
            runs: Vec::new(),
            n_passes: None,
            graph_bytes: None,
            fault: Some(fault),
            machine: None,
        }
    }

    /// A value of which the errors are known.
    pub fn new(knob: &str, value: &str, errors: &[(&str, f64)], first_ms: f64) -> Self {
        let errors = errors.iter().filter(|(_, value)| value.is_finite());
        let errors = errors.map(|(name, value)| ((*name).to_owned(), *value)).collect();
        Self { errors, first_ms, fault: None, ..Self::faulty(knob, value, String::new()) }
    }

    /// A value of which the errors of its picture are known.
    pub fn of_picture(knob: &str, value: &str, errors: &Errors, first_ms: f64) -> Self {
        Self { noise: errors.noise(), ..Self::new(knob, value, &errors.named(), first_ms) }
    }

    /// Whether it failed.
    pub fn is_faulty(&self) -> bool {
        self.fault.is_some()
    }

    /// An error by its name.
    pub fn error(&self, name: &str) -> Option<f64> {
        self.errors.iter().find(|(other, _)| other == name).map(|(_, value)| *value)
    }

    /// What was timed of the runs after the first; nothing where it is not known of all.
    pub fn times(&self, of: impl Fn(&Run) -> Option<f64>) -> Vec<f64> {
        all_of(&self.runs, of)
    }
}

/// The cells of a folder: whole in one file, and what came since in another, a line each, so that what a cell
/// takes to write does not grow with their number.
pub(super) struct ResultsFile {
    folder: PathBuf,
    key: String,
    column: RefCell<Option<String>>,
    cells: RefCell<Cells>,
    truth: RefCell<Vec<Fingerprint>>,
    /// What was noted since it was last written.
    news: RefCell<Vec<LogLine>>,
    log: RefCell<Option<File>>,
    /// Times all cells were written.
    #[cfg(test)]
    pub(super) n_whole_writes: std::cell::Cell<usize>,
}

/// Cells in the order they came, found by knob and value.
#[derive(Default)]
struct Cells {
    all: Vec<Cell>,
    places: HashMap<(String, String), usize>,
}

impl Cells {
    fn of(all: Vec<Cell>) -> Self {
        let mut cells = Self::default();
        all.into_iter().for_each(|cell| cells.put(cell));
        cells
    }

    fn place(&self, knob: &str, value: &str) -> Option<usize> {
        self.places.get(&(knob.to_owned(), value.to_owned())).copied()
    }

    fn put(&mut self, cell: Cell) {
        match self.place(&cell.knob, &cell.value) {
            Some(place) => self.all[place] = cell,
            None => {
                self.places.insert((cell.knob.clone(), cell.value.clone()), self.all.len());
                self.all.push(cell);
            }
        }
    }

    /// Takes a line of the log, again or for the first time.
    fn take(&mut self, what: What) {
        match what {
            What::Cell(cell) => self.put(cell),
            What::Run { knob, value, number, run } => {
                let place = self.place(&knob, &value);
                if let Some(cell) = place.and_then(|place| self.all.get_mut(place))
                    && cell.runs.len() == number
                {
                    cell.runs.push(run);
                }
            }
            What::Fault { knob, value, fault } => {
                let place = self.place(&knob, &value);
                if let Some(cell) = place.and_then(|place| self.all.get_mut(place)) {
                    cell.fault = Some(fault);
                }
            }
        }
    }
}

/// A line of the log.
#[derive(Serialize, Deserialize)]
struct LogLine {
    /// A sum of the key: lines of other reports in the same folder do not count.
    of: u64,
    what: What,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum What {
    Cell(Cell),
    Run { knob: String, value: String, number: usize, run: Run },
    Fault { knob: String, value: String, fault: String },
}

#[derive(Serialize, Deserialize)]
struct Stored {
    key: String,
    /// The column that is compared, of tools.
    column: Option<String>,
    /// Files of the reference and what they hold: others of these names are not it.
    truth: Vec<Fingerprint>,
    cells: Vec<Cell>,
}

/// What tells lines of one key from those of others.
fn sum(key: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write(key.as_bytes());
    hasher.finish()
}

/// A file's name, its length and a hash of its bytes.
pub(crate) type Fingerprint = (String, u64, u64);

fn fingerprint(folder: &Path, name: &str) -> anyhow::Result<Fingerprint> {
    let bytes = files::read_short(&folder.join(name), MOST_BYTES)?;
    let mut hasher = DefaultHasher::new();
    hasher.write(&bytes);
    Ok((name.to_owned(), bytes.len() as u64, hasher.finish()))
}

/// What a folder holds whole of a key.
fn stored(folder: &Path, key: &str) -> anyhow::Result<Option<Stored>> {
    let path = folder.join(CELLS);
    if !path.exists() {
        return Ok(None);
    }
    let stored: Stored = serde_json::from_slice(&files::read_short(&path, MOST_BYTES)?)
        .with_context(|| {
            format!("{}: it is no list of cells; name another folder", path.display())
        })?;
    Ok((stored.key == key).then_some(stored))
}

const CELLS: &str = "cells.json";
/// What came since: a line each; one that was cut short by a kill is passed over.
const LOG: &str = "cells.log";
/// Most bytes of any file that is kept: pictures of the largest size that is drawn.
const MOST_BYTES: u64 = 4 << 30;
const TRUTH: &str = "reference.exr";
const VARIANCE: &str = "reference-variance.exr";
/// Numbers of 8 bytes, little-endian: the reference's own mean squared error, then its values.
const VALUES: &str = "reference.f64";

impl ResultsFile {
    /// Opens a folder; what was measured under another key counts for nothing.
    pub(super) fn open(folder: &Path, key: &str) -> anyhow::Result<Self> {
        let stored = stored(folder, key)?;
        let is_known = stored.is_some();
        let (column, truth, cells) =
            stored.map(|s| (s.column, s.truth, s.cells)).unwrap_or_default();
        let mut cells = Cells::of(cells);
        let log = folder.join(LOG);
        let lines = if is_known && log.exists() {
            files::read_short(&log, MOST_BYTES)?
        } else {
            Vec::new()
        };
        let of = sum(key);
        for line in lines.split(|byte| *byte == b'\n') {
            match serde_json::from_slice::<LogLine>(line) {
                Ok(news) if news.of == of => cells.take(news.what),
                _ => {}
            }
        }
        let kept = Self::of(folder, key, (column, truth, cells));
        // The log is of this key from now on, and short.
        if !is_known || !lines.is_empty() {
            kept.store_all()?;
        }
        Ok(kept)
    }

    fn of(
        folder: &Path,
        key: &str,
        (column, truth, cells): (Option<String>, Vec<Fingerprint>, Cells),
    ) -> Self {
        Self {
            folder: folder.to_owned(),
            key: key.to_owned(),
            column: RefCell::new(column),
            cells: RefCell::new(cells),
            truth: RefCell::new(truth),
            news: RefCell::default(),
            log: RefCell::default(),
            #[cfg(test)]
            n_whole_writes: std::cell::Cell::new(0),
        }
    }

    /// The reference in a folder that several parts read, where it is that of the key; nothing is written.
    pub(super) fn shared(folder: &Path, key: &str) -> anyhow::Result<Option<Self>> {
        let Some(Stored { column, truth, .. }) = stored(folder, key)? else { return Ok(None) };
        let found = Self::of(folder, key, (column, truth, Cells::default()));
        Ok((!found.truth_files().is_empty()).then_some(found))
    }

    /// What tells the reference's files from others; none where it was not made here.
    pub(super) fn truth_sums(&self) -> Vec<Fingerprint> {
        self.truth.borrow().clone()
    }

    /// The names of the reference's files; none unless all of them are there as they were written.
    fn truth_files(&self) -> Vec<String> {
        let truth = self.truth.borrow();
        let is_there =
            |known: &Fingerprint| fingerprint(&self.folder, &known.0).is_ok_and(|f| f == *known);
        match truth.iter().all(is_there) {
            true => truth.iter().map(|(name, ..)| name.clone()).collect(),
            false => Vec::new(),
        }
    }

    /// Notes the files of the reference, once they are written.
    fn note_truth(&self, names: &[&str]) -> anyhow::Result<()> {
        let all = names.iter().map(|name| fingerprint(&self.folder, name));
        self.truth.replace(all.collect::<anyhow::Result<_>>()?);
        self.store_all()
    }

    /// The column that is compared, where the reference of it is known.
    pub(super) fn column(&self) -> Option<String> {
        self.column.borrow().clone()
    }

    /// A cell, where it has been measured.
    pub(super) fn cell(&self, knob: &str, value: &str) -> Option<Cell> {
        let cells = self.cells.borrow();
        cells.place(knob, value).and_then(|place| cells.all.get(place)).cloned()
    }

    /// Notes a cell, instead of what was known of it.
    pub(super) fn put(&self, cell: Cell) {
        self.note(What::Cell(cell.clone()));
        self.cells.borrow_mut().put(cell);
    }

    fn note(&self, what: What) {
        self.news.borrow_mut().push(LogLine { of: sum(&self.key), what });
    }

    /// Notes a run of a cell, or why there was none.
    pub(super) fn add(&self, knob: &str, value: &str, run: Result<Run, String>) {
        let Some(number) = self.cell(knob, value).map(|cell| cell.runs.len()) else { return };
        let (knob, value) = (knob.to_owned(), value.to_owned());
        let what = |knob, value| match &run {
            Ok(run) => What::Run { knob, value, number, run: *run },
            Err(line) => What::Fault { knob, value, fault: line.clone() },
        };
        self.note(what(knob.clone(), value.clone()));
        self.cells.borrow_mut().take(what(knob, value));
    }

    /// Writes what was noted since the last time behind what is there.
    pub(super) fn store(&self) -> anyhow::Result<()> {
        let news = self.news.take();
        let mut lines = String::new();
        for line in &news {
            lines += &serde_json::to_string(line)?;
            lines.push('\n');
        }
        let path = self.folder.join(LOG);
        let mut log = self.log.borrow_mut();
        let failed = || format!("{}: cannot be written", path.display());
        let file = match &mut *log {
            Some(file) => file,
            none => none.insert(surfelshop_cloud::files::append(&path).with_context(failed)?),
        };
        file.write_all(lines.as_bytes()).with_context(failed)
    }

    /// Writes all cells, and begins a new log: after that nothing is in it.
    pub(super) fn store_all(&self) -> anyhow::Result<()> {
        #[cfg(test)]
        self.n_whole_writes.set(self.n_whole_writes.get() + 1);
        let (column, cells) = (self.column(), self.cells.borrow().all.clone());
        let truth = self.truth.borrow().clone();
        let stored = Stored { key: self.key.clone(), column, truth, cells };
        files::write_whole(&self.folder.join(CELLS), serde_json::to_string(&stored)?.as_bytes())?;
        // Lines that are in the cells already change nothing when they are read once more.
        self.news.take();
        self.log.take();
        files::write_whole(&self.folder.join(LOG), b"")
    }

    /// The reference and its variance, where they are those of the key.
    pub(super) fn truth(&self) -> anyhow::Result<Option<(Image, Option<Image>)>> {
        let files = self.truth_files();
        let read = |name: &str| {
            let is_known = files.iter().any(|file| file == name);
            let path = self.folder.join(name);
            is_known.then(|| exr::read_color(&path, exr::MOST_PIXELS)).transpose()
        };
        let Some(picture) = read(TRUTH)? else { return Ok(None) };
        Ok(Some((picture, read(VARIANCE)?)))
    }

    /// Keeps the reference.
    pub(super) fn put_truth(
        &self,
        picture: &Image,
        variance: Option<&Image>,
    ) -> anyhow::Result<()> {
        let layer = (Output::Color, picture.clone());
        files::write_whole(&self.folder.join(TRUTH), &exr::encode(&[&layer])?)?;
        let place = self.folder.join(VARIANCE);
        match variance {
            Some(variance) => {
                // Opaque, so that no channel is multiplied on the way.
                let data = variance.data.as_chunks::<4>().0.iter();
                let data = data.flat_map(|[r, g, b, _]| [*r, *g, *b, 1.0]).collect();
                let layer = (Output::Color, Image { data, ..variance.clone() });
                files::write_whole(&place, &exr::encode(&[&layer])?)?;
            }
            None => return self.note_truth(&[TRUTH]),
        }
        self.note_truth(&[TRUTH, VARIANCE])
    }

    /// The reference's own mean squared error and its values, where they are those of the key.
    pub(super) fn true_values(&self, n_surfels: usize) -> anyhow::Result<Option<(f64, Vec<f64>)>> {
        let path = self.folder.join(VALUES);
        if !self.truth_files().iter().any(|file| file == VALUES) {
            return Ok(None);
        }
        let bytes = files::read_short(&path, MOST_BYTES)?;
        let (numbers, rest) = bytes.as_chunks::<8>();
        let mut numbers = numbers.iter().map(|bytes| f64::from_le_bytes(*bytes));
        match (numbers.next(), rest) {
            (Some(noise), []) if numbers.len() % n_surfels.max(1) == 0 => {
                Ok(Some((noise, numbers.collect())))
            }
            _ => bail!(
                "{}: expected 8 bytes for each of {n_surfels} surfels and 8 more, found {}; name \
                 another folder",
                path.display(),
                bytes.len()
            ),
        }
    }

    /// Keeps the reference's values and their own mean squared error.
    pub(super) fn put_true_values(
        &self,
        column: &str,
        noise: f64,
        values: &[f64],
    ) -> anyhow::Result<()> {
        self.column.replace(Some(column.to_owned()));
        let numbers = std::iter::once(&noise).chain(values);
        let bytes: Vec<u8> = numbers.flat_map(|number| number.to_le_bytes()).collect();
        files::write_whole(&self.folder.join(VALUES), &bytes)?;
        self.note_truth(&[VALUES])
    }
}
