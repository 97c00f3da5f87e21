//! The numbers of a comparison, and what is made of them: a page, tables for programs, and lines. Parts of a comparison
//! leave theirs behind, and are put together again.

use super::measured::errors;
use crate::comparison_page::{Column, Page, Picture, Table};
use crate::csv;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::path::Path;
use surfelshop_image::metrics::{Comparison, Errors};
use surfelshop_session::output::machine::Machine;
use surfelshop_session::output::{command_line, files, terminal};
use surfelshop_session::render::camera_path::Frame;
use surfelshop_session::timing::{Run, all_of, median, spread};

/// Bytes of pictures on a page; with them it stays below 10 MB.
const MOST_ON_PAGE: usize = 9_000_000;

/// Metrics of the table, with what they mean and which way is better.
pub const METRICS: [(&str, &str, &str); 9] = [
    ("rmse", "root of the mean squared error of radiance", "less"),
    ("rel_mse", "mean squared error over squared radiance + 0.01", "less"),
    ("rel_mse_without_outliers", "the same without the worst 0.1 % of the pixels", "less"),
    ("psnr", "of what a screen shows, decibels", "more"),
    ("ssim", "structural similarity of what a screen shows", "more"),
    ("flip.mean", "FLIP, 67 pixels a degree: mean", "less"),
    ("flip.p99", "FLIP that 99 % of the pixels do not exceed", "less"),
    ("max_absolute", "largest difference of radiance", "less"),
    ("coverage_difference", "share of pixels that one covers and the other does not", "less"),
];

/// A comparison: what was compared, and its numbers frame by frame.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Compared {
    /// The clouds, the size of the pictures and the reference.
    pub(crate) what: String,
    /// What drew.
    pub(crate) device: String,
    /// What else the page says, in sentences.
    pub(crate) notes: Vec<String>,
    /// The same for programs.
    pub(crate) head: serde_json::Map<String, Value>,
    /// The name of what the others are measured against.
    pub(crate) truth: String,
    /// Whether its variance is known.
    pub(crate) has_noise: bool,
    /// Its place among the candidates, where it is one.
    pub(crate) truth_at: Option<usize>,
    /// Those that are compared.
    pub(crate) candidates: Vec<ComparedCandidate>,
    /// The frames, in their order.
    pub(crate) frames: Vec<FrameNumbers>,
}

/// One of those that are compared.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct ComparedCandidate {
    pub(crate) name: String,
    /// The unit and its parameters, for programs.
    pub(crate) renderer: Value,
}

/// The numbers of a frame.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct FrameNumbers {
    pub(crate) frame: Frame,
    pub(crate) candidates: Vec<Numbers>,
    /// What it ran on, where that is not the same for all.
    pub(crate) machine: Option<Machine>,
}

/// The numbers of a candidate in a frame.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Numbers {
    pub(crate) comparison: Result<Comparison, String>,
    pub(crate) first_ms: Option<f64>,
    pub(crate) runs: Vec<Run>,
    pub(crate) n_passes: Option<usize>,
    pub(crate) graph_bytes: Option<u64>,
}

/// Where a comparison is told.
pub(crate) struct Target<'a> {
    /// The folder of page and tables.
    pub(crate) folder: &'a Path,
    /// Whether one JSON object is printed instead of lines.
    pub(crate) json: bool,
}

impl Compared {
    /// The largest error of any in a frame, the reference's own aside.
    pub(crate) fn worst_rmse(&self, frame: &FrameNumbers) -> f64 {
        let others = frame.candidates.iter().enumerate().filter(|(i, _)| self.truth_at != Some(*i));
        let rmse = |(_, m): (usize, &Numbers)| errors(&m.comparison).map_or(0.0, |e| e.rmse);
        others.map(rmse).fold(0.0, f64::max)
    }

    /// A candidate's errors over all frames; a line where one of them has none.
    pub(crate) fn pooled(&self, candidate: usize) -> Result<Errors, String> {
        let mut all = Vec::with_capacity(self.frames.len());
        for told in &self.frames {
            let numbers = told.candidates.get(candidate).ok_or("it was not drawn")?;
            all.push(errors(&numbers.comparison).map_err(
                |line| match told.frame.name.as_str() {
                    "" => line,
                    name => format!("frame {name}: {line}"),
                },
            )?);
        }
        Errors::pooled(&all).ok_or_else(|| "it was not drawn".to_owned())
    }

    /// Whether a candidate is what the others are measured against.
    pub(crate) fn is_truth(&self, candidate: usize) -> bool {
        self.truth_at == Some(candidate)
    }

    /// The machines that frames ran on, each once; none where that is not told.
    fn machines(&self) -> Vec<&Machine> {
        let mut all: Vec<&Machine> =
            self.frames.iter().filter_map(|f| f.machine.as_ref()).collect();
        all.sort();
        all.dedup();
        all
    }

    /// All runs of a candidate, or those on a machine.
    fn runs(&self, candidate: usize, on: Option<&Machine>) -> Vec<Run> {
        let is_there = |told: &&FrameNumbers| on.is_none_or(|on| told.machine.as_ref() == Some(on));
        let of = self.frames.iter().filter(is_there);
        let of = of.filter_map(|told| told.candidates.get(candidate));
        of.flat_map(|numbers| numbers.runs.clone()).collect()
    }

    /// Writes the page, with these pictures, and the tables, and prints.
    pub(crate) fn write(&self, target: &Target<'_>, pictures: Vec<Picture>) -> anyhow::Result<()> {
        let folder = target.folder;
        let mut page = Page {
            title: "Comparison of renderers".to_owned(),
            notes: self.all_notes(),
            command: command_line::typed(),
            pictures,
            ..Page::default()
        };
        if page.shrink(MOST_ON_PAGE)? {
            let line = "Pictures on this page are smaller than they were drawn; those in the folder \
                        are not.";
            page.notes.push(line.to_owned());
        }
        let rows: Vec<Vec<Value>> = (0..self.candidates.len()).map(|i| self.row(i)).collect();
        put(folder, "metrics.csv", csv::table(&names(&columns(&[])), &rows).as_bytes())?;
        page.tables.push(Table {
            caption: format!("Against {}", self.truth),
            columns: columns(&[]),
            rows,
        });
        if self.machines().len() > 1 {
            page.tables.push(self.times_by_machine());
        }
        if self.frames.len() > 1 {
            let keys: &[&str] = match self.machines().is_empty() {
                true => &["frame"],
                false => &["frame", "machine"],
            };
            let columns = columns(keys);
            let rows = self.rows_of_frames();
            put(folder, "frames.csv", csv::table(&names(&columns), &rows).as_bytes())?;
            page.tables.push(Table { caption: "Frame by frame".to_owned(), columns, rows });
        }
        put(folder, "index.html", page.html()?.as_bytes())?;
        let object = self.object(folder);
        put(folder, "metrics.json", serde_json::to_string_pretty(&object)?.as_bytes())?;
        if target.json {
            return terminal::json(&object);
        }
        for i in 0..self.candidates.len() {
            terminal::line(self.line(i))?;
        }
        terminal::line(folder.join("index.html").display())
    }

    fn all_notes(&self) -> Vec<String> {
        let machines = self.machines();
        let device = match machines.len() {
            0 | 1 => self.device.clone(),
            n => format!("{n} machines"),
        };
        let mut notes = vec![format!("{}; {device}.", self.what)];
        notes.extend(self.notes.iter().cloned());
        if self.has_noise {
            let line =
                "The reference's own variance is taken off squared errors; `noise` is what was.";
            notes.push(line.to_owned());
        }
        if self.frames.len() > 1 {
            notes.push(format!(
                "{} frames: squared errors are averaged over all pixels of all frames, PSNR is that of \
                 their mean, the other metrics are means over frames and the largest differences the \
                 largest of any. Shown are the first frame and the one with the largest error.",
                self.frames.len()
            ));
        }
        if machines.len() > 1 {
            notes.push(format!(
                "Frames ran on {} machines, whose times are not averaged with each other.",
                machines.len()
            ));
        }
        notes
    }

    fn name(&self, i: usize) -> String {
        let name = self.candidates.get(i).map(|one| one.name.clone()).unwrap_or_default();
        match self.is_truth(i) {
            true => format!("{name} (reference)"),
            false => name,
        }
    }

    fn row(&self, i: usize) -> Vec<Value> {
        let pooled = self.pooled(i);
        let mut row = vec![json!(self.name(i))];
        row.extend(self.cells(i, pooled.as_ref().map_err(String::as_str)));
        let numbers = self.frames.first().and_then(|told| told.candidates.get(i));
        match self.machines().len() {
            0 | 1 => row.extend(times(&self.runs(i, None), numbers)),
            // No time is that of all.
            _ => row.extend(times(&[], None)),
        }
        row
    }

    /// The times of each candidate on each machine.
    fn times_by_machine(&self) -> Table {
        let all = columns(&["machine"]);
        let head = all.iter().take(2).chain(all.iter().skip(2 + METRICS.len() + 1)).cloned();
        let mut rows = Vec::new();
        for machine in self.machines() {
            for i in 0..self.candidates.len() {
                let on = |told: &&FrameNumbers| told.machine.as_ref() == Some(machine);
                let first = self.frames.iter().find(on).and_then(|told| told.candidates.get(i));
                let mut row = vec![json!(self.name(i)), json!(machine.to_string())];
                row.extend(times(&self.runs(i, Some(machine)), first));
                rows.push(row);
            }
        }
        Table { caption: "Times, machine by machine".to_owned(), columns: head.collect(), rows }
    }

    fn rows_of_frames(&self) -> Vec<Vec<Value>> {
        let mut rows = Vec::new();
        for told in &self.frames {
            for (i, numbers) in told.candidates.iter().enumerate() {
                let mut row = vec![json!(self.name(i)), json!(told.frame.name)];
                row.extend(told.machine.as_ref().map(|machine| json!(machine.to_string())));
                let errors = errors(&numbers.comparison);
                row.extend(self.cells(i, errors.as_ref().map(|e| *e).map_err(String::as_str)));
                row.extend(times(&numbers.runs, Some(numbers)));
                rows.push(row);
            }
        }
        rows
    }

    /// Cells of the metrics and of the noise.
    fn cells(&self, i: usize, errors: Result<&Errors, &str>) -> Vec<Value> {
        let blank = METRICS.iter().map(|_| Value::Null);
        match errors {
            _ if self.truth_at == Some(i) => blank.chain([Value::Null]).collect(),
            Ok(errors) => {
                let named = errors.named();
                let value = |name: &str| {
                    let found = named.iter().find(|(other, _)| *other == name);
                    // JSON knows no infinity, which equal pictures have.
                    found.map_or(
                        Value::Null,
                        |(_, v)| if v.is_finite() { json!(v) } else { json!("equal") },
                    )
                };
                let noise = json!(errors.noise());
                METRICS.iter().map(|(name, ..)| value(name)).chain([noise]).collect()
            }
            Err(line) => [json!(line)].into_iter().chain(blank).collect(),
        }
    }

    fn object(&self, folder: &Path) -> Value {
        let frame = |i: usize, told: &FrameNumbers| {
            let numbers = told.candidates.get(i);
            let comparison = numbers.map(|numbers| &numbers.comparison);
            let runs = numbers.map(|numbers| numbers.runs.as_slice()).unwrap_or_default();
            json!({
                "frame": told.frame.name,
                "comparison": comparison.and_then(|comparison| comparison.as_ref().ok()),
                "error": comparison.and_then(|comparison| comparison.as_ref().err()),
                "first_ms": numbers.and_then(|numbers| numbers.first_ms),
                "runs": runs,
                "n_passes": numbers.and_then(|numbers| numbers.n_passes),
                "graph_bytes": numbers.and_then(|numbers| numbers.graph_bytes),
                "machine": told.machine,
            })
        };
        let each = self.candidates.iter().enumerate().map(|(i, candidate)| {
            let pooled = self.pooled(i);
            let frames = self.frames.iter().map(|told| frame(i, told)).collect::<Vec<_>>();
            json!({
                "name": candidate.name,
                "renderer": candidate.renderer,
                "errors": pooled.as_ref().ok(),
                "error": pooled.as_ref().err(),
                "frames": frames,
            })
        });
        let frames = self
            .frames
            .iter()
            .map(|FrameNumbers { frame, .. }| json!({ "name": frame.name, "view": frame.view }));
        let mut object = json!({
            "command": "compare",
            "version": env!("CARGO_PKG_VERSION"),
            "out": folder.display().to_string(),
            "reference": self.truth,
            "frames": frames.collect::<Vec<_>>(),
            "renderers": each.collect::<Vec<_>>(),
        });
        for (key, value) in &self.head {
            object[key] = value.clone();
        }
        if self.machines().len() > 1 {
            object["adapter"] = Value::Null;
        }
        object
    }

    fn line(&self, i: usize) -> String {
        let name = self.candidates.get(i).map(|one| one.name.as_str()).unwrap_or_default();
        let errors = match self.pooled(i) {
            Ok(errors) => errors,
            Err(line) => return format!("{name}: {line}; nothing is measured"),
        };
        let numbers = self.frames.first().and_then(|told| told.candidates.get(i));
        let first = numbers.and_then(|numbers| numbers.first_ms);
        let time = match self.machines().len() {
            0 | 1 => {
                let runs = all_of(&self.runs(i, None), |run| Some(run.wall_ms));
                let ms = median(&runs).or(first).unwrap_or(0.0);
                format!("{ms:.1} ms")
            }
            n => format!("times of {n} machines"),
        };
        let psnr = errors.psnr.map_or("equal".to_owned(), |psnr| format!("{psnr:.2} dB"));
        format!(
            "{name}: RMSE {:.5}, relMSE {:.5}, PSNR {psnr}, FLIP {:.4}, {time}",
            errors.rmse, errors.rel_mse, errors.flip.mean,
        )
    }
}

/// Cells of the times and of what a frame takes.
fn times(runs: &[Run], numbers: Option<&Numbers>) -> [Value; 7] {
    let wall = all_of(runs, |run| Some(run.wall_ms));
    let megabytes = numbers.and_then(|numbers| numbers.graph_bytes).map(|b| b as f64 / 1e6);
    [
        json!(median(&wall)),
        json!(spread(&wall)),
        json!(median(&all_of(runs, |run| run.cpu_ms))),
        json!(median(&all_of(runs, |run| run.own_passes_ms))),
        json!(numbers.and_then(|numbers| numbers.first_ms)),
        json!(megabytes),
        json!(numbers.and_then(|numbers| numbers.n_passes)),
    ]
}

fn columns(keys: &[&str]) -> Vec<Column> {
    let named = |name: &str, meaning: &str, better: Option<&'static str>| Column {
        name: name.to_owned(),
        meaning: meaning.to_owned(),
        better,
        digits: Some(4),
        ..Column::default()
    };
    let mut all = vec![named("renderer", "", None)];
    all.extend(keys.iter().map(|key| Column { plain: true, ..named(key, "", None) }));
    all.extend(METRICS.iter().map(|(name, meaning, better)| named(name, meaning, Some(*better))));
    all.push(named("noise", "root of the reference's own mean squared error", None));
    all.push(named(
        "frame, ms",
        "median of those after the first; all frames together where a picture is refined",
        Some("less"),
    ));
    all.push(named("spread, ms", "between the quartiles", None));
    all.push(named("CPU, ms", "processor time of a frame, median", Some("less")));
    all.push(named("own passes, ms", "its own passes on the device, median", Some("less")));
    all.push(named("first frame, ms", "with all that had to be made", Some("less")));
    all.push(named("graph, MB", "textures and buffers of its graph", Some("less")));
    all.push(Column {
        digits: None,
        ..named("passes", "passes that ran in the first frame", None)
    });
    all
}

fn names(columns: &[Column]) -> Vec<&str> {
    columns.iter().map(|column| column.name.as_str()).collect()
}

/// Writes a file into the folder.
pub fn put(folder: &Path, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
    files::write_whole(&folder.join(name), bytes)
}
