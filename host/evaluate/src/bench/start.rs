//! How long the program takes from its start to a picture in a file: `render`, started anew each time.

use super::cells::Table;
use super::report::{self, Object};
use super::variant::{LeftOut, Variant, base};
use super::{STILL, files, renderers};
use crate::bench::BenchArguments;
use crate::compare::candidate::CandidateRequest;
use crate::compare::{put, requests};
use anyhow::{Context as _, anyhow, bail};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;
use surfelshop_session::input::scenes::Inputs;
use surfelshop_session::options::explicit::ExplicitOptions;
use surfelshop_session::options::values::{Setting, Size};
use surfelshop_session::output::terminal::{self, Progress};
use surfelshop_session::output::{command_line, json};
use surfelshop_session::parameters;
use surfelshop_session::session::{self, RenderSession};
use surfelshop_session::timing::{median, spread};

/// Options that `render` gets once for each start, or does not have.
const REPLACED: [&str; 12] = [
    "--renderer",
    "-r",
    "--strategies",
    "--surfels",
    "--detail",
    "--most",
    "--largest",
    "--sizes",
    "--frames",
    "--out",
    "-o",
    "--set",
];

/// Words of a benchmark that `render` does not have, or gets anyway.
const FLAGS: [&str; 3] = ["--start", "--json", "--"];

/// What a start's time is made of. The rest is the system's way to the program, the search for plugins,
/// what the program prints, and its end.
const PHASES: [&str; 7] = ["device", "plugin", "read", "columns", "draw", "write", "rest"];

/// Milliseconds of a start, and of each phase.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Start {
    wall_ms: f64,
    phases: [f64; PHASES.len()],
}

impl Start {
    /// Takes it from what `render` says of its time.
    fn new(wall_ms: f64, timings: &Value) -> Option<Self> {
        let ms = |name: &str| timings.get(name).and_then(Value::as_f64);
        let columns = ms("columns_ms")?;
        let draw = ms("render_ms")? - columns;
        let [device, plugin] = [ms("device_ms")?, ms("plugin_ms")?];
        let [read, write] = [ms("load_ms")?, ms("write_ms")?];
        let told = [device, plugin, read, columns, draw, write];
        let rest = wall_ms - told.iter().sum::<f64>();
        Some(Self { wall_ms, phases: [device, plugin, read, columns, draw, write, rest] })
    }
}

/// What is started again and again.
struct Started<'a> {
    file: &'a Path,
    renderer: &'a CandidateRequest,
    size: Size,
    variant: &'a Variant,
}

/// Measures starts.
pub(super) fn run(arguments: &BenchArguments, given: &ExplicitOptions) -> anyhow::Result<()> {
    let registry = session::registry(&arguments.plugins)?;
    let variants = Variant::all(&arguments.strategies(given), &arguments.details());
    let named = renderers(arguments, &registry)?;
    let patience = arguments.plugins.patience();
    let folder =
        tempfile::tempdir().context("there is no folder for pictures that are thrown away")?;
    let picture = folder.path().join("picture.png");
    let mut left_out = LeftOut::default();
    let (mut table, mut objects) = (head(), Vec::new());
    let files = files(arguments)?;
    let n_steps = (files.len() * named.len() * arguments.sizes.len() * variants.len()) as f64;
    let progress = Progress::new("starting");
    for (name, file) in &files {
        let inputs = Inputs::open(std::slice::from_ref(file))?;
        let opened = inputs.opened.as_ref();
        let all = requests::with_settings(named.clone(), &arguments.set, opened, &patience)?;
        for (renderer, &size) in
            all.iter().flat_map(|one| arguments.sizes.iter().map(move |s| (one, s)))
        {
            for variant in &variants {
                let started = Started { file, renderer, size, variant };
                match starts(arguments, &started, &picture) {
                    Ok(starts) => {
                        table.rows.push(row(name, &started, &starts));
                        objects.push(object(name, &started, &starts));
                    }
                    Err(error) => left_out.add(variant, &error),
                }
                // Ctrl-C ends the program.
                let _goes_on = progress.tell(objects.len() as f64 / n_steps);
            }
        }
    }
    drop(progress);
    if table.rows.is_empty() {
        bail!(left_out.last());
    }
    // Only to say what it is: each start opened its own.
    let studio = RenderSession::open(&arguments.device, &arguments.plugins).ok();
    let adapter = studio.as_ref().map(json::adapter);
    let mut all = report::object("start", adapter, &base(&variants), &left_out);
    all.insert("starts".to_owned(), Value::Array(objects));
    tell(arguments, &table, &all)
}

fn tell(arguments: &BenchArguments, table: &Table, object: &Object) -> anyhow::Result<()> {
    if let Some(folder) = &arguments.out {
        put(folder, "start.csv", table.csv().as_bytes())?;
        put(folder, "start.json", serde_json::to_string_pretty(object)?.as_bytes())?;
    }
    if arguments.report.json {
        return terminal::json(object);
    }
    terminal::line(report::place(object))?;
    terminal::line(format!("\n{}", table.text()))
}

/// The first start, in which files come from the disk, and those behind it.
fn starts(
    arguments: &BenchArguments,
    started: &Started<'_>,
    picture: &Path,
) -> anyhow::Result<(Start, Vec<Start>)> {
    let program = std::env::current_exe().context("the program's own file is not known")?;
    let words = words(arguments, started, picture, command_line::typed_words().collect());
    let n = arguments.frames.unwrap_or(STILL);
    let first = start(&program, &words)?;
    let others = (0..n).map(|_| start(&program, &words)).collect::<anyhow::Result<_>>()?;
    Ok((first, others))
}

/// Starts the program and waits until it has ended.
fn start(program: &PathBuf, words: &[String]) -> anyhow::Result<Start> {
    let started = Instant::now();
    let ended = Command::new(program).args(words).output();
    let wall_ms = started.elapsed().as_secs_f64() * 1e3;
    let ended = ended.with_context(|| format!("{}: cannot be started", program.display()))?;
    if !ended.status.success() {
        let said = String::from_utf8_lossy(&ended.stderr);
        let said = said.lines().next().unwrap_or("it said nothing");
        bail!("{}", said.trim_start_matches("surfelshop: "));
    }
    let told: Value = serde_json::from_slice(&ended.stdout).context("what `render` printed")?;
    let timings = told.get("timings").and_then(|timings| Start::new(wall_ms, timings));
    timings.ok_or_else(|| anyhow!("`render` did not say where its time went"))
}

/// The typed command as one of `render` for one file.
fn words(
    arguments: &BenchArguments,
    started: &Started<'_>,
    picture: &Path,
    typed: Vec<String>,
) -> Vec<String> {
    let Started { file, renderer, size: Size([width, height]), variant } = started;
    let is_file =
        |word: &String| arguments.files.iter().any(|file| file.as_os_str() == word.as_str());
    let typed = command_line::without(typed.get(1..).unwrap_or_default(), &REPLACED);
    let kept = typed.into_iter().filter(|word| !FLAGS.contains(&word.as_str()) && !is_file(word));
    let reference = &renderer.reference;
    let own = [
        "-r".to_owned(),
        format!("{}/{}", reference.package, reference.id),
        "--size".to_owned(),
        format!("{width}x{height}"),
        "-o".to_owned(),
        picture.display().to_string(),
        "--json".to_owned(),
    ];
    let mut words = vec!["render".to_owned()];
    words.extend(kept);
    words.extend(own);
    words.extend(variant.options());
    for Setting { id, value, .. } in arguments.set.iter().filter(|one| is_meant(one, renderer)) {
        words.extend(["--set".to_owned(), format!("{id}={value}")]);
    }
    words.extend(["--".to_owned(), file.display().to_string()]);
    words
}

/// Whether a setting is meant for a renderer, by its name, its id or one of its parameters.
fn is_meant(setting: &Setting, renderer: &CandidateRequest) -> bool {
    let declared = renderer.unit.as_ref().map_or(&[][..], |unit| &unit.description.params);
    match &setting.unit {
        Some(meant) => *meant == renderer.name || parameters::names(&renderer.reference, meant),
        None => declared.iter().any(|one| one.id == setting.id),
    }
}

fn head() -> Table {
    let own = ["file", "size", "drawn", "variant", "wall, ms", "spread, ms", "first, ms"];
    let head = own.into_iter().map(str::to_owned);
    let phases = PHASES.iter().map(|phase| format!("{phase}, ms"));
    Table { head: head.chain(phases).chain(["runs".to_owned()]).collect(), rows: Vec::new() }
}

/// Medians of the starts behind the first.
fn phases(starts: &[Start]) -> Vec<Option<f64>> {
    let of = |i| median(&starts.iter().map(|start| start.phases[i]).collect::<Vec<_>>());
    (0..PHASES.len()).map(of).collect()
}

fn row(name: &str, started: &Started<'_>, (first, starts): &(Start, Vec<Start>)) -> Vec<Value> {
    let Started { renderer, size: Size([width, height]), variant, .. } = started;
    let wall: Vec<f64> = starts.iter().map(|start| start.wall_ms).collect();
    let own = [json!(name), json!(format!("{width}x{height}")), json!(renderer.name)];
    let times = [json!(median(&wall)), json!(spread(&wall)), json!(first.wall_ms)];
    let phases = phases(starts).into_iter().map(|ms| json!(ms));
    let row = own.into_iter().chain([json!(variant.name)]).chain(times).chain(phases);
    row.chain([json!(starts.len())]).collect()
}

fn object(name: &str, started: &Started<'_>, (first, starts): &(Start, Vec<Start>)) -> Value {
    let Started { renderer, size: Size(size), variant, .. } = started;
    let wall: Vec<f64> = starts.iter().map(|start| start.wall_ms).collect();
    let named = |phases: Vec<Option<f64>>| -> Value {
        let named = PHASES.iter().zip(phases).map(|(name, ms)| ((*name).to_owned(), json!(ms)));
        Value::Object(named.collect())
    };
    json!({
        "file": name,
        "size": size,
        "what": renderer.name,
        "variant": variant.name,
        "wall_ms": median(&wall),
        "wall_spread_ms": spread(&wall),
        "first_ms": first.wall_ms,
        "phases_ms": named(phases(starts)),
        "runs": wall,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_add_up_to_the_whole() {
        let timings = json!({
            "device_ms": 5.0, "plugin_ms": 3.0, "load_ms": 20.0, "render_ms": 50.0,
            "frame_ms": 49.0, "columns_ms": 10.0, "write_ms": 4.0,
        });
        let start = Start::new(100.0, &timings).unwrap();
        assert_eq!(start.phases, [5.0, 3.0, 20.0, 10.0, 40.0, 4.0, 18.0]);
        assert_eq!(start.phases.iter().sum::<f64>(), start.wall_ms);
        assert_eq!(Start::new(100.0, &json!({})), None);
    }
}
