//! What a comparison tells: a page, tables for programs, pictures, and lines.

use super::candidate::{Candidate, Drawn};
use super::{Measured, Stage, Truth, put};
use crate::arguments::Bits;
use crate::page::{Column, Page, Picture, Table};
use crate::studio::Studio;
use crate::{exr_file, pictures, report, terminal};
use serde_json::{Value, json};
use surfelshop_api::graph::Output;
use surfelshop_engine::Image;
use surfelshop_engine::metrics::{Comparison, in_color};

/// Full brightness of the map of relative squared errors: an error as large as the radiance itself.
const FULL_RELATIVE: f32 = 1.0;

/// Metrics of the table, with what they mean and which way is better.
const METRICS: [(&str, &str, &str); 9] = [
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

/// Writes all files and prints the table.
pub(super) fn write(
    stage: &Stage<'_>,
    studio: Option<&Studio>,
    candidates: &[Candidate],
    truth: &Truth,
    measured: &[Measured],
) -> anyhow::Result<()> {
    let folder = &stage.arguments.out;
    let mut page = Page { title: "Comparison of renderers".to_owned(), ..Page::default() };
    page.notes = notes(stage, studio, truth);
    let shown = |image: &Image| -> anyhow::Result<Vec<u8>> {
        pictures::png(
            &pictures::visible(&Output::Color, image, &stage.staging.how),
            Bits::default(),
        )
    };
    let size = |image: &Image| [image.width, image.height];
    if truth.candidate.is_none() {
        let png = shown(&truth.picture)?;
        page.pictures.push(Picture::new(&truth.name, size(&truth.picture), &png));
    }
    let mut maps = Vec::new();
    for (candidate, measured) in candidates.iter().zip(measured) {
        let Ok(Drawn { color, .. }) = &candidate.drawn else { continue };
        let png = shown(color)?;
        put(folder, &format!("{}.png", candidate.name), &png)?;
        let layer = (Output::Color, color.clone());
        put(folder, &format!("{}.exr", candidate.name), &exr_file::exr(&[&layer])?)?;
        page.pictures.push(Picture::new(&candidate.name, size(color), &png));
        let Some(found) = &measured.maps else { continue };
        let relative = (in_color(&found.relative_squared, FULL_RELATIVE), "relative squared error");
        let flip = found.flip.as_ref().map(|flip| (in_color(flip, 1.0), "FLIP"));
        for (map, what) in [Some(relative), flip].into_iter().flatten() {
            let png = pictures::png(&map, Bits::default())?;
            let name = format!("{}, {what}", candidate.name);
            put(folder, &format!("{}-{}.png", candidate.name, what.replace(' ', "-")), &png)?;
            maps.push(Picture::new(name, size(&map), &png));
        }
    }
    page.pictures.extend(maps);
    let rows = rows(candidates, truth, measured);
    let csv = csv(&rows);
    page.tables.push(Table {
        caption: format!("Against {}", truth.name),
        columns: columns(),
        rows,
    });
    put(folder, "index.html", page.html()?.as_bytes())?;
    put(folder, "metrics.csv", csv.as_bytes())?;
    let object = object(stage, studio, candidates, truth, measured);
    put(folder, "metrics.json", serde_json::to_string_pretty(&object)?.as_bytes())?;
    if stage.arguments.report.json {
        return terminal::json(&object);
    }
    for (candidate, measured) in candidates.iter().zip(measured) {
        terminal::line(line(candidate, measured))?;
    }
    terminal::line(format!("{}", folder.join("index.html").display()))
}

fn notes(stage: &Stage<'_>, studio: Option<&Studio>, truth: &Truth) -> Vec<String> {
    let [width, height] = stage.view.size_px;
    let clouds = stage.arguments.files.iter().map(|file| file.display().to_string());
    let clouds = clouds.collect::<Vec<_>>().join(", ");
    let device = studio.map_or("no graphics device".to_owned(), |s| s.engine.gpu().describe());
    let typed = std::env::args().skip(1).map(quoted).collect::<Vec<_>>().join(" ");
    let mut notes = vec![
        format!("{clouds}, {width} x {height} pixels, against {}; {device}.", truth.name),
        format!("Made by `surfelshop {typed}`, version {}.", env!("CARGO_PKG_VERSION")),
    ];
    if truth.variance.is_some() {
        let line = "The reference's own variance is taken off squared errors; `noise` is what was.";
        notes.push(line.to_owned());
    }
    notes
}

/// A word as a shell takes it.
pub(crate) fn quoted(word: String) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_=./:,+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word;
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

fn columns() -> Vec<Column> {
    let named = |name: &str, meaning: &str, better: Option<&'static str>| Column {
        name: name.to_owned(),
        meaning: meaning.to_owned(),
        better,
        digits: Some(4),
    };
    let mut all = vec![named("renderer", "", None)];
    all.extend(METRICS.iter().map(|(name, meaning, better)| named(name, meaning, Some(*better))));
    all.push(named("noise", "root of the reference's own mean squared error", None));
    all.push(named("frame, ms", "median of the frames after the first", Some("less")));
    all.push(named("spread, ms", "between the quartiles", None));
    all.push(named("own passes, ms", "its own passes on the device, median", Some("less")));
    all.push(named("first frame, ms", "with all that had to be made", Some("less")));
    all
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut all = values.to_vec();
    all.sort_by(f64::total_cmp);
    all
}

fn median(values: &[f64]) -> Option<f64> {
    let all = sorted(values);
    all.get(all.len() / 2).copied()
}

fn spread(values: &[f64]) -> Option<f64> {
    let all = sorted(values);
    Some(all.get(3 * all.len() / 4)? - all.get(all.len() / 4)?)
}

fn rows(candidates: &[Candidate], truth: &Truth, measured: &[Measured]) -> Vec<Vec<Value>> {
    let row = |(i, (candidate, measured)): (usize, (&Candidate, &Measured))| {
        let is_truth = truth.candidate == Some(i);
        let name = if is_truth {
            format!("{} (reference)", candidate.name)
        } else {
            candidate.name.clone()
        };
        let mut row = vec![json!(name)];
        let errors = match &measured.comparison {
            Ok(Comparison { errors: Some(errors), .. }) => Ok(errors),
            Ok(comparison) => Err(format!("{} pixels are not finite", comparison.n_not_finite)),
            Err(line) => Err(line.clone()),
        };
        match errors {
            _ if is_truth => row.extend(METRICS.iter().map(|_| Value::Null).chain([Value::Null])),
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
                row.extend(METRICS.iter().map(|(name, ..)| value(name)));
                row.push(json!(errors.reference_noise.mse.max(0.0).sqrt()));
            }
            Err(line) => {
                row.push(json!(line));
                row.extend(METRICS.iter().map(|_| Value::Null));
            }
        }
        let times = candidate.drawn.as_ref().ok();
        row.push(json!(times.and_then(|t| median(&t.frames_ms))));
        row.push(json!(times.and_then(|t| spread(&t.frames_ms))));
        row.push(json!(times.and_then(|t| median(&t.passes_ms))));
        row.push(json!(times.map(|t| t.first_ms)));
        row
    };
    candidates.iter().zip(measured).enumerate().map(row).collect()
}

fn csv(rows: &[Vec<Value>]) -> String {
    let cell = |value: &Value| match value {
        Value::Null => String::new(),
        Value::String(text) => format!("\"{}\"", text.replace('"', "\"\"")),
        other => other.to_string(),
    };
    let line = |cells: Vec<String>| cells.join(",") + "\n";
    let head = line(columns().iter().map(|c| format!("\"{}\"", c.name)).collect());
    rows.iter().fold(head, |all, row| all + &line(row.iter().map(cell).collect()))
}

fn object(
    stage: &Stage<'_>,
    studio: Option<&Studio>,
    candidates: &[Candidate],
    truth: &Truth,
    measured: &[Measured],
) -> Value {
    let each: Vec<Value> = candidates
        .iter()
        .zip(measured)
        .map(|(candidate, measured)| {
            let (comparison, error) = match &measured.comparison {
                Ok(comparison) => (Some(comparison), None),
                Err(line) => (None, Some(line)),
            };
            let times = candidate.drawn.as_ref().ok();
            json!({
                "renderer": report::unit(&candidate.reference, &candidate.unit, &candidate.values),
                "comparison": comparison,
                "error": error,
                "first_ms": times.map(|t| t.first_ms),
                "frames_ms": times.map(|t| &t.frames_ms),
                "own_passes_ms": times.map(|t| &t.passes_ms),
            })
        })
        .collect();
    json!({
        "command": "compare",
        "version": env!("CARGO_PKG_VERSION"),
        "out": stage.arguments.out.display().to_string(),
        "reference": truth.name,
        "size": stage.view.size_px,
        "scene": stage.staging.scene,
        "facts": stage.clouds.facts,
        "adapter": studio.map(report::adapter),
        "renderers": each,
    })
}

fn line(candidate: &Candidate, measured: &Measured) -> String {
    let name = &candidate.name;
    match &measured.comparison {
        Err(line) => format!("{name}: {line}"),
        Ok(Comparison { errors: None, n_not_finite, .. }) => {
            format!("{name}: {n_not_finite} pixels are not finite, nothing is measured")
        }
        Ok(Comparison { errors: Some(errors), .. }) => {
            let time = candidate.drawn.as_ref().ok();
            let time = time.and_then(|t| median(&t.frames_ms).or(Some(t.first_ms))).unwrap_or(0.0);
            let psnr = errors.psnr.map_or("equal".to_owned(), |psnr| format!("{psnr:.2} dB"));
            format!(
                "{name}: RMSE {:.5}, relMSE {:.5}, PSNR {psnr}, FLIP {:.4}, {time:.1} ms",
                errors.rmse, errors.rel_mse, errors.flip.mean
            )
        }
    }
}
