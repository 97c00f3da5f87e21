//! What a report tells: a page with plots and tables, and the same numbers for programs.

use super::cells::Cell;
use super::{plot, without_reference};
use crate::compare::put;
use crate::csv;
use crate::html_page::{Column, Page, Plot, Table};
use crate::report::ReportArguments;
use serde_json::{Value, json};
use surfelshop_runtime::plugins::UnitRef;
use surfelshop_session::output::{command_line, terminal};
use surfelshop_session::timing::{median, spread};

/// What was swept.
pub(super) struct Swept<'a> {
    pub(super) unit: &'a UnitRef,
    /// Size of the picture, or of the cloud.
    pub(super) what: String,
    /// What errors are measured against.
    pub(super) truth: String,
    /// What it ran on.
    pub(super) device: String,
    /// Errors in the tables: name, meaning, and `less`, `more` or neither.
    pub(super) errors: &'a [(&'static str, &'static str, &'static str)],
    /// The error of the plots, in words.
    pub(super) error: &'a str,
    pub(super) time: Time,
    /// What else is to be known of the numbers.
    pub(super) note: Option<String>,
    /// Knobs and their cells.
    pub(super) all: &'a [(String, Vec<Cell>)],
}

/// Which time counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Time {
    /// A renderer's own passes, or whole frames where the device does not tell those.
    Passes,
    /// Whole frames.
    Frames,
    /// Processor time, or the clock where the system does not tell it.
    Tools,
}

impl Time {
    /// What counts among cells that are compared: whole frames where not all of them tell more.
    pub fn among<'a>(self, cells: impl IntoIterator<Item = &'a Cell>) -> Self {
        let tells = |cell: &Cell| !cell.times(|run| run.own_passes_ms).is_empty();
        let mut timed = cells.into_iter().filter(|cell| !cell.times(|_| Some(0.0)).is_empty());
        match self {
            Self::Passes if !timed.all(tells) => Self::Frames,
            _ => self,
        }
    }

    /// Median milliseconds of a cell, and what they are of.
    pub fn of(self, cell: &Cell) -> Option<(f64, &'static str)> {
        let own = match self {
            Self::Passes => cell.times(|run| run.own_passes_ms),
            Self::Frames => Vec::new(),
            Self::Tools => cell.times(|run| run.cpu_ms),
        };
        let (own_word, wall_word) = match self {
            Self::Passes | Self::Frames => ("of its own passes", "a picture"),
            Self::Tools => ("of processor time", "a run"),
        };
        match median(&own) {
            Some(ms) => Some((ms, own_word)),
            None => median(&cell.times(|run| Some(run.wall_ms))).map(|ms| (ms, wall_word)),
        }
    }
}

/// Writes all files and prints the tables.
pub(super) fn write(arguments: &ReportArguments, swept: &Swept<'_>) -> anyhow::Result<()> {
    let Swept { unit, what, truth, device, all, .. } = swept;
    let words: Vec<String> = std::env::args().skip(1).collect();
    let mut page = Page {
        title: format!("{}: error against time", unit.id),
        notes: vec![
            format!("{what}, against {truth}; {device}."),
            "Times are medians of runs in turns, the first of each left out. The thick line joins \
             what nothing beats in both; below the red one, the reference's own noise, no error is \
             known."
                .to_owned(),
        ],
        command: command_line::typed(),
        ..Page::default()
    };
    page.notes.extend(swept.note.clone());
    let mut for_programs = Vec::new();
    for (knob, cells) in *all {
        let title = format!("{} by {knob}, against {truth}", unit.id);
        if let Some(svg) = plot::svg(&title, (swept.error, swept.time), cells)? {
            put(&arguments.out, &format!("{knob}.svg"), svg.as_bytes())?;
            page.plots.push(Plot { caption: title.clone(), svg });
        }
        let rows = cells.iter().map(|cell| row(swept, &words, cell)).collect();
        page.tables.push(Table { caption: title, columns: columns(swept, knob), rows });
        for_programs.extend(cells.iter().map(|cell| row_of_csv(swept, &words, cell)));
    }
    put(&arguments.out, "index.html", page.html()?.as_bytes())?;
    let csv = csv::table(&head_of_csv(swept), &for_programs);
    put(&arguments.out, "report.csv", csv.as_bytes())?;
    let knob = |(knob, cells): &(String, Vec<Cell>)| json!({ "id": knob, "cells": cells });
    let object = json!({
        "command": "report",
        "version": env!("CARGO_PKG_VERSION"),
        "unit": { "kind": unit.kind.word(), "package": unit.package, "id": unit.id },
        "reference": truth,
        "of": what,
        "device": device,
        "knobs": all.iter().map(knob).collect::<Vec<_>>(),
    });
    put(&arguments.out, "report.json", serde_json::to_string_pretty(&object)?.as_bytes())?;
    if arguments.report.json {
        return terminal::json(&object);
    }
    for (_, cells) in *all {
        let time = swept.time.among(cells);
        for cell in cells {
            terminal::line(line(time, cell))?;
        }
    }
    terminal::line(arguments.out.join("index.html").display())
}

fn line(by: Time, cell: &Cell) -> String {
    let Cell { knob, value, .. } = cell;
    if let Some(fault) = &cell.fault {
        return format!("{knob}={value}: {fault}");
    }
    let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.5}"));
    let time = by.of(cell).map(|(ms, of)| format!("{ms:.2} ms {of}"));
    let time = time.unwrap_or_else(|| format!("{:.2} ms the first time", cell.first_ms));
    let second = match by {
        Time::Passes | Time::Frames => format!("FLIP {}", number(cell.error("flip.mean"))),
        Time::Tools => format!("largest {}", number(cell.error("max_absolute"))),
    };
    format!("{knob}={value}: RMSE {}, {second}, {time}", number(cell.error("rmse")))
}

/// Times of a cell by their names.
fn times(swept: &Swept<'_>, cell: &Cell) -> Vec<(&'static str, &'static str, Option<f64>)> {
    let wall = cell.times(|run| Some(run.wall_ms));
    let (of, meaning) = match swept.time {
        Time::Passes | Time::Frames => {
            ("frame, ms", "by the clock, median; all frames together where a picture is refined")
        }
        Time::Tools => ("run, ms", "by the clock, median"),
    };
    let mut all = vec![
        (of, meaning, median(&wall)),
        ("spread, ms", "between the quartiles", spread(&wall)),
        ("CPU, ms", "processor time, median", median(&cell.times(|run| run.cpu_ms))),
    ];
    if swept.time == Time::Passes {
        let own = cell.times(|run| run.own_passes_ms);
        all.push(("own passes, ms", "its own passes on the device, median", median(&own)));
        all.push(("own spread, ms", "of its own passes, between the quartiles", spread(&own)));
    }
    let first = "the first time, with all that had to be made and no row above it had made";
    all.push(("first, ms", first, (!cell.is_faulty()).then_some(cell.first_ms)));
    if swept.time == Time::Passes {
        let megabytes = cell.graph_bytes.map(|bytes| bytes as f64 / 1e6);
        all.push(("graph, MB", "its textures and buffers", megabytes));
        let n_passes = cell.n_passes.map(|n| n as f64);
        all.push(("passes", "passes that ran the first time, each a pipeline", n_passes));
    }
    all
}

fn columns(swept: &Swept<'_>, knob: &str) -> Vec<Column> {
    let named = |name: &str, meaning: &str, better: &'static str| Column {
        name: name.to_owned(),
        meaning: meaning.to_owned(),
        better: (!better.is_empty()).then_some(better),
        digits: Some(4),
        ..Column::default()
    };
    let empty = Cell::faulty(knob, "", String::new());
    // Values are shown as they were typed.
    let mut all = vec![Column { digits: None, plain: true, ..named(knob, "", "") }];
    all.extend(swept.errors.iter().map(|(name, meaning, better)| named(name, meaning, better)));
    all.push(named("noise", "root of the reference's own mean squared error", ""));
    all.extend(times(swept, &empty).into_iter().map(|(name, meaning, _)| named(name, meaning, "")));
    all.push(Column { code: true, ..named("command", "measures this row again", "") });
    all
}

fn row(swept: &Swept<'_>, words: &[String], cell: &Cell) -> Vec<Value> {
    let number = cell.value.parse::<f64>().ok().filter(|value| value.is_finite());
    let mut row = vec![number.map_or(json!(cell.value), |number| json!(number))];
    match &cell.fault {
        Some(fault) => {
            row.push(json!(fault));
            row.extend(swept.errors[1..].iter().map(|_| Value::Null));
        }
        None => row.extend(swept.errors.iter().map(|(name, ..)| error(cell, name))),
    }
    row.push(json!((!cell.is_faulty()).then_some(cell.noise)));
    row.extend(times(swept, cell).into_iter().map(|(.., value)| json!(value)));
    row.push(json!(without_reference::command(words, cell)));
    row
}

/// An error of a cell in a table. JSON knows no infinity, which the decibels of equal pictures are.
fn error(cell: &Cell, name: &str) -> Value {
    match cell.error(name) {
        None if name == "psnr" && cell.error("rmse") == Some(0.0) => json!("equal"),
        found => json!(found),
    }
}

/// The head of the table for programs.
fn head_of_csv<'a>(swept: &Swept<'a>) -> Vec<&'a str> {
    let empty = Cell::faulty("", "", String::new());
    let errors = swept.errors.iter().map(|(name, ..)| *name);
    let times = times(swept, &empty).into_iter().map(|(name, ..)| name);
    let head = ["knob", "value"].into_iter().chain(errors).chain(["noise"]).chain(times);
    head.chain(["fault", "command"]).collect()
}

fn row_of_csv(swept: &Swept<'_>, words: &[String], cell: &Cell) -> Vec<Value> {
    let mut row = vec![json!(cell.knob), json!(cell.value)];
    row.extend(swept.errors.iter().map(|(name, ..)| error(cell, name)));
    row.push(json!((!cell.is_faulty()).then_some(cell.noise)));
    row.extend(times(swept, cell).into_iter().map(|(.., value)| json!(value)));
    row.extend([json!(cell.fault), json!(without_reference::command(words, cell))]);
    row
}
