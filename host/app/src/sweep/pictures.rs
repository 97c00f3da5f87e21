//! Reports of renderers and tracers: errors of pictures.

use super::cells::{Cell, Kept};
use super::knobs::knobs;
use super::told::{Swept, Time};
use super::{
    Bench, Stamp, stamp, stamp_of_unit, stamps_of, stamps_of_values, sweep, told, verdict,
};
use crate::arguments::SweepArguments;
use crate::clouds::Clouds;
use crate::compare::candidate::{Candidate, Drawn, Wanted};
use crate::compare::{Stage, Truth, random};
use crate::given::Given;
use crate::scenes::Inputs;
use crate::staging::{self, Staging};
use crate::studio::{self, Studio};
use crate::surroundings::{self, Surroundings};
use crate::times::Run;
use crate::values::Setting;
use crate::{exr_file, render, settings};
use anyhow::{Context as _, bail};
use std::collections::HashMap;
use std::path::Path;
use surfelshop_api::UnitKind;
use surfelshop_api::params::{Value, Values};
use surfelshop_engine::metrics::{self, Reference};
use surfelshop_engine::plugins::{Registry, UnitRef};

/// Errors in the tables, what they are, and which way is better.
const ERRORS: [(&str, &str, &str); 5] = [
    ("rmse", "root of the mean squared error of radiance", "less"),
    ("rel_mse", "mean squared error over squared radiance + 0.01", "less"),
    ("psnr", "of what a screen shows, decibels", "more"),
    ("ssim", "structural similarity of what a screen shows", "more"),
    ("flip.mean", "FLIP, 67 pixels a degree: mean", "less"),
];

/// Makes the report.
pub(super) fn report(
    arguments: &SweepArguments,
    given: &Given,
    registry: &Registry,
    unit: &UnitRef,
) -> anyhow::Result<()> {
    let inputs = Inputs::open(&arguments.files)?;
    let opened = inputs.opened.as_ref();
    let loaded = studio::load(unit, &arguments.plugins.patience())?;
    let knobs = knobs(&arguments.knob, unit, &loaded.description.params)?;
    let judge = judge(arguments, registry, unit)?;
    let seen = staging::first_view(opened);
    let staging = Staging::new(&arguments.picture, given, opened, seen.as_ref())?;
    std::fs::create_dir_all(&arguments.out)
        .with_context(|| format!("{}: the folder cannot be made", arguments.out.display()))?;
    let needs_device = [Some(unit), judge.as_ref()].into_iter().flatten();
    let studio = match needs_device.clone().any(|unit| unit.kind == UnitKind::Renderer) {
        true => Some(Studio::open(&arguments.device, &arguments.plugins)?),
        false => None,
    };
    let surroundings = surroundings::read_wanted(staging.environment.as_ref())?;
    let surroundings = surroundings.as_ref();
    let clouds = Clouds::read(&inputs.sources)?;
    let view = render::view(&arguments.picture, &staging, &clouds);
    let plugins = &arguments.plugins;
    let (staging, clouds) = (&staging, &clouds);
    let stage = Stage { plugins, staging, opened, clouds, surroundings, view };
    let subject = resolved(&stage, unit, &arguments.set)?;
    let mut files = stamps_of(&inputs.sources)?;
    files.extend(subject.files.clone());
    if let Some(judge) = &judge {
        let reference = resolved(&stage, judge, &arguments.reference_set)?;
        let is_turned = knobs.iter().any(|knob| knob.id == random::SEED);
        if random::is_same(unit, judge) && !is_turned && reference.seed == subject.seed {
            bail!(
                "{unit} and its reference have the same random numbers, which would hide its errors; \
                 give the reference another seed, as --reference-set {}=1",
                random::SEED
            );
        }
        files.extend(reference.files);
    }
    let units = needs_device.map(stamp_of_unit).collect::<anyhow::Result<Vec<_>>>()?;
    let device =
        studio.as_ref().map_or("no graphics device".to_owned(), |s| s.engine.gpu().describe());
    let kept = Kept::open(&arguments.out, &key(arguments, &stage, &(units, files), &device)?)?;
    let mut bench = Pictures {
        arguments,
        stage: &stage,
        studio,
        unit,
        truth: None,
        all: HashMap::new(),
        n_timed: 0,
    };
    bench.truth = Some(truth(&mut bench, judge, &kept)?);
    let mut all = Vec::new();
    for knob in &knobs {
        let cells = sweep(&mut bench, knob, arguments, &kept)?;
        all.push((knob.id.clone(), cells));
        bench.all.clear();
    }
    let [width, height] = view.size_px;
    told::write(
        arguments,
        &Swept {
            unit,
            what: format!("{width} x {height} pixels"),
            truth: bench.truth.map(|truth| truth.name).unwrap_or_default(),
            device,
            errors: &ERRORS,
            error: "RMSE of radiance",
            time: Time::OfPictures,
            note: None,
            all: &all,
        },
    )?;
    verdict(&all)
}

/// What a unit works with besides what is turned.
struct Resolved {
    /// Where its random numbers begin, where it says.
    seed: Option<Value>,
    /// Files that its parameters name.
    files: Vec<Stamp>,
}

fn resolved(stage: &Stage<'_>, unit: &UnitRef, typed: &[Setting]) -> anyhow::Result<Resolved> {
    let loaded = studio::load(unit, &stage.plugins.patience())?;
    let declared = &loaded.description.params;
    let mut values = match staging::view_of(stage.opened, unit) {
        Some(view) => settings::of_view(unit, declared, &view)?.0,
        None => Values::new(),
    };
    values.extend(settings::values(unit, declared, typed)?);
    let files = stamps_of_values(declared, &values)?;
    Ok(Resolved { seed: random::seed(declared, &values), files })
}

/// Everything that the numbers depend on besides the values of a knob.
fn key(
    arguments: &SweepArguments,
    stage: &Stage<'_>,
    units: &impl serde::Serialize,
    device: &str,
) -> anyhow::Result<String> {
    // A file that was written since is another one, and so is a plugin that was rebuilt.
    let files =
        arguments.files.iter().map(|path| stamp(path)).collect::<anyhow::Result<Vec<_>>>()?;
    let picture = arguments.reference.as_deref().map(Path::new).filter(|path| is_picture(path));
    let picture = picture.map(stamp).transpose()?;
    let typed: Vec<_> = arguments.set.iter().chain(&arguments.reference_set).collect();
    let settings: Vec<String> = typed.iter().map(|setting| format!("{setting:?}")).collect();
    let n_set = arguments.set.len();
    Ok(serde_json::to_string(&(
        (units, picture, settings, n_set),
        (files, &stage.clouds.facts, &stage.staging.scene, stage.view),
        // How pictures are developed decides what is displayed.
        format!("{:?}", stage.staging.how),
        (
            stage.surroundings.map(|light: &Surroundings| light.view().environment.clone()),
            device,
            env!("CARGO_PKG_VERSION"),
        ),
    ))?)
}

fn is_picture(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("exr"))
}

/// What makes the reference; `None` where it is a picture.
fn judge(
    arguments: &SweepArguments,
    registry: &Registry,
    unit: &UnitRef,
) -> anyhow::Result<Option<UnitRef>> {
    match &arguments.reference {
        None => Ok(Some(unit.clone())),
        Some(name) if is_picture(Path::new(name)) && !arguments.reference_set.is_empty() => bail!(
            "{name}: a picture has no parameters; leave --reference-set out, or name what draws"
        ),
        Some(name) if is_picture(Path::new(name)) => Ok(None),
        Some(name) => Ok(Some(staging::drawer(registry, name)?)),
    }
}

/// What cells are measured against: a picture, or what a renderer or tracer makes.
fn truth(bench: &mut Pictures<'_>, judge: Option<UnitRef>, kept: &Kept) -> anyhow::Result<Truth> {
    let arguments = bench.arguments;
    let Some(judge) = judge else {
        let name = arguments.reference.clone().unwrap_or_default();
        let picture = exr_file::read_color(Path::new(&name))?;
        return Ok(Truth { name, picture, variance: None, candidate: None });
    };
    let settings: Vec<String> = arguments
        .reference_set
        .iter()
        .map(|setting| format!("{}={}", setting.id, setting.value))
        .collect();
    let name = format!("{} {}", judge.id, settings.join(" ")).trim().to_owned();
    if let Some((picture, variance)) = kept.truth()? {
        return Ok(Truth { name, picture, variance, candidate: None });
    }
    let settings = arguments.reference_set.clone();
    let wanted = Wanted { name: judge.id.clone(), reference: judge, settings };
    let mut candidate = Candidate::new(bench.stage, bench.studio.as_ref(), wanted)?;
    let drawn = candidate.first(bench.stage, bench.studio.as_mut())?;
    kept.put_truth(&drawn.color, drawn.variance.as_ref())?;
    Ok(Truth { name, picture: drawn.color, variance: drawn.variance, candidate: None })
}

/// Pictures with a knob at several values.
struct Pictures<'a> {
    arguments: &'a SweepArguments,
    stage: &'a Stage<'a>,
    studio: Option<Studio>,
    unit: &'a UnitRef,
    truth: Option<Truth>,
    /// By the knob's value.
    all: HashMap<String, Candidate>,
    /// Frames that were timed.
    n_timed: u32,
}

impl Pictures<'_> {
    fn made(&self, knob: &str, value: &str) -> anyhow::Result<Candidate> {
        let turned = Setting { unit: None, id: knob.to_owned(), value: value.to_owned() };
        let others = self.arguments.set.iter().filter(|setting| setting.id != knob).cloned();
        let settings = others.chain([turned]).collect();
        let (name, reference) = (self.unit.id.clone(), self.unit.clone());
        let wanted = Wanted { name, reference, settings };
        Candidate::new(self.stage, self.studio.as_ref(), wanted)
    }

    fn measured(&self, knob: &str, value: &str, drawn: &Drawn) -> Result<Cell, String> {
        let truth = self.truth.as_ref().ok_or("there is no reference")?;
        let settings = metrics::Settings {
            development: self.stage.staging.how,
            ..metrics::Settings::default()
        };
        let reference = Reference { picture: &truth.picture, variance: truth.variance.as_ref() };
        let compared = metrics::compare(&drawn.color, reference, &settings);
        let compared = compared.map_err(|error| format!("{knob}={value}: {error}"))?;
        let Some(errors) = compared.errors else {
            return Err(format!("{knob}={value}: {} pixels are not finite", compared.n_not_finite));
        };
        Ok(Cell {
            noise: errors.reference_noise.mse.max(0.0).sqrt(),
            n_passes: drawn.n_passes,
            graph_bytes: drawn.graph_bytes,
            ..Cell::new(knob, value, &errors.named(), drawn.first_ms)
        })
    }
}

impl Bench for Pictures<'_> {
    fn first(&mut self, knob: &str, value: &str) -> Result<Cell, String> {
        let mut candidate = self.made(knob, value).map_err(|error| format!("{error:#}"))?;
        let drawn = candidate.first(self.stage, self.studio.as_mut());
        let drawn = drawn.map_err(|error| format!("{error:#}"))?;
        self.all.insert(value.to_owned(), candidate);
        self.measured(knob, value, &drawn)
    }

    fn again(&mut self, knob: &str, value: &str) -> Result<Run, String> {
        let candidate = self.all.get_mut(value).ok_or(format!("{knob}={value} is gone"))?;
        self.n_timed += 1;
        let run = candidate.again(self.stage, self.studio.as_mut(), self.n_timed);
        run.map_err(|error| format!("{error:#}"))
    }
}
