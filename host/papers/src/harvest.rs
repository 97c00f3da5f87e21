//! What the commands of an entry left in its folder: pictures, numbers and plots.

use crate::entries::{Against, PassRow};
use crate::outcome::{Drawing, Grid, Number, Outcome, PictureFile};
use crate::passes;
use anyhow::{Context as _, anyhow};
use serde_json::Value;
use std::path::Path;
use surfelshop_cloud::in_groups;
use surfelshop_session::output::files;
use surfelshop_session::timing::{median, spread};

/// Most bytes of a JSON file or a drawing that a command writes.
const MOST_BYTES: u64 = 64 << 20;

/// A file of JSON.
pub(crate) fn json(path: &Path) -> anyhow::Result<Value> {
    let bytes = files::read_short(path, MOST_BYTES)?;
    serde_json::from_slice(&bytes).with_context(|| format!("{}: it is no JSON", path.display()))
}

/// The JSON file of a step.
pub(crate) fn file_of(command: &str) -> Option<&'static str> {
    match command {
        "compare" => Some("metrics.json"),
        "report" => Some("report.json"),
        "bench" => Some("bench.json"),
        "info" => Some("info.json"),
        _ => None,
    }
}

/// Adds what a step left in `folder/number`.
pub(crate) fn take(
    outcome: &mut Outcome,
    folder: &Path,
    rows: &[PassRow],
    (number, words, said): (usize, &[String], String),
) -> anyhow::Result<()> {
    let command = outcome.commands.len().checked_sub(1);
    let own = folder.join(number.to_string());
    match words.first().map(String::as_str) {
        Some("compare") => comparison(outcome, &own, (number, command)),
        Some("report") => report(outcome, &own, (words, command)),
        Some("bench") => {
            let object = json(&own.join("bench.json"))?;
            let set = settings(words, |setting| !setting.contains(':'));
            let (grid, numbers) = passes::table(&object, rows, (&set, command))?;
            outcome.tables.push(grid);
            outcome.numbers.extend(numbers);
            Ok(())
        }
        Some("render") => {
            for pair in words.windows(2).filter(|pair| pair[0] == "-o") {
                let path = Path::new(&pair[1]);
                let Some(name) = path.file_name().and_then(|name| name.to_str()) else { continue };
                if let Some(stem) = name.strip_suffix(".png") {
                    let picture = PictureFile { name: label(stem), file: name.to_owned() };
                    outcome.pictures.push(picture);
                }
            }
            Ok(())
        }
        // What it prints with --json.
        Some("info") => {
            std::fs::create_dir_all(&own)
                .with_context(|| format!("{}: the folder cannot be made", own.display()))?;
            files::write_whole(&own.join("info.json"), said.as_bytes())
        }
        Some("bake" | "explain") => {
            // Paths of this machine are no part of a page.
            let lines = said.lines().filter(|line| !line.contains(".ply: ")).map(without_folders);
            outcome.said.push(lines.collect::<Vec<_>>().join("\n"));
            Ok(())
        }
        _ => Ok(()),
    }
}

/// A line with the names alone of files whose paths begin at the root.
fn without_folders(line: &str) -> String {
    let word = |word: &str| {
        let path = word.trim_start_matches('(');
        let is_path = path.starts_with('/') && path.len() > 1;
        let name = path.rsplit('/').next().filter(|_| is_path);
        name.map_or(word.to_owned(), |name| word.replacen(path, name, 1))
    };
    line.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

/// A file's name in words, and what a renderer is called.
fn label(stem: &str) -> String {
    match stem {
        "reference" => "paths".to_owned(),
        stem => stem.replace('-', " "),
    }
}

/// Milliseconds of the runs in a list: median and the distance of the quartiles, which one run has not.
fn times(runs: Option<&Value>) -> Option<(f64, Option<f64>)> {
    let runs = runs?.as_array()?;
    let of = |run: &Value| run.get("wall_ms").and_then(Value::as_f64);
    let all: Option<Vec<f64>> = runs.iter().map(of).collect();
    all.and_then(|all| Some((median(&all)?, spread(&all).filter(|_| all.len() > 1))))
}

fn comparison(
    outcome: &mut Outcome,
    own: &Path,
    (number, command): (usize, Option<usize>),
) -> anyhow::Result<()> {
    let object = json(&own.join("metrics.json"))?;
    let reference = object["reference"].as_str().unwrap_or_default();
    let renderers = object["renderers"].as_array().map(Vec::as_slice).unwrap_or_default();
    let head = ["", "RMSE", "FLIP", "ms", "spread, ms", "frames/s", "million surfels/s"];
    let head = head.map(str::to_owned).to_vec();
    let shown = Path::new(reference).file_stem().and_then(|stem| stem.to_str());
    let shown = label(shown.unwrap_or(reference));
    let n_surfels = object.pointer("/facts/clouds/0/n_surfels").and_then(Value::as_u64);
    let count = n_surfels.map_or(String::new(), |n| format!("{} surfels, ", in_groups(n)));
    let caption = format!("{count}against {shown}");
    let mut grid = Grid { caption, head, rows: Vec::new() };
    for (i, renderer) in renderers.iter().enumerate() {
        let name = renderer["name"].as_str().unwrap_or_default();
        let is_truth = name == reference;
        if let Some(line) = renderer["error"].as_str() {
            return Err(anyhow!("{name}: {line}"));
        }
        let said = if is_truth { format!("{} (reference)", label(name)) } else { label(name) };
        outcome
            .pictures
            .push(PictureFile { name: said.clone(), file: format!("{number}/{name}.png") });
        let found = times(renderer.pointer("/frames/0/runs"));
        let error = |metric: &str| renderer["errors"].pointer(metric).and_then(Value::as_f64);
        let cell = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.4}"));
        let [rmse, flip] =
            ["/rmse", "/flip/mean"].map(|metric| error(metric).filter(|_| !is_truth));
        let ms = found.map(|(ms, _)| ms);
        grid.rows.push(vec![
            said,
            cell(rmse),
            cell(flip),
            ms.map_or(String::new(), |ms| format!("{ms:.1}")),
            found.and_then(|(_, spread)| spread).map_or(String::new(), |ms| format!("{ms:.1}")),
            ms.map_or(String::new(), |ms| format!("{:.1}", 1e3 / ms.max(1e-9))),
            ms.zip(n_surfels)
                .map_or(String::new(), |(ms, n)| format!("{:.2}", n as f64 / ms.max(1e-9) / 1e3)),
        ]);
        for (what, metric, value) in [("RMSE", "rmse", rmse), ("FLIP", "flip/mean", flip)] {
            let Some(value) = value else { continue };
            outcome.numbers.push(Number {
                what: format!("{what} of {}", label(name)),
                value,
                unit: String::new(),
                printed: String::new(),
                command,
                pointer: format!("/renderers/{i}/errors/{metric}"),
                is_repeatable: true,
            });
        }
    }
    outcome.tables.push(grid);
    Ok(())
}

/// Settings that were typed, each behind a comma.
fn settings(words: &[String], takes: impl Fn(&str) -> bool) -> String {
    let set = words.windows(2).filter(|pair| pair[0] == "--set" && takes(&pair[1]));
    set.map(|pair| format!(", {}", pair[1])).collect()
}

fn report(
    outcome: &mut Outcome,
    own: &Path,
    (words, command): (&[String], Option<usize>),
) -> anyhow::Result<()> {
    let object = json(&own.join("report.json"))?;
    let knobs = object["knobs"].as_array().map(Vec::as_slice).unwrap_or_default();
    let unit = object.pointer("/unit/id").and_then(Value::as_str).unwrap_or_default();
    for (k, knob) in knobs.iter().enumerate() {
        let id = knob["id"].as_str().unwrap_or_default();
        let head = [id, "RMSE", "largest error", "s", "spread, s"].map(str::to_owned).to_vec();
        let set = settings(words, |_| true);
        let caption = format!("{unit} by {id}{set}");
        let mut grid = Grid { caption: caption.clone(), head, rows: Vec::new() };
        for (c, cell) in knob["cells"].as_array().into_iter().flatten().enumerate() {
            let value = cell["value"].as_str().unwrap_or_default();
            if let Some(fault) = cell["fault"].as_str() {
                return Err(anyhow!("{id}={value}: {fault}"));
            }
            let errors = cell["errors"].as_array().map(Vec::as_slice).unwrap_or_default();
            let at = |name: &str| errors.iter().position(|pair| pair[0] == name);
            let error = |name: &str| at(name).and_then(|at| errors[at][1].as_f64());
            let shown = |value: Option<f64>, digits: usize| {
                value.map_or(String::new(), |value| format!("{value:.digits$}"))
            };
            let found = times(cell.get("runs"));
            grid.rows.push(vec![
                value.to_owned(),
                shown(error("rmse"), 5),
                shown(error("max_absolute"), 4),
                shown(found.map(|(ms, _)| ms / 1e3), 3),
                shown(found.and_then(|(_, spread)| spread).map(|ms| ms / 1e3), 3),
            ]);
            if let (Some(at), Some(rmse)) = (at("rmse"), error("rmse")) {
                outcome.numbers.push(Number {
                    what: format!("RMSE at {id}={value}"),
                    value: rmse,
                    unit: String::new(),
                    printed: String::new(),
                    command,
                    pointer: format!("/knobs/{k}/cells/{c}/errors/{at}/1"),
                    is_repeatable: true,
                });
            }
        }
        outcome.tables.push(grid);
        let path = own.join(format!("{id}.svg"));
        if path.is_file() {
            let svg = String::from_utf8_lossy(&files::read_short(&path, MOST_BYTES)?).into_owned();
            outcome.drawings.push(Drawing { caption, svg });
        }
    }
    Ok(())
}

/// Our number beside a printed one, of a step's JSON file; `rows` are those of its table of passes.
pub(crate) fn against(
    against: &Against,
    object: &Value,
    rows: &[PassRow],
    command: Option<usize>,
) -> anyhow::Result<Number> {
    let number = |pointer: &str| {
        let value = passes::at(object, pointer);
        value.ok_or_else(|| anyhow!("{}: there is no number at {pointer}", against.what))
    };
    let mut pointer = passes::place(&against.value, object, rows)?;
    let mut value = number(&pointer)?;
    if !against.over.is_empty() {
        let over = passes::place(&against.over, object, rows)?;
        value /= number(&over)?;
        pointer = format!("{pointer} / {over}");
    }
    if against.factor != 0.0 {
        value *= against.factor;
    }
    Ok(Number {
        what: against.what.clone(),
        value,
        unit: against.unit.clone(),
        printed: against.printed.clone(),
        command,
        pointer,
        is_repeatable: false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn lines_name_files_without_their_folders() {
        let line = "renderer `a/b` (/some/where/liba.so) on x / y";
        assert_eq!(without_folders(line), "renderer `a/b` (liba.so) on x / y");
    }

    #[test]
    fn printed_numbers_have_ours_beside_them() {
        let run = |ms: f64| json!({ "wall_ms": ms });
        let object = json!({ "a": [run(2.0), run(4.0), run(3.0)], "b": 12.0 });
        let wanted = Against {
            value: "/b".to_owned(),
            over: "/a".to_owned(),
            factor: 10.0,
            ..Against::default()
        };
        let found = against(&wanted, &object, &[], None).unwrap();
        assert_eq!(found.value.to_bits(), 40f64.to_bits());
        assert_eq!(found.pointer, "/b / /a");
        let none = Against { value: "/c".to_owned(), ..wanted };
        assert!(against(&none, &object, &[], None).unwrap_err().to_string().contains("/c"));
    }
}
