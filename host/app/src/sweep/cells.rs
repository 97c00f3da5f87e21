//! What has been measured, kept in the folder as it comes, so that a report that was interrupted goes on
//! where it was.

use crate::times::{Run, all_of};
use crate::{exr_file, files};
use anyhow::{Context as _, bail};
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::hash::{DefaultHasher, Hasher as _};
use std::path::{Path, PathBuf};
use surfelshop_api::graph::Output;
use surfelshop_engine::Image;
use surfelshop_engine::metrics::Errors;

/// One value of one knob.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Cell {
    pub(crate) knob: String,
    pub(crate) value: String,
    /// Named errors; empty where there are none.
    pub(crate) errors: Vec<(String, f64)>,
    /// Root of the reference's own mean squared error.
    pub(crate) noise: f64,
    /// Milliseconds of the first run, everything that had to be made for it included.
    pub(crate) first_ms: f64,
    /// Runs after the first.
    pub(crate) runs: Vec<Run>,
    /// Passes that ran in the first frame, each a pipeline; of renderers.
    pub(crate) n_passes: Option<usize>,
    /// Bytes of the textures and buffers of its graph; of renderers.
    pub(crate) graph_bytes: Option<u64>,
    /// Why nothing was measured.
    pub(crate) fault: Option<String>,
}

impl Cell {
    /// A value that could not be measured.
    pub(crate) fn faulty(knob: &str, value: &str, fault: String) -> Self {
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
        }
    }

    /// A value of which the errors are known.
    pub(crate) fn new(knob: &str, value: &str, errors: &[(&str, f64)], first_ms: f64) -> Self {
        let errors = errors.iter().filter(|(_, value)| value.is_finite());
        let errors = errors.map(|(name, value)| ((*name).to_owned(), *value)).collect();
        Self { errors, first_ms, fault: None, ..Self::faulty(knob, value, String::new()) }
    }

    /// A value of which the errors of its picture are known.
    pub(crate) fn of_picture(knob: &str, value: &str, errors: &Errors, first_ms: f64) -> Self {
        Self { noise: errors.noise(), ..Self::new(knob, value, &errors.named(), first_ms) }
    }

    pub(crate) fn is_faulty(&self) -> bool {
        self.fault.is_some()
    }

    /// An error by its name.
    pub(crate) fn error(&self, name: &str) -> Option<f64> {
        self.errors.iter().find(|(other, _)| other == name).map(|(_, value)| *value)
    }

    /// What was timed of the runs after the first; nothing where it is not known of all.
    pub(crate) fn times(&self, of: impl Fn(&Run) -> Option<f64>) -> Vec<f64> {
        all_of(&self.runs, of)
    }
}

/// The cells of a folder.
pub(super) struct Kept {
    folder: PathBuf,
    key: String,
    column: RefCell<Option<String>>,
    cells: RefCell<Vec<Cell>>,
    truth: RefCell<Vec<Fingerprint>>,
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

/// A file's name, its length and a hash of its bytes.
type Fingerprint = (String, u64, u64);

fn fingerprint(folder: &Path, name: &str) -> anyhow::Result<Fingerprint> {
    let path = folder.join(name);
    let bytes = std::fs::read(&path).with_context(|| path.display().to_string())?;
    let mut hasher = DefaultHasher::new();
    hasher.write(&bytes);
    Ok((name.to_owned(), bytes.len() as u64, hasher.finish()))
}

const CELLS: &str = "cells.json";
const TRUTH: &str = "reference.exr";
const VARIANCE: &str = "reference-variance.exr";
/// Numbers of 8 bytes, little-endian: the reference's own mean squared error, then its values.
const VALUES: &str = "reference.f64";

impl Kept {
    /// Opens a folder; what was measured under another key counts for nothing.
    pub(super) fn open(folder: &Path, key: &str) -> anyhow::Result<Self> {
        let path = folder.join(CELLS);
        let stored: Option<Stored> = match std::fs::read(&path) {
            Ok(bytes) => Some(serde_json::from_slice(&bytes).with_context(|| {
                format!("{}: it is no list of cells; name another folder", path.display())
            })?),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => None,
            Err(error) => return Err(error).context(path.display().to_string()),
        };
        let stored = stored.filter(|stored| stored.key == key);
        let (column, truth, cells) =
            stored.map(|s| (s.column, s.truth, s.cells)).unwrap_or_default();
        let (column, cells) = (RefCell::new(column), RefCell::new(cells));
        let truth = RefCell::new(truth);
        Ok(Self { folder: folder.to_owned(), key: key.to_owned(), column, cells, truth })
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
        self.store()
    }

    /// The column that is compared, where the reference of it is known.
    pub(super) fn column(&self) -> Option<String> {
        self.column.borrow().clone()
    }

    /// A cell, where it has been measured.
    pub(super) fn cell(&self, knob: &str, value: &str) -> Option<Cell> {
        let cells = self.cells.borrow();
        cells.iter().find(|cell| cell.knob == knob && cell.value == value).cloned()
    }

    /// Notes a cell, instead of what was known of it.
    pub(super) fn put(&self, cell: Cell) {
        let mut cells = self.cells.borrow_mut();
        cells.retain(|other| other.knob != cell.knob || other.value != cell.value);
        cells.push(cell);
    }

    /// Notes a run of a cell, or why there was none.
    pub(super) fn add(&self, knob: &str, value: &str, run: Result<Run, String>) {
        let mut cells = self.cells.borrow_mut();
        let of = |cell: &&mut Cell| cell.knob == knob && cell.value == value;
        let Some(cell) = cells.iter_mut().find(of) else { return };
        match run {
            Ok(run) => cell.runs.push(run),
            Err(line) => cell.fault = Some(line),
        }
    }

    /// Writes all that is noted: the file is whole at any moment.
    pub(super) fn store(&self) -> anyhow::Result<()> {
        let (column, cells) = (self.column(), self.cells.borrow().clone());
        let truth = self.truth.borrow().clone();
        let stored = Stored { key: self.key.clone(), column, truth, cells };
        files::write_whole(&self.folder.join(CELLS), serde_json::to_string(&stored)?.as_bytes())
    }

    /// The reference and its variance, where they are those of the key.
    pub(super) fn truth(&self) -> anyhow::Result<Option<(Image, Option<Image>)>> {
        let files = self.truth_files();
        let read = |name: &str| {
            let is_known = files.iter().any(|file| file == name);
            let path = self.folder.join(name);
            is_known.then(|| exr_file::read_color(&path, exr_file::MOST_PIXELS)).transpose()
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
        files::write_whole(&self.folder.join(TRUTH), &exr_file::exr(&[&layer])?)?;
        let place = self.folder.join(VARIANCE);
        match variance {
            Some(variance) => {
                // Opaque, so that no channel is multiplied on the way.
                let data = variance.data.as_chunks::<4>().0.iter();
                let data = data.flat_map(|[r, g, b, _]| [*r, *g, *b, 1.0]).collect();
                let layer = (Output::Color, Image { data, ..variance.clone() });
                files::write_whole(&place, &exr_file::exr(&[&layer])?)?;
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
        let bytes = std::fs::read(&path).with_context(|| path.display().to_string())?;
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
