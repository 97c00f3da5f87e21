//! What has been measured, kept in the folder as it comes, so that a report that was interrupted goes on
//! where it was.

use crate::compare::candidate::Drawn;
use crate::{exr_file, files};
use anyhow::Context as _;
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use surfelshop_api::graph::Output;
use surfelshop_engine::Image;
use surfelshop_engine::metrics::Comparison;

/// One value of one knob.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Cell {
    pub(super) knob: String,
    pub(super) value: String,
    /// Named errors; empty where there are none.
    pub(super) errors: Vec<(String, f64)>,
    /// Root of the reference's own mean squared error.
    pub(super) noise: f64,
    pub(super) first_ms: f64,
    pub(super) frames_ms: Vec<f64>,
    pub(super) passes_ms: Vec<f64>,
    /// Why nothing was measured.
    pub(super) fault: Option<String>,
}

impl Cell {
    /// A cell that was measured, or not.
    pub(super) fn new(
        knob: &str,
        value: &str,
        measured: Result<(Comparison, &Drawn), String>,
    ) -> Self {
        let mut cell = Self {
            knob: knob.to_owned(),
            value: value.to_owned(),
            errors: Vec::new(),
            noise: 0.0,
            first_ms: 0.0,
            frames_ms: Vec::new(),
            passes_ms: Vec::new(),
            fault: None,
        };
        match measured {
            Err(line) => cell.fault = Some(line),
            Ok((comparison, drawn)) => {
                cell.first_ms = drawn.first_ms;
                cell.frames_ms.clone_from(&drawn.frames_ms);
                cell.passes_ms.clone_from(&drawn.passes_ms);
                match comparison.errors {
                    None => {
                        let n = comparison.n_not_finite;
                        cell.fault = Some(format!("{knob}={value}: {n} pixels are not finite"));
                    }
                    Some(errors) => {
                        cell.noise = errors.reference_noise.mse.max(0.0).sqrt();
                        let named = errors.named().into_iter().filter(|(_, v)| v.is_finite());
                        cell.errors = named.map(|(name, v)| (name.to_owned(), v)).collect();
                    }
                }
            }
        }
        cell
    }

    /// An error by its name.
    pub(super) fn error(&self, name: &str) -> Option<f64> {
        self.errors.iter().find(|(other, _)| other == name).map(|(_, value)| *value)
    }

    /// Milliseconds of its own passes, or of whole frames where the device does not tell; the median.
    pub(super) fn milliseconds(&self) -> Option<f64> {
        let times = if self.passes_ms.is_empty() { &self.frames_ms } else { &self.passes_ms };
        median(times)
    }
}

/// The middle one of some values.
pub(super) fn median(values: &[f64]) -> Option<f64> {
    let mut all = values.to_vec();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied()
}

/// The cells of a folder.
pub(super) struct Kept {
    folder: PathBuf,
    key: String,
    cells: RefCell<Vec<Cell>>,
    /// Whether the reference of the folder is that of the key.
    fits: bool,
}

#[derive(Serialize, Deserialize)]
struct Stored {
    key: String,
    cells: Vec<Cell>,
}

const CELLS: &str = "cells.json";
const TRUTH: &str = "reference.exr";
const VARIANCE: &str = "reference-variance.exr";

impl Kept {
    /// Opens a folder; what was measured under another key counts for nothing.
    pub(super) fn open(folder: &Path, key: &str) -> anyhow::Result<Self> {
        let path = folder.join(CELLS);
        let stored: Option<Stored> = match std::fs::read(&path) {
            Ok(bytes) => Some(
                serde_json::from_slice(&bytes)
                    .with_context(|| format!("{}: it is no list of cells", path.display()))?,
            ),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => None,
            Err(error) => return Err(error).context(path.display().to_string()),
        };
        let stored = stored.filter(|stored| stored.key == key);
        let fits = stored.is_some();
        let cells = RefCell::new(stored.map(|stored| stored.cells).unwrap_or_default());
        Ok(Self { folder: folder.to_owned(), key: key.to_owned(), cells, fits })
    }

    /// A cell, where it has been measured.
    pub(super) fn cell(&self, knob: &str, value: &str) -> Option<Cell> {
        let cells = self.cells.borrow();
        cells.iter().find(|cell| cell.knob == knob && cell.value == value).cloned()
    }

    /// Keeps a cell: the file is whole at any moment.
    pub(super) fn put(&self, cell: &Cell) -> anyhow::Result<()> {
        self.cells.borrow_mut().push(cell.clone());
        self.store()
    }

    fn store(&self) -> anyhow::Result<()> {
        let stored = Stored { key: self.key.clone(), cells: self.cells.borrow().clone() };
        files::write_whole(&self.folder.join(CELLS), serde_json::to_string(&stored)?.as_bytes())
    }

    /// The reference and its variance, where they are those of the key.
    pub(super) fn truth(&self) -> anyhow::Result<Option<(Image, Option<Image>)>> {
        let (picture, variance) = (self.folder.join(TRUTH), self.folder.join(VARIANCE));
        if !self.fits || !picture.is_file() {
            return Ok(None);
        }
        let variance = match variance.is_file() {
            true => Some(exr_file::read_color(&variance)?),
            false => None,
        };
        Ok(Some((exr_file::read_color(&picture)?, variance)))
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
            None if place.exists() => std::fs::remove_file(&place)?,
            None => {}
        }
        // From now on the folder is that of the key.
        self.store()
    }
}
