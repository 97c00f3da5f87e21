//! What a report tells: a page with plots and tables, and the same numbers for programs.

use super::cells::Cell;
use super::error_columns::{self, ErrorColumn};
use super::{plot, without_reference};
use crate::compare::put;
use crate::comparison_page::{Column, Page, Plot, Table};
use crate::csv;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::path::Path;
use surfelshop_runtime::plugins::UnitRef;
use surfelshop_session::output::machine::Machine;
use surfelshop_session::output::{command_line, terminal};
use surfelshop_session::timing::{median, spread};

/// What was swept.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Swept {
    pub(super) unit: SweptUnit,
    /// Size of the picture, or of the cloud.
    pub(super) what: String,
    /// What errors are measured against.
    pub(super) truth: String,
    /// What it ran on.
    pub(super) device: String,
    /// The error of the plots, in words.
    pub(super) error: String,
    pub(super) time: Time,
    /// What else is to be known of the numbers.
    pub(super) note: Option<String>,
    /// Knobs and their cells.
    pub(crate) all: Vec<(String, Vec<Cell>)>,
}

/// A unit that was swept.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct SweptUnit {
    kind: String,
    package: String,
    id: String,
}

impl From<&UnitRef> for SweptUnit {
    fn from(unit: &UnitRef) -> Self {
        let UnitRef { kind, package, id, .. } = unit;
        Self { kind: kind.word().to_owned(), package: package.clone(), id: id.clone() }
    }
}

impl Swept {
    fn errors(&self) -> Vec<ErrorColumn> {
        match self.time {
            Time::Tools => error_columns::of_tools(),
            Time::Passes | Time::Frames => error_columns::of_pictures(),
        }
    }

    /// The machines that cells ran on, each once; none where that is not told.
    fn machines(&self) -> Vec<&Machine> {
        let cells = self.all.iter().flat_map(|(_, cells)| cells);
        let mut all: Vec<&Machine> = cells.filter_map(|cell| cell.machine.as_ref()).collect();
        all.sort();
        all.dedup();
        all
    }
}

/// Which time counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
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

/// Where a report is told, and what was typed.
pub(crate) struct Target<'a> {
    /// The folder of page and tables.
    pub(crate) folder: &'a Path,
    /// Whether one JSON object is printed instead of lines.
    pub(crate) json: bool,
    /// The words of the command that measured.
    pub(crate) words: &'a [String],
}

/// Writes all files and prints the tables.
pub(crate) fn write(target: &Target<'_>, swept: &Swept) -> anyhow::Result<()> {
    let Swept { unit, what, truth, all, .. } = swept;
    let Target { folder, words, .. } = *target;
    let machines = swept.machines();
    let device = match machines.len() {
        0 | 1 => swept.device.clone(),
        n => format!("{n} machines"),
    };
    let mut page = Page {
        title: format!("{}: error against time", unit.id),
        notes: vec![
            format!("{what}, against {truth}; {device}."),
            "Times are medians of runs in turns; the first of each is left out. On the thick line are the \
             settings that no other one beats in both time and error. A red line is the noise of the \
             reference: errors below it are not known."
                .to_owned(),
        ],
        command: command_line::typed(),
        ..Page::default()
    };
    page.notes.extend(swept.note.clone());
    let mut for_programs = Vec::new();
    for (knob, cells) in all {
        let title = format!("{} by {knob}, against {truth}", unit.id);
        if cells.len() > 1 && cells.iter().all(|cell| cell.error("rmse") == Some(0.0)) {
            page.notes
                .push(format!("All errors by {knob} are zero: these values change nothing here."));
        }
        page.plots.extend(plots(swept, folder, (knob, &title), cells)?);
        let rows = cells.iter().map(|cell| row(swept, words, cell)).collect();
        page.tables.push(Table { caption: title, columns: columns(swept, knob), rows });
        for_programs.extend(cells.iter().map(|cell| row_of_csv(swept, words, cell)));
    }
    put(folder, "index.html", page.html()?.as_bytes())?;
    let csv = csv::table(&head_of_csv(swept), &for_programs);
    put(folder, "report.csv", csv.as_bytes())?;
    let knob = |(knob, cells): &(String, Vec<Cell>)| json!({ "id": knob, "cells": cells });
    let object = json!({
        "command": "report",
        "version": env!("CARGO_PKG_VERSION"),
        "unit": unit,
        "reference": truth,
        "of": what,
        "device": device,
        "knobs": all.iter().map(knob).collect::<Vec<_>>(),
    });
    put(folder, "report.json", serde_json::to_string_pretty(&object)?.as_bytes())?;
    if target.json {
        return terminal::json(&object);
    }
    for (_, cells) in all {
        let time = swept.time.among(cells);
        for cell in cells {
            terminal::line(line(time, cell))?;
        }
    }
    terminal::line(folder.join("index.html").display())
}

/// The plots of a knob, of which each is a file, too: times of different machines are not put into one.
fn plots(
    swept: &Swept,
    folder: &Path,
    (knob, title): (&str, &str),
    cells: &[Cell],
) -> anyhow::Result<Vec<Plot>> {
    let machines = swept.machines();
    if machines.len() < 2 {
        let svg = plot::svg(title, (&swept.error, swept.time), cells)?;
        let Some(svg) = svg else { return Ok(Vec::new()) };
        put(folder, &format!("{knob}.svg"), svg.as_bytes())?;
        return Ok(vec![Plot { caption: title.to_owned(), svg }]);
    }
    let mut all = Vec::new();
    for (i, machine) in machines.into_iter().enumerate() {
        let on = |cell: &&Cell| cell.machine.as_ref() == Some(machine);
        let own: Vec<Cell> = cells.iter().filter(on).cloned().collect();
        let caption = format!("{title}, on {machine}");
        if let Some(svg) = plot::svg(&caption, (&swept.error, swept.time), &own)? {
            put(folder, &format!("{knob}-machine-{}.svg", i + 1), svg.as_bytes())?;
            all.push(Plot { caption, svg });
        }
    }
    Ok(all)
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
fn times(swept: &Swept, cell: &Cell) -> Vec<(&'static str, &'static str, Option<f64>)> {
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

fn columns(swept: &Swept, knob: &str) -> Vec<Column> {
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
    all.extend(swept.errors().iter().map(|(name, meaning, better)| named(name, meaning, better)));
    all.push(named("noise", "root of the reference's own mean squared error", ""));
    all.extend(times(swept, &empty).into_iter().map(|(name, meaning, _)| named(name, meaning, "")));
    if !swept.machines().is_empty() {
        all.push(Column { plain: true, ..named("machine", "what it ran on", "") });
    }
    all.push(Column { code: true, ..named("command", "measures this row again", "") });
    all
}

fn row(swept: &Swept, words: &[String], cell: &Cell) -> Vec<Value> {
    let number = cell.value.parse::<f64>().ok().filter(|value| value.is_finite());
    let mut row = vec![number.map_or(json!(cell.value), |number| json!(number))];
    match &cell.fault {
        Some(fault) => {
            row.push(json!(fault));
            row.extend(swept.errors().iter().skip(1).map(|_| Value::Null));
        }
        None => row.extend(swept.errors().iter().map(|(name, ..)| error(cell, name))),
    }
    row.push(json!((!cell.is_faulty()).then_some(cell.noise)));
    row.extend(times(swept, cell).into_iter().map(|(.., value)| json!(value)));
    row.extend(machine_cell(swept, cell));
    row.push(json!(without_reference::command(words, cell)));
    row
}

/// What a cell ran on, where tables have a column for that.
fn machine_cell(swept: &Swept, cell: &Cell) -> Option<Value> {
    let machine = cell.machine.as_ref().map(ToString::to_string);
    (!swept.machines().is_empty()).then(|| json!(machine))
}

/// An error of a cell in a table. JSON knows no infinity, which the decibels of equal pictures are.
fn error(cell: &Cell, name: &str) -> Value {
    match cell.error(name) {
        None if name == "psnr" && cell.error("rmse") == Some(0.0) => json!("equal"),
        found => json!(found),
    }
}

/// The head of the table for programs.
fn head_of_csv(swept: &Swept) -> Vec<&'static str> {
    let empty = Cell::faulty("", "", String::new());
    let errors = swept.errors().into_iter().map(|(name, ..)| name);
    let times = times(swept, &empty).into_iter().map(|(name, ..)| name);
    let head = ["knob", "value"].into_iter().chain(errors).chain(["noise"]).chain(times);
    let machine = (!swept.machines().is_empty()).then_some("machine");
    head.chain(machine).chain(["fault", "command"]).collect()
}

fn row_of_csv(swept: &Swept, words: &[String], cell: &Cell) -> Vec<Value> {
    let mut row = vec![json!(cell.knob), json!(cell.value)];
    row.extend(swept.errors().iter().map(|(name, ..)| error(cell, name)));
    row.push(json!((!cell.is_faulty()).then_some(cell.noise)));
    row.extend(times(swept, cell).into_iter().map(|(.., value)| json!(value)));
    row.extend(machine_cell(swept, cell));
    row.extend([json!(cell.fault), json!(without_reference::command(words, cell))]);
    row
}
