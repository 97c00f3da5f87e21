//! `surfelshop report`: a renderer's error against its time, as its knobs turn.

mod cells;
mod plot;
mod told;

use crate::arguments::{CompareArguments, SweepArguments};
use crate::clouds::Clouds;
use crate::compare::candidate::{self, Candidate};
use crate::compare::{Stage, Truth};
use crate::given::Given;
use crate::scenes::Inputs;
use crate::staging::{self, Staging};
use crate::studio::{self, Studio};
use crate::surroundings::{self, Surroundings};
use crate::values::Setting;
use crate::{exr_file, render, terminal};
use anyhow::{Context as _, bail};
use cells::{Cell, Kept};
use std::path::Path;
use std::time::UNIX_EPOCH;
use surfelshop_api::UnitKind;
use surfelshop_api::params::{ParamDecl, ParamKind, Value};
use surfelshop_engine::metrics::{self, Reference};
use surfelshop_engine::plugins::UnitRef;

/// Values that a knob is swept over unless they are given.
const MOST_VALUES: usize = 9;

/// A knob and the values it is turned to, as they are typed.
struct Knob {
    id: String,
    values: Vec<String>,
}

/// Runs the command.
pub(crate) fn run(arguments: &SweepArguments, given: &Given) -> anyhow::Result<()> {
    let inputs = Inputs::open(&arguments.files)?;
    let opened = inputs.opened.as_ref();
    let registry = studio::registry(&arguments.plugins.plugin)?;
    let unit = registry.find(UnitKind::Renderer, &arguments.renderer)?;
    let knobs = knobs(arguments, &unit)?;
    let seen = staging::first_view(opened);
    let staging = Staging::new(&arguments.picture, given, opened, seen.as_ref())?;
    std::fs::create_dir_all(&arguments.out)
        .with_context(|| format!("{}: the folder cannot be made", arguments.out.display()))?;
    let mut studio = Studio::open(&arguments.device, &arguments.plugins)?;
    let surroundings = surroundings::read_wanted(staging.environment.as_ref())?;
    let surroundings = surroundings.as_ref();
    let clouds = Clouds::read(&inputs.sources)?;
    let view = render::view(&arguments.picture, &staging, &clouds);
    let compared = arguments.as_compared();
    let stage =
        Stage { arguments: &compared, staging: &staging, clouds: &clouds, surroundings, view };
    let kept = Kept::open(&arguments.out, &key(arguments, &stage, &studio)?)?;
    let truth = truth(arguments, &stage, &mut studio, &registry, &kept)?;
    let mut all = Vec::new();
    for knob in &knobs {
        let cells = sweep(&stage, &mut studio, &unit, knob, &truth, &kept)?;
        all.push((knob.id.clone(), cells));
    }
    told::write(arguments, &stage, &studio, &unit, &truth, &all)?;
    let failed = all.iter().flat_map(|(_, cells)| cells).find_map(|cell| cell.fault.clone());
    failed.map_or(Ok(()), |line| bail!("{line}"))
}

/// Everything that the numbers depend on besides the values of a knob.
fn key(arguments: &SweepArguments, stage: &Stage<'_>, studio: &Studio) -> anyhow::Result<String> {
    // A file that was written since is another one.
    let stamp = |path: &std::path::PathBuf| -> anyhow::Result<_> {
        let about = path.metadata().with_context(|| path.display().to_string())?;
        let written = about.modified().ok().and_then(|at| at.duration_since(UNIX_EPOCH).ok());
        Ok((path.clone(), about.len(), written))
    };
    let files = arguments.files.iter().map(stamp).collect::<anyhow::Result<Vec<_>>>()?;
    let typed: Vec<_> = arguments.set.iter().chain(&arguments.reference_set).collect();
    let settings: Vec<String> = typed.iter().map(|setting| format!("{setting:?}")).collect();
    Ok(serde_json::to_string(&(
        (&arguments.renderer, &arguments.reference, settings, arguments.repeats),
        (files, &stage.clouds.facts, &stage.staging.scene, stage.view),
        (
            stage.surroundings.map(|light: &Surroundings| light.view().environment.clone()),
            studio.engine.gpu().describe(),
            env!("CARGO_PKG_VERSION"),
        ),
    ))?)
}

/// The knobs that are swept: those given, or all that the renderer declares to trade time for quality.
fn knobs(arguments: &SweepArguments, unit: &UnitRef) -> anyhow::Result<Vec<Knob>> {
    let loaded = studio::load(unit, &arguments.plugins.patience())?;
    let declared = &loaded.description.params;
    if arguments.knob.is_empty() {
        let qualities = declared.iter().filter(|declared| declared.quality);
        let knobs: Vec<Knob> = qualities
            .map(|declared| Knob { id: declared.id.clone(), values: steps(declared) })
            .collect();
        if knobs.is_empty() {
            let ids: Vec<_> = declared.iter().map(|declared| declared.id.as_str()).collect();
            bail!(
                "{unit} declares no parameter that trades time for quality; name one with --knob, \
                 as id=value,value,…: {}",
                ids.join(", ")
            );
        }
        return Ok(knobs);
    }
    let mut knobs = Vec::new();
    for Setting { id, value, .. } in &arguments.knob {
        let Some(declared) = declared.iter().find(|declared| declared.id == *id) else {
            let ids: Vec<_> = declared.iter().map(|declared| declared.id.as_str()).collect();
            bail!("{unit} has no parameter `{id}`; it has: {}", ids.join(", "));
        };
        let values: Vec<String> = value.split(',').map(|value| value.trim().to_owned()).collect();
        for value in &values {
            declared.parse(value).map_err(anyhow::Error::msg)?;
        }
        knobs.push(Knob { id: id.clone(), values });
    }
    Ok(knobs)
}

/// Values from one end of a declared range to the other, in even ratios where it is wide.
fn steps(declared: &ParamDecl) -> Vec<String> {
    let whole = declared.kind == ParamKind::Int;
    match (&declared.kind, declared.range) {
        (ParamKind::Choice(ids), _) => ids.clone(),
        (ParamKind::Bool, _) => vec!["false".to_owned(), "true".to_owned()],
        (ParamKind::Int, Some([low, high])) if high - low < MOST_VALUES as f64 => {
            (low as i64..=high as i64).map(|value| value.to_string()).collect()
        }
        (_, Some([low, high])) => {
            let n = MOST_VALUES as f64 - 1.0;
            let ratio = low > 0.0 && high / low >= 8.0;
            let value = |i: usize| match ratio {
                true => low * (high / low).powf(i as f64 / n),
                false => low + (high - low) * i as f64 / n,
            };
            let values = (0..MOST_VALUES).map(value).map(|v| if whole { v.round() } else { v });
            let mut values: Vec<String> = values.map(|value| value.to_string()).collect();
            values.dedup();
            values
        }
        _ => match &declared.default {
            Value::Text(text) => vec![text.clone()],
            other => vec![format!("{other:?}")],
        },
    }
}

/// What cells are measured against: a picture, or what a renderer or tracer makes.
fn truth(
    arguments: &SweepArguments,
    stage: &Stage<'_>,
    studio: &mut Studio,
    registry: &surfelshop_engine::plugins::Registry,
    kept: &Kept,
) -> anyhow::Result<Truth> {
    let name = arguments.reference.as_ref().unwrap_or(&arguments.renderer);
    if Path::new(name).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("exr")) {
        let picture = exr_file::read_color(Path::new(name))?;
        return Ok(Truth { name: name.clone(), picture, variance: None, candidate: None });
    }
    let settings: Vec<String> = arguments
        .reference_set
        .iter()
        .map(|setting| format!("{}={}", setting.id, setting.value))
        .collect();
    let told = format!("{name} {}", settings.join(" ")).trim().to_owned();
    if let Some((picture, variance)) = kept.truth()? {
        return Ok(Truth { name: told, picture, variance, candidate: None });
    }
    let reference = staging::drawer(registry, name)?;
    let mut candidates =
        candidate::with(stage, Some(studio), vec![(reference, arguments.reference_set.clone())])?;
    candidate::draw_once(stage, Some(studio), &mut candidates);
    let Some(Candidate { drawn, .. }) = candidates.pop() else { bail!("there is no reference") };
    let drawn = drawn.map_err(anyhow::Error::msg)?;
    kept.put_truth(&drawn.color, drawn.variance.as_ref())?;
    Ok(Truth { name: told, picture: drawn.color, variance: drawn.variance, candidate: None })
}

/// Turns one knob: cells that are known are kept, the others are drawn, timed in turns and measured.
fn sweep(
    stage: &Stage<'_>,
    studio: &mut Studio,
    unit: &UnitRef,
    knob: &Knob,
    truth: &Truth,
    kept: &Kept,
) -> anyhow::Result<Vec<Cell>> {
    let unknown: Vec<&String> =
        knob.values.iter().filter(|value| kept.cell(&knob.id, value).is_none()).collect();
    let wanted = unknown.iter().map(|value| {
        let turned = Setting { unit: None, id: knob.id.clone(), value: (*value).clone() };
        let settings = stage.arguments.set.iter().filter(|setting| setting.id != knob.id);
        (unit.clone(), settings.cloned().chain([turned]).collect())
    });
    let mut candidates = candidate::with(stage, Some(studio), wanted.collect())?;
    if !candidates.is_empty() {
        let what = format!("{}: {} values", knob.id, candidates.len());
        let progress = terminal::Progress::new(what);
        candidate::draw(stage, Some(studio), &mut candidates);
        drop(progress);
    }
    for (candidate, value) in candidates.iter().zip(&unknown) {
        let settings =
            metrics::Settings { development: stage.staging.how, ..metrics::Settings::default() };
        let reference = Reference { picture: &truth.picture, variance: truth.variance.as_ref() };
        let measured = match &candidate.drawn {
            Ok(drawn) => metrics::compare(&drawn.color, reference, &settings)
                .map(|comparison| (comparison, drawn))
                .map_err(|error| error.to_string()),
            Err(line) => Err(line.clone()),
        };
        kept.put(&Cell::new(&knob.id, value, measured))?;
    }
    let known = knob.values.iter().filter_map(|value| kept.cell(&knob.id, value));
    Ok(known.collect())
}

impl SweepArguments {
    /// What the machinery of comparisons asks for.
    fn as_compared(&self) -> CompareArguments {
        CompareArguments {
            files: self.files.clone(),
            renderer: vec![self.renderer.clone()],
            reference: self.reference.clone(),
            out: self.out.clone(),
            fail_above: Vec::new(),
            repeats: self.repeats,
            set: self.set.clone(),
            picture: self.picture.clone(),
            plugins: self.plugins.clone(),
            device: self.device.clone(),
            report: self.report.clone(),
        }
    }
}
