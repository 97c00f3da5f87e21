//! Tables of time by pass, of what `bench --split` measured: rows are steps of a paper's algorithm, columns the
//! renderers that were measured.

use crate::entries::PassRow;
use crate::outcome::{Grid, Number};
use anyhow::{Context as _, bail};
use serde_json::Value;
use surfelshop_cloud::in_groups;
use surfelshop_session::timing::{median, spread};

/// What no step of a paper is: graphs, views, what is read back.
const REST: &str = "everything else";
/// Stages behind a frame.
const BEHIND: [&str; 2] = ["display transform", "PNG encoding"];

/// The clock that tells what passes take: CPU time where the device is software, which other work disturbs less, else
/// the time until the device is done with a pass that runs alone.
#[derive(Clone, Copy)]
struct Clock {
    median: &'static str,
    spread: &'static str,
    runs: &'static str,
    name: &'static str,
}

impl Clock {
    fn of(object: &Value) -> Self {
        match object["adapter"]["software"].as_bool() {
            Some(true) => Self {
                median: "cpu_ms",
                spread: "cpu_spread_ms",
                runs: "runs_cpu_ms",
                name: "CPU time",
            },
            _ => Self {
                median: "wall_ms",
                spread: "wall_spread_ms",
                runs: "runs_wall_ms",
                name: "time",
            },
        }
    }
}

/// What a row of a renderer takes.
struct Cell {
    ms: f64,
    spread_ms: Option<f64>,
    /// Places in the JSON file whose sum it is.
    pointers: Vec<String>,
}

/// Whether a stage of `bench` belongs to a row.
fn belongs(stage: &str, row: &PassRow) -> bool {
    let is_of = |beginning: &String| stage.strip_prefix(beginning.as_str());
    let ends = |rest: &str| rest.is_empty() || rest.starts_with([' ', ',', ':']);
    row.stages.iter().any(|beginning| is_of(beginning).is_some_and(ends))
}

/// The stages of split `k` that a test takes, added up; none where there are none.
fn added(
    split: &Value,
    k: usize,
    clock: Clock,
    takes: impl Fn(&str) -> bool,
) -> anyhow::Result<Option<Cell>> {
    let mut cell = Cell { ms: 0.0, spread_ms: None, pointers: Vec::new() };
    let mut runs: Vec<f64> = Vec::new();
    for (j, stage) in split["stages"].as_array().into_iter().flatten().enumerate() {
        // Parts are in the stage that they are of.
        let name = stage["stage"].as_str().unwrap_or_default();
        if stage["is_part"] == true || !takes(name) {
            continue;
        }
        let ms = stage[clock.median].as_f64();
        cell.ms += ms.with_context(|| format!("{name}: expected a time, found none"))?;
        cell.pointers.push(format!("/splits/{k}/stages/{j}/{}", clock.median));
        let of_stage: Vec<f64> =
            stage[clock.runs].as_array().into_iter().flatten().filter_map(Value::as_f64).collect();
        runs.resize(of_stage.len().max(runs.len()), 0.0);
        runs.iter_mut().zip(of_stage).for_each(|(sum, ms)| *sum += ms);
    }
    cell.spread_ms = spread(&runs);
    Ok(Some(cell).filter(|cell| !cell.pointers.is_empty()))
}

/// The rows of split `k`, and what is in none of them.
fn rows(
    split: &Value,
    k: usize,
    clock: Clock,
    wanted: &[PassRow],
) -> anyhow::Result<Vec<Option<Cell>>> {
    let mut all = Vec::with_capacity(wanted.len() + 1);
    for row in wanted {
        all.push(added(split, k, clock, |stage| belongs(stage, row))?);
    }
    let is_left =
        |stage: &str| !BEHIND.contains(&stage) && !wanted.iter().any(|row| belongs(stage, row));
    all.push(added(split, k, clock, is_left)?);
    Ok(all)
}

/// The table and the numbers of a benchmark; `set` are the settings that all its renderers have, for the caption, and
/// `command` is its place among the outcome's commands.
///
/// # Errors
/// One line where it has no stages, or one without a time.
pub(crate) fn table(
    object: &Value,
    wanted: &[PassRow],
    (set, command): (&str, Option<usize>),
) -> anyhow::Result<(Grid, Vec<Number>)> {
    let splits = object["splits"].as_array().map(Vec::as_slice).unwrap_or_default();
    let Some(first) = splits.first() else { bail!("expected a benchmark with --split") };
    let clock = Clock::of(object);
    let text = |name: &str| first[name].as_str().unwrap_or_default();
    let n_runs = first["stages"][0][clock.runs].as_array().map_or(0, Vec::len);
    let caption = format!(
        "{}, {} surfels, {}{set}: milliseconds of {} of each pass, alone; in brackets the distance of the quartiles \
         of {n_runs} frames",
        text("file").rsplit(['/', '\\']).next().unwrap_or_default(),
        in_groups(first["surfels"].as_u64().unwrap_or_default()),
        text("size"),
        clock.name
    );
    let names = splits.iter().map(|split| split["what"].as_str().unwrap_or_default());
    let names: Vec<String> = names.map(|name| name.replace('-', " ")).collect();
    let head = ["pass", "section"].map(str::to_owned).into_iter().chain(names.iter().cloned());
    let mut grid = Grid { caption, head: head.collect(), rows: Vec::new() };
    let rest = PassRow { name: REST.to_owned(), ..PassRow::default() };
    for row in wanted.iter().chain([&rest]) {
        grid.rows.push(vec![row.name.clone(), row.at.clone()]);
    }
    let mut numbers = Vec::new();
    for (k, (split, name)) in splits.iter().zip(&names).enumerate() {
        for (row, cell) in grid.rows.iter_mut().zip(rows(split, k, clock, wanted)?) {
            row.push(cell.as_ref().map_or(String::new(), shown));
            numbers.extend(cell.map(|cell| number(&row[0], name, cell, command)));
        }
    }
    let [mut time, mut rate] = ["a frame as a whole", "frames a second, by the clock"]
        .map(|name| vec![name.to_owned(), String::new()]);
    for (split, name) in splits.iter().zip(&names) {
        let found = frame(object, split, clock);
        time.push(found.as_ref().map_or(String::new(), |(cell, _)| shown(cell)));
        let per_second = found.as_ref().and_then(|(_, rate)| *rate);
        rate.push(per_second.map_or(String::new(), |rate| format!("{rate:.1}")));
        numbers.extend(found.map(|(cell, _)| number("a frame", name, cell, command)));
    }
    grid.rows.extend([time, rate]);
    Ok((grid, numbers))
}

fn number(row: &str, name: &str, cell: Cell, command: Option<usize>) -> Number {
    Number {
        what: format!("{row} at {name}"),
        value: cell.ms,
        unit: "ms".to_owned(),
        printed: String::new(),
        command,
        pointer: cell.pointers.join(" + "),
        is_repeatable: false,
    }
}

/// A time and its spread.
fn shown(cell: &Cell) -> String {
    let spread = cell.spread_ms.map_or(String::new(), |ms| format!(" ({ms:.2})"));
    format!("{:.2}{spread}", cell.ms)
}

/// A frame of a renderer that nothing split, and how many are drawn in a second.
fn frame(object: &Value, split: &Value, clock: Clock) -> Option<(Cell, Option<f64>)> {
    let is_same = |cell: &Value| ["what", "variant"].iter().all(|key| cell[*key] == split[*key]);
    let cells = object["cells"].as_array()?;
    let i = cells.iter().position(is_same)?;
    let cell = &cells[i];
    let ms = cell[clock.median].as_f64()?;
    let pointers = vec![format!("/cells/{i}/{}", clock.median)];
    let spread_ms = cell[clock.spread].as_f64();
    Some((Cell { ms, spread_ms, pointers }, cell["frames_per_second"].as_f64()))
}

/// Where in a benchmark's file a number is that an entry calls `RENDERER: ROW`, or `RENDERER: frame` for the time of a
/// whole frame; what begins with a slash is such a place already.
///
/// # Errors
/// One line where there is no such renderer or row.
pub(crate) fn place(value: &str, object: &Value, wanted: &[PassRow]) -> anyhow::Result<String> {
    if value.is_empty() || value.starts_with('/') {
        return Ok(value.to_owned());
    }
    let (name, row) = value.split_once(": ").with_context(|| format!("{value}: no row"))?;
    let list = |key: &str| object[key].as_array().map(Vec::as_slice).unwrap_or_default();
    let at = |key: &str| list(key).iter().position(|one| one["what"] == name);
    let k = at("splits").with_context(|| format!("{value}: no such renderer"))?;
    let (split, clock) = (&list("splits")[k], Clock::of(object));
    if row == "frame" {
        let found = frame(object, split, clock).with_context(|| format!("{value}: no frame"))?;
        return Ok(found.0.pointers.join(" + "));
    }
    let wanted = wanted.iter().find(|wanted| wanted.name == row);
    let wanted = wanted.with_context(|| format!("{value}: no such row"))?;
    let cell = added(split, k, clock, |stage| belongs(stage, wanted))?;
    Ok(cell.with_context(|| format!("{value}: no such pass ran"))?.pointers.join(" + "))
}

/// The middle of a JSON file's numbers at places that are added up; of a list of runs it is the median time.
#[must_use]
pub(crate) fn at(object: &Value, pointers: &str) -> Option<f64> {
    let one = |pointer: &str| {
        let found = object.pointer(pointer)?;
        found.as_f64().or_else(|| {
            let runs = found.as_array()?.iter().map(|run| run["wall_ms"].as_f64());
            median(&runs.collect::<Option<Vec<_>>>()?)
        })
    };
    pointers.split(" + ").map(one).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn benchmark(software: bool) -> Value {
        let stage = |name: &str, ms: f64| {
            json!({
                "stage": name, "is_part": name.starts_with("surfels: "), "cpu_ms": ms, "wall_ms": 2.0 * ms,
                "runs_cpu_ms": [ms, ms - 1.0, ms + 1.0], "runs_wall_ms": [2.0 * ms],
            })
        };
        let stages = [
            stage("graph", 1.0),
            stage("surfels", 8.0),
            stage("surfels: packing", 4.0),
            stage("pass shadow maps, bounce 1", 10.0),
            stage("pass shadow maps, bounce 2", 20.0),
            stage("pass shadow mapsy", 64.0),
            stage("PNG encoding", 500.0),
        ];
        let cell = json!({
            "what": "a-1", "variant": "cpu", "wall_ms": 50.0, "cpu_ms": 70.0, "cpu_spread_ms": 2.0,
            "frames_per_second": 20.0,
        });
        json!({
            "adapter": { "software": software },
            "cells": [cell],
            "splits": [{ "file": "x/y.ply", "surfels": 7, "size": "8x8", "what": "a-1", "variant": "cpu", "stages": stages }],
        })
    }

    fn wanted() -> Vec<PassRow> {
        let row = |name: &str, stage: &str| PassRow {
            name: name.to_owned(),
            at: "4.3".to_owned(),
            stages: vec![stage.to_owned()],
        };
        vec![row("surfels", "surfels"), row("maps", "pass shadow maps"), row("none", "pass no")]
    }

    #[test]
    fn every_stage_of_a_frame_is_in_one_row() {
        let object = benchmark(true);
        let (grid, numbers) = table(&object, &wanted(), (", a=1", Some(3))).unwrap();
        assert_eq!(grid.head, ["pass", "section", "a 1"]);
        let column: Vec<&str> = grid.rows.iter().map(|row| row[2].as_str()).collect();
        assert_eq!(
            column,
            ["8.00 (2.00)", "30.00 (4.00)", "", "65.00 (4.00)", "70.00 (2.00)", "20.0"]
        );
        assert!(grid.caption.starts_with("y.ply, 7 surfels, 8x8, a=1: "), "{}", grid.caption);
        let sum: f64 = numbers.iter().map(|number| number.value).sum();
        assert_eq!(sum, 103.0 + 70.0, "parts and what comes behind a frame do not count");
        for number in &numbers {
            assert_eq!(at(&object, &number.pointer), Some(number.value), "{}", number.what);
        }
    }

    #[test]
    fn rows_are_found_by_what_entries_call_them() {
        let object = benchmark(false);
        let found = |value: &str| place(value, &object, &wanted());
        let maps = found("a-1: maps").unwrap();
        assert_eq!(maps, "/splits/0/stages/3/wall_ms + /splits/0/stages/4/wall_ms");
        assert_eq!(at(&object, &maps), Some(60.0));
        assert_eq!(at(&object, &found("a-1: frame").unwrap()), Some(50.0));
        assert_eq!(found("/cells/0").unwrap(), "/cells/0");
        for wrong in ["a-2: maps", "a-1: none", "a-1: nothing", "maps"] {
            assert!(found(wrong).is_err(), "{wrong}");
        }
        assert!(table(&json!({ "splits": [] }), &wanted(), ("", None)).is_err());
        let runs = json!({ "a": [{ "wall_ms": 1.0 }, { "wall_ms": 5.0 }, { "wall_ms": 3.0 }] });
        assert_eq!(at(&runs, "/a"), Some(3.0));
        assert_eq!(at(&runs, "/a + /b"), None);
    }
}
