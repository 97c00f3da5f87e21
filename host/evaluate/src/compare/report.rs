//! What a comparison tells: a page, tables for programs, pictures, and lines.

use super::camera_path::Frame;
use super::candidate::{Candidate, Drawn, Stage};
use super::measured::{CandidateImage, Measured, Truth, errors};
use crate::compare::CompareArguments;
use crate::csv;
use crate::html_page::{Column, Page, Picture, Table};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use surfelshop_api::graph::Output;
use surfelshop_image::metrics::{Comparison, Errors, in_color};
use surfelshop_image::{Image, exr, outputs, png};
use surfelshop_session::input::displayed::DisplayedClouds;
use surfelshop_session::output::{command_line, files, json, terminal};
use surfelshop_session::session::RenderSession;
use surfelshop_session::timing::{Run, all_of, median, spread};

/// Full brightness of the map of relative squared errors: an error as large as the radiance itself.
const FULL_RELATIVE: f32 = 1.0;

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

/// What is kept of a frame: its numbers.
struct FrameOutput {
    frame: Frame,
    candidates: Vec<Numbers>,
}

/// What is kept of a candidate in a frame.
struct Numbers {
    comparison: Result<Comparison, String>,
    first_ms: Option<f64>,
    runs: Vec<Run>,
    n_passes: Option<usize>,
    graph_bytes: Option<u64>,
}

/// A comparison frame by frame; pictures are written as they come.
pub(super) struct ComparisonOutput<'a> {
    arguments: &'a CompareArguments,
    truth: String,
    has_noise: bool,
    truth_at: Option<usize>,
    frames: Vec<FrameOutput>,
    /// Pictures of the first frame, and of the one with the largest error if that is another.
    first: Vec<Picture>,
    worst: Option<(f64, Vec<Picture>)>,
}

impl<'a> ComparisonOutput<'a> {
    pub(super) fn new(arguments: &'a CompareArguments) -> Self {
        Self {
            arguments,
            truth: String::new(),
            has_noise: false,
            truth_at: None,
            frames: Vec::new(),
            first: Vec::new(),
            worst: None,
        }
    }

    /// Writes a frame's pictures and keeps its numbers.
    pub(super) fn frame(
        &mut self,
        stage: &Stage<'_>,
        frame: &Frame,
        candidates: &[Candidate],
        truth: &Truth,
        shots: Vec<CandidateImage>,
        measured: Vec<Measured>,
    ) -> anyhow::Result<()> {
        let pictures = self.pictures(stage, frame, candidates, truth, &shots, &measured)?;
        let rmse = |(_, m): &(usize, &Measured)| errors(&m.comparison).map_or(0.0, |e| e.rmse);
        let others = measured.iter().enumerate().filter(|(i, _)| truth.candidate != Some(*i));
        let error = others.map(|one| rmse(&one)).fold(0.0, f64::max);
        if self.frames.is_empty() {
            self.first = pictures;
            self.worst = Some((error, Vec::new()));
        } else if self.worst.as_ref().is_none_or(|(worst, _)| error > *worst) {
            self.worst = Some((error, pictures));
        }
        self.truth.clone_from(&truth.name);
        self.has_noise = truth.variance.is_some();
        self.truth_at = truth.candidate;
        let numbers = |(shot, measured): (CandidateImage, Measured)| {
            let drawn = shot.drawn.as_ref().ok();
            Numbers {
                comparison: measured.comparison,
                first_ms: drawn.map(|drawn| drawn.first_ms),
                n_passes: drawn.and_then(|drawn| drawn.n_passes),
                graph_bytes: drawn.and_then(|drawn| drawn.graph_bytes),
                runs: shot.runs,
            }
        };
        let candidates = shots.into_iter().zip(measured).map(numbers).collect();
        self.frames.push(FrameOutput { frame: frame.clone(), candidates });
        Ok(())
    }

    /// Writes the pictures of a frame, and returns those of the page.
    fn pictures(
        &self,
        stage: &Stage<'_>,
        frame: &Frame,
        candidates: &[Candidate],
        truth: &Truth,
        shots: &[CandidateImage],
        measured: &[Measured],
    ) -> anyhow::Result<Vec<Picture>> {
        let folder = self.folder(frame);
        let maps_folder = folder.join("maps");
        std::fs::create_dir_all(&maps_folder)?;
        let named = |name: &str| match frame.name.is_empty() {
            true => name.to_owned(),
            false => format!("{}: {name}", frame.name),
        };
        let size = |image: &Image| [image.width, image.height];
        let shown = |image: &Image| {
            let visible = outputs::visible(&Output::Color, image, &stage.staging.how);
            png::encode(&visible, png::Bits::default())
        };
        let (mut all, mut maps) = (Vec::new(), Vec::new());
        if truth.candidate.is_none() {
            let png = shown(&truth.picture)?;
            all.push(Picture::new(named(&truth.name), size(&truth.picture), png));
        }
        let each = candidates.iter().zip(shots).zip(measured).enumerate();
        for (i, ((candidate, shot), measured)) in each {
            let (Candidate { name, .. }, Ok(Drawn { color, .. })) = (candidate, &shot.drawn) else {
                continue;
            };
            let png = shown(color)?;
            put(&folder, &format!("{name}.png"), &png)?;
            let layer = (Output::Color, color.clone());
            put(&folder, &format!("{name}.exr"), &exr::encode(&[&layer])?)?;
            all.push(Picture::new(named(name), size(color), png));
            // There is nothing to see of the reference against itself.
            let is_truth = truth.candidate == Some(i);
            let Some(found) = measured.maps.as_ref().filter(|_| !is_truth) else { continue };
            let relative = in_color(&found.relative_squared, FULL_RELATIVE);
            let flip = found.flip.as_ref().map(|flip| (in_color(flip, 1.0), "FLIP"));
            let both = [Some((relative, "relative squared error")), flip];
            for (map, what) in both.into_iter().flatten() {
                let png = png::encode(&map, png::Bits::default())?;
                // In a folder of their own, where none has the name of another's picture.
                put(&maps_folder, &format!("{name}-{}.png", what.replace(' ', "-")), &png)?;
                maps.push(Picture::new(named(&format!("{name}, {what}")), size(&map), png));
            }
        }
        all.extend(maps);
        Ok(all)
    }

    fn folder(&self, frame: &Frame) -> PathBuf {
        let number = frame.name.split(' ').next().unwrap_or_default();
        match number.is_empty() {
            true => self.arguments.out.clone(),
            false => self.arguments.out.join(format!("frame-{number}")),
        }
    }

    /// A candidate's errors over all frames; a line where one of them has none.
    pub(super) fn pooled(&self, candidate: usize) -> Result<Errors, String> {
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
    pub(super) fn is_truth(&self, candidate: usize) -> bool {
        self.truth_at == Some(candidate)
    }

    /// All runs of a candidate.
    fn runs(&self, candidate: usize) -> Vec<Run> {
        let of = self.frames.iter().filter_map(|told| told.candidates.get(candidate));
        of.flat_map(|numbers| numbers.runs.clone()).collect()
    }

    /// Writes the page and the tables, and prints.
    pub(super) fn write(
        &mut self,
        stage: &Stage<'_>,
        displayed: &DisplayedClouds,
        studio: Option<&RenderSession>,
        candidates: &[Candidate],
    ) -> anyhow::Result<()> {
        let folder = &self.arguments.out;
        let mut page = Page {
            title: "Comparison of renderers".to_owned(),
            notes: self.notes(stage, displayed, studio),
            command: command_line::typed(),
            ..Page::default()
        };
        page.pictures = std::mem::take(&mut self.first);
        page.pictures.extend(self.worst.take().into_iter().flat_map(|(_, pictures)| pictures));
        if page.shrink(MOST_ON_PAGE)? {
            let line = "Pictures on this page are smaller than they were drawn; those in the folder \
                        are not.";
            page.notes.push(line.to_owned());
        }
        let rows: Vec<Vec<Value>> =
            candidates.iter().enumerate().map(|(i, one)| self.row(i, one)).collect();
        put(folder, "metrics.csv", csv::table(&names(&columns(&[])), &rows).as_bytes())?;
        page.tables.push(Table {
            caption: format!("Against {}", self.truth),
            columns: columns(&[]),
            rows,
        });
        if self.frames.len() > 1 {
            let columns = columns(&["frame"]);
            let rows = self.rows_of_frames(candidates);
            put(folder, "frames.csv", csv::table(&names(&columns), &rows).as_bytes())?;
            page.tables.push(Table { caption: "Frame by frame".to_owned(), columns, rows });
        }
        put(folder, "index.html", page.html()?.as_bytes())?;
        let object = self.object(stage, displayed, studio, candidates);
        put(folder, "metrics.json", serde_json::to_string_pretty(&object)?.as_bytes())?;
        if self.arguments.report.json {
            return terminal::json(&object);
        }
        for (i, candidate) in candidates.iter().enumerate() {
            terminal::line(self.line(i, candidate))?;
        }
        terminal::line(folder.join("index.html").display())
    }

    fn notes(
        &self,
        stage: &Stage<'_>,
        displayed: &DisplayedClouds,
        studio: Option<&RenderSession>,
    ) -> Vec<String> {
        let [width, height] = stage.view.size_px;
        let clouds = self.arguments.files.iter().map(|file| file.display().to_string());
        let clouds = clouds.collect::<Vec<_>>().join(", ");
        let device = studio.map_or("no graphics device".to_owned(), |s| s.engine.gpu().describe());
        let mut notes =
            vec![format!("{clouds}, {width} x {height} pixels, against {}; {device}.", self.truth)];
        notes.extend(displayed.line());
        if stage.staging.antialias > 1 {
            notes.push(format!(
                "Each renderer's picture is the mean of {} samples, frames seen at the same places of every pixel \
                 for all, and times are those of all of them; tracers have samples of their own.",
                stage.staging.antialias
            ));
        }
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
        notes
    }

    fn name(&self, i: usize, candidate: &Candidate) -> String {
        match self.truth_at == Some(i) {
            true => format!("{} (reference)", candidate.name),
            false => candidate.name.clone(),
        }
    }

    fn row(&self, i: usize, candidate: &Candidate) -> Vec<Value> {
        let pooled = self.pooled(i);
        let mut row = vec![json!(self.name(i, candidate))];
        row.extend(self.cells(i, pooled.as_ref().map_err(String::as_str)));
        let numbers = self.frames.first().and_then(|told| told.candidates.get(i));
        row.extend(times(&self.runs(i), numbers));
        row
    }

    fn rows_of_frames(&self, candidates: &[Candidate]) -> Vec<Vec<Value>> {
        let mut rows = Vec::new();
        for told in &self.frames {
            for (i, (candidate, numbers)) in candidates.iter().zip(&told.candidates).enumerate() {
                let mut row = vec![json!(self.name(i, candidate)), json!(told.frame.name)];
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

    fn object(
        &self,
        stage: &Stage<'_>,
        displayed: &DisplayedClouds,
        studio: Option<&RenderSession>,
        candidates: &[Candidate],
    ) -> Value {
        let frame = |i: usize, told: &FrameOutput| {
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
            })
        };
        let each = candidates.iter().enumerate().map(|(i, candidate)| {
            let pooled = self.pooled(i);
            let frames = self.frames.iter().map(|told| frame(i, told)).collect::<Vec<_>>();
            json!({
                "name": candidate.name,
                "renderer": match &candidate.ready {
                    Ok(ready) => json::unit(&candidate.reference, &ready.unit, &candidate.values),
                    Err(_) => json!({ "id": candidate.reference.id }),
                },
                "errors": pooled.as_ref().ok(),
                "error": pooled.as_ref().err(),
                "frames": frames,
            })
        });
        let frames = self
            .frames
            .iter()
            .map(|FrameOutput { frame, .. }| json!({ "name": frame.name, "view": frame.view }));
        json!({
            "command": "compare",
            "version": env!("CARGO_PKG_VERSION"),
            "out": self.arguments.out.display().to_string(),
            "reference": self.truth,
            "size": stage.view.size_px,
            "antialias": stage.staging.antialias,
            "scene": stage.staging.scene,
            "facts": stage.clouds.facts,
            "display": displayed.object(),
            "adapter": studio.map(json::adapter),
            "frames": frames.collect::<Vec<_>>(),
            "renderers": each.collect::<Vec<_>>(),
        })
    }

    fn line(&self, i: usize, candidate: &Candidate) -> String {
        let name = &candidate.name;
        let errors = match self.pooled(i) {
            Ok(errors) => errors,
            Err(line) => return format!("{name}: {line}; nothing is measured"),
        };
        let numbers = self.frames.first().and_then(|told| told.candidates.get(i));
        let first = numbers.and_then(|numbers| numbers.first_ms);
        let time = median(&all_of(&self.runs(i), |run| Some(run.wall_ms))).or(first);
        let psnr = errors.psnr.map_or("equal".to_owned(), |psnr| format!("{psnr:.2} dB"));
        format!(
            "{name}: RMSE {:.5}, relMSE {:.5}, PSNR {psnr}, FLIP {:.4}, {:.1} ms",
            errors.rmse,
            errors.rel_mse,
            errors.flip.mean,
            time.unwrap_or(0.0)
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
