//! What a report tells: a page with plots and tables, and the same numbers for programs.

use super::cells::{Cell, median};
use super::plot;
use crate::arguments::SweepArguments;
use crate::compare::{Stage, Truth, put, quoted};
use crate::page::{Column, Page, Plot, Table};
use crate::studio::Studio;
use crate::terminal;
use serde_json::{Value, json};
use surfelshop_engine::plugins::UnitRef;

/// Errors in the tables.
const ERRORS: [&str; 5] = ["rmse", "rel_mse", "psnr", "ssim", "flip.mean"];

/// Writes all files and prints the tables.
pub(super) fn write(
    arguments: &SweepArguments,
    stage: &Stage<'_>,
    studio: &Studio,
    unit: &UnitRef,
    truth: &Truth,
    all: &[(String, Vec<Cell>)],
) -> anyhow::Result<()> {
    let device = studio.engine.gpu().describe();
    let [width, height] = stage.view.size_px;
    let typed = std::env::args().skip(1).map(quoted).collect::<Vec<_>>().join(" ");
    let mut page = Page {
        title: format!("{}: error against time", unit.id),
        notes: vec![
            format!("{width} x {height} pixels, against {}; {device}.", truth.name),
            format!("Made by `surfelshop {typed}`, version {}.", env!("CARGO_PKG_VERSION")),
            "A row alone is repeated by the same command with one value behind `--knob`, into \
             another folder."
                .to_owned(),
        ],
        ..Page::default()
    };
    let mut csv = String::from("\"knob\",\"value\",\"rmse\",\"rel_mse\",\"psnr\",\"ssim\",");
    csv += "\"flip.mean\",\"noise\",\"frame_ms\",\"own_passes_ms\",\"first_ms\",\"fault\"\n";
    for (knob, cells) in all {
        let title = format!("{} by {knob}, against {}", unit.id, truth.name);
        if let Some(svg) = plot::svg(&title, cells)? {
            put(&arguments.out, &format!("{knob}.svg"), svg.as_bytes())?;
            page.plots.push(Plot { caption: title.clone(), svg });
        }
        page.tables.push(Table { caption: title, columns: columns(knob), rows: rows(cells) });
        for cell in cells {
            csv += &line_of_csv(cell);
        }
    }
    put(&arguments.out, "index.html", page.html()?.as_bytes())?;
    put(&arguments.out, "report.csv", csv.as_bytes())?;
    let object = json!({
        "command": "report",
        "version": env!("CARGO_PKG_VERSION"),
        "renderer": unit.to_string(),
        "reference": truth.name,
        "adapter": device,
        "size": stage.view.size_px,
        "knobs": all.iter().map(|(knob, cells)| json!({ "id": knob, "cells": cells })).collect::<Vec<_>>(),
    });
    put(&arguments.out, "report.json", serde_json::to_string_pretty(&object)?.as_bytes())?;
    if arguments.report.json {
        return terminal::json(&object);
    }
    for cell in all.iter().flat_map(|(_, cells)| cells) {
        terminal::line(line(cell))?;
    }
    terminal::line(arguments.out.join("index.html").display())
}

fn line(cell: &Cell) -> String {
    let Cell { knob, value, .. } = cell;
    if let Some(fault) = &cell.fault {
        return format!("{knob}={value}: {fault}");
    }
    let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.5}"));
    format!(
        "{knob}={value}: RMSE {}, FLIP {}, {:.2} ms",
        number(cell.error("rmse")),
        number(cell.error("flip.mean")),
        cell.milliseconds().unwrap_or(f64::NAN)
    )
}

fn columns(knob: &str) -> Vec<Column> {
    let named = |name: &str, better: Option<&'static str>| Column {
        name: name.to_owned(),
        better,
        digits: Some(4),
        ..Column::default()
    };
    let mut all = vec![named(knob, None)];
    all.extend(ERRORS.map(|name| {
        let more = matches!(name, "psnr" | "ssim");
        named(name, Some(if more { "more" } else { "less" }))
    }));
    all.extend(["noise", "frame, ms", "own passes, ms", "first frame, ms"].map(|n| named(n, None)));
    all
}

fn rows(cells: &[Cell]) -> Vec<Vec<Value>> {
    let row = |cell: &Cell| {
        let mut row = vec![json!(cell.value)];
        match &cell.fault {
            Some(fault) => {
                row.push(json!(fault));
                row.extend(ERRORS[1..].iter().map(|_| Value::Null));
            }
            None => row.extend(ERRORS.map(|name| json!(cell.error(name)))),
        }
        row.push(json!(cell.noise));
        row.extend(
            [median(&cell.frames_ms), median(&cell.passes_ms), Some(cell.first_ms)]
                .map(|v| json!(v)),
        );
        row
    };
    cells.iter().map(row).collect()
}

fn line_of_csv(cell: &Cell) -> String {
    let number = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
    let text = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    let mut words = vec![text(&cell.knob), text(&cell.value)];
    words.extend(ERRORS.map(|name| number(cell.error(name))));
    words.push(cell.noise.to_string());
    words.extend(
        [median(&cell.frames_ms), median(&cell.passes_ms), Some(cell.first_ms)].map(number),
    );
    words.push(cell.fault.as_deref().map(text).unwrap_or_default());
    words.join(",") + "\n"
}
