//! Reports of renderers and tracers: errors of pictures.

use super::cells::{Cell, ResultsFile};
use super::knobs::{DETAIL, Knob, knobs, of_host};
use super::page::{Swept, Time};
use super::parted::{self, Known, Whole};
use super::subject::Subject;
use super::{Bench, Stamp, stamp, stamps_of, stamps_of_values, sweep, told};
use crate::compare::candidate::{Candidate, CandidateRequest, Drawn};
use crate::compare::measured::errors;
use crate::compare::{Stage, Truth, random};
use crate::report::ReportArguments;
use anyhow::bail;
use std::collections::HashMap;
use std::path::Path;
use surfelshop_api::UnitKind;
use surfelshop_api::params::Values;
use surfelshop_cloud::scene::OpenedScene;
use surfelshop_image::exr;
use surfelshop_runtime::plugins::{Registry, UnitRef};
use surfelshop_session::cloud_renderers::{self, Beside};
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::environment_map::LoadedEnvironment;
use surfelshop_session::input::formats::SessionFormats;
use surfelshop_session::input::plausibility;
use surfelshop_session::input::scenes::Inputs;
use surfelshop_session::options::explicit::ExplicitOptions;
use surfelshop_session::options::values::{self, Setting};
use surfelshop_session::output::part_file::PartStart;
use surfelshop_session::output::terminal;
use surfelshop_session::session::RenderSession;
use surfelshop_session::setup::{self, RenderSetup};
use surfelshop_session::timing::Run;
use surfelshop_session::{parameters, render};

/// Makes the report.
pub(super) fn report(
    arguments: &ReportArguments,
    given: &ExplicitOptions,
    registry: &Registry,
    unit: &UnitRef,
) -> anyhow::Result<()> {
    let inputs = Inputs::open(&arguments.files)?;
    let opened = inputs.opened.as_ref();
    let patience = arguments.plugins.patience();
    let subject = Subject::load(unit, &patience)?;
    let (knobs, turns_detail) = knobs_of(arguments, unit, &subject)?;
    let judge = judge(arguments, registry, &subject)?;
    let turned = turns_detail && knobs.iter().any(|knob| knob.id == DETAIL);
    let mut staging = staging_of(arguments, given, opened, turned)?;
    let started = PartStart::now();
    parted::folder(arguments)?;
    let is_renderer = |one: &Subject| one.reference.kind == UnitKind::Renderer;
    let draws = is_renderer(&subject) || judge.as_ref().is_some_and(is_renderer);
    let studio = draws.then(|| open_studio(arguments, &staging)).transpose()?;
    let formats = SessionFormats::new(&arguments.plugins);
    let (surroundings, displayed) = staging.read(&inputs.sources, &formats)?;
    let clouds = &displayed.clouds;
    plausibility::note(clouds, &staging.scene);
    let view = render::view(&arguments.picture, &staging, clouds);
    let (plugins, staging, surroundings) = (&arguments.plugins, &staging, surroundings.as_ref());
    let stage = Stage { plugins, staging, clouds, surroundings, view };
    let mut files = stamps_of(&arguments.files, &inputs.sources)?;
    files.extend(stamp_of_picture(arguments)?);
    let own = told_values(&subject, opened, &arguments.set)?;
    files.extend(stamps_of_values(subject.declared(), &own)?);
    let mut units = vec![subject.stamp()?];
    let beside = beside(&subject, judge.as_ref(), registry, &inputs, clouds)?;
    let judge = judge.map(|judge| -> anyhow::Result<_> {
        let values = told_values(&judge, opened, &arguments.reference_set)?;
        if !knobs.iter().any(|knob| knob.id == random::SEED) {
            check_numbers([(&subject, &own), (&judge, &values)])?;
        }
        files.extend(stamps_of_values(judge.declared(), &values)?);
        units.push(judge.stamp()?);
        Ok((judge, values))
    });
    let judge = judge.transpose()?;
    let device = device_of(studio.as_ref());
    let known = Known::open(arguments, &device, |device| {
        key(arguments, &stage, &beside, (&units, &files), device)
    })?;
    let options = key(arguments, &stage, &beside, (&[], &[]), "")?;
    let mut bench = Pictures {
        arguments,
        stage: &stage,
        opened,
        studio,
        subject: &subject,
        truth: None,
        all: HashMap::new(),
        n_timed: 0,
        turns_detail,
        beside,
    };
    bench.truth = Some(truth(&mut bench, judge, known.reference())?);
    let plan = Whole::plan(&knobs);
    let whole = Whole { arguments, options, files: &files, units: &units, plan, started };
    let all = swept(&mut bench, knobs, &known)?;
    let [width, height] = view.size_px;
    let swept = Swept {
        unit: unit.into(),
        what: format!("{width} x {height} pixels"),
        truth: bench.truth.map(|truth| truth.name).unwrap_or_default(),
        device,
        error: "RMSE of radiance".to_owned(),
        time: Time::Passes,
        note: None,
        all,
    };
    told(whole, &known, swept)
}

/// Turns the knobs, or to the values of a part.
fn swept(
    bench: &mut Pictures<'_>,
    knobs: Vec<Knob>,
    known: &Known,
) -> anyhow::Result<Vec<(String, Vec<Cell>)>> {
    let arguments = bench.arguments;
    let mut all = Vec::new();
    for knob in &parted::own(arguments.part, knobs) {
        let cells = sweep(bench, knob, arguments, &known.cells)?;
        all.push((knob.id.clone(), cells));
        bench.all.clear();
    }
    Ok(all)
}

/// What draws, in the colours that the scene says.
fn open_studio(
    arguments: &ReportArguments,
    staging: &RenderSetup,
) -> anyhow::Result<RenderSession> {
    let mut studio = RenderSession::open(&arguments.device, &arguments.plugins)?;
    studio.engine.tint_backs(staging.display.splats.tint_backs);
    Ok(studio)
}

/// What draws the pictures.
fn device_of(studio: Option<&RenderSession>) -> String {
    studio.map_or("no graphics device".to_owned(), |studio| studio.engine.gpu().describe())
}

/// How pictures are made; where `detail` is turned, the reference is what nothing is merged in.
fn staging_of(
    arguments: &ReportArguments,
    given: &ExplicitOptions,
    opened: Option<&OpenedScene>,
    turns_detail: bool,
) -> anyhow::Result<RenderSetup> {
    let seen = setup::first_view(opened);
    let staging = RenderSetup::new(&arguments.picture, given, opened, seen.as_ref())?;
    Ok(if turns_detail { staging.unmerged() } else { staging })
}

/// The knobs that are turned, and whether `detail` is the host's.
fn knobs_of(
    arguments: &ReportArguments,
    unit: &UnitRef,
    subject: &Subject,
) -> anyhow::Result<(Vec<Knob>, bool)> {
    let mut declared = subject.declared().to_vec();
    let own_detail = of_host(&declared).filter(|_| unit.kind == UnitKind::Renderer);
    let turns_detail = own_detail.is_some();
    declared.extend(own_detail);
    let knobs = knobs(&arguments.knob, unit, &declared)?;
    if turns_detail && arguments.picture.detail != 0.0 && knobs.iter().any(|k| k.id == DETAIL) {
        bail!(
            "--detail would merge surfels of the reference, too; leave it out beside --knob detail"
        );
    }
    Ok((knobs, turns_detail))
}

/// Refuses a tracer that is measured against itself with the same random numbers.
fn check_numbers(
    [(subject, own), (judge, values)]: [(&Subject, &Values); 2],
) -> anyhow::Result<()> {
    let is_same = random::is_same(&subject.reference, &judge.reference);
    match is_same && subject.seed(own) == judge.seed(values) {
        true => bail!(
            "{} and its reference have the same random numbers, which would hide its errors; give \
             the reference another seed, as --reference-set {}=1",
            subject.reference,
            random::SEED
        ),
        false => Ok(()),
    }
}

/// What a scene's view of a unit says and over that what was typed; and a line for each of the view's
/// values that the unit does not know.
fn values_of(
    subject: &Subject,
    opened: Option<&OpenedScene>,
    typed: &[Setting],
) -> anyhow::Result<(Values, Vec<String>)> {
    let view = setup::view_of(opened, &subject.reference);
    parameters::resolved(&subject.reference, subject.declared(), view.as_ref(), typed)
}

/// The same, with the lines told.
fn told_values(
    subject: &Subject,
    opened: Option<&OpenedScene>,
    typed: &[Setting],
) -> anyhow::Result<Values> {
    let (values, unknown) = values_of(subject, opened, typed)?;
    unknown.iter().for_each(terminal::warn);
    Ok(values)
}

/// What draws the clouds that name a renderer, beside what is measured. Tracers draw the whole scene, which is told.
fn beside(
    subject: &Subject,
    judge: Option<&Subject>,
    registry: &Registry,
    inputs: &Inputs,
    clouds: &Clouds,
) -> anyhow::Result<Beside> {
    let kinds = || std::iter::once(subject).chain(judge).map(|one| one.reference.kind);
    if kinds().any(|kind| kind == UnitKind::Tracer) {
        cloud_renderers::note_left_out(&inputs.sources, "tracers draw the whole scene");
    }
    match kinds().any(|kind| kind == UnitKind::Renderer) {
        true => Beside::of(registry, &inputs.sources, &clouds.facts.clouds),
        false => Ok(Beside::default()),
    }
}

fn started(
    subject: &Subject,
    studio: Option<&RenderSession>,
    values: Values,
    beside: Beside,
) -> Candidate {
    let Subject { reference, unit } = subject.clone();
    let name = reference.id.clone();
    Candidate::new(studio, CandidateRequest { name, reference, unit: Ok(unit), values, beside })
}

/// Everything that the numbers depend on besides the values of a knob.
fn key(
    arguments: &ReportArguments,
    stage: &Stage<'_>,
    beside: &Beside,
    // A file that was written since is another one, and so is a plugin that was rebuilt.
    (units, files): (&[(String, Stamp)], &[Stamp]),
    device: &str,
) -> anyhow::Result<String> {
    let typed: Vec<_> = arguments.set.iter().chain(&arguments.reference_set).collect();
    let settings: Vec<String> = typed.iter().map(|setting| format!("{setting:?}")).collect();
    let n_set = arguments.set.len();
    Ok(serde_json::to_string(&(
        (units, settings, n_set),
        (files, &stage.clouds.facts, &stage.staging.scene, stage.view),
        // How pictures are developed decides what is displayed, and so does what colours and filters clouds.
        format!(
            "{:?}",
            (
                stage.staging.how,
                [stage.staging.detail_px, stage.staging.pyramid_detail_px],
                stage.staging.antialias,
                arguments.device.surfels
            )
        ),
        format!("{:?}", stage.staging.display),
        (
            stage.surroundings.map(|light: &LoadedEnvironment| light.view().environment.clone()),
            device,
            beside.describe(),
            env!("CARGO_PKG_VERSION"),
        ),
    ))?)
}

/// The picture that errors are measured against, where it is one.
fn stamp_of_picture(arguments: &ReportArguments) -> anyhow::Result<Option<Stamp>> {
    let picture = arguments.reference.as_deref().map(Path::new).filter(|path| is_picture(path));
    picture.map(stamp).transpose()
}

fn is_picture(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("exr"))
}

/// What makes the reference; `None` where it is a picture.
fn judge(
    arguments: &ReportArguments,
    registry: &Registry,
    subject: &Subject,
) -> anyhow::Result<Option<Subject>> {
    match &arguments.reference {
        None => Ok(Some(subject.clone())),
        Some(name) if is_picture(Path::new(name)) && !arguments.reference_set.is_empty() => bail!(
            "{name}: a picture has no parameters; leave --reference-set out, or name what draws"
        ),
        Some(name) if is_picture(Path::new(name)) => Ok(None),
        Some(name) => {
            let reference = setup::drawer(registry, name)?;
            Subject::load(&reference, &arguments.plugins.patience()).map(Some)
        }
    }
}

/// What cells are measured against: a picture, or what a renderer or tracer makes.
fn truth(
    bench: &mut Pictures<'_>,
    judge: Option<(Subject, Values)>,
    kept: &ResultsFile,
) -> anyhow::Result<Truth> {
    let arguments = bench.arguments;
    let Some((judge, values)) = judge else {
        let name = arguments.reference.clone().unwrap_or_default();
        let picture = exr::read_color(Path::new(&name), exr::MOST_PIXELS)?;
        return Ok(Truth { name, picture, variance: None, candidate: None });
    };
    let settings: Vec<String> = arguments
        .reference_set
        .iter()
        .map(|setting| format!("{}={}", setting.id, setting.value))
        .collect();
    let name = format!("{} {}", judge.reference.id, settings.join(" ")).trim().to_owned();
    if let Some((picture, variance)) = kept.truth()? {
        return Ok(Truth { name, picture, variance, candidate: None });
    }
    let mut candidate = started(&judge, bench.studio.as_ref(), values, bench.beside.clone());
    let drawn = candidate.first(bench.stage, bench.studio.as_mut())?;
    kept.put_truth(&drawn.color, drawn.variance.as_ref())?;
    Ok(Truth { name, picture: drawn.color, variance: drawn.variance, candidate: None })
}

/// Pictures with a knob at several values.
struct Pictures<'a> {
    arguments: &'a ReportArguments,
    stage: &'a Stage<'a>,
    /// The scene, whose views have parameters of renderers.
    opened: Option<&'a OpenedScene>,
    studio: Option<RenderSession>,
    subject: &'a Subject,
    truth: Option<Truth>,
    /// By the knob's value.
    all: HashMap<String, Candidate>,
    /// Frames that were timed.
    n_timed: u32,
    /// Whether the knob `detail` is the host's.
    turns_detail: bool,
    /// What draws the clouds that name a renderer.
    beside: Beside,
}

impl Pictures<'_> {
    /// Whether a knob is the host's and no parameter of the renderer.
    fn is_of_host(&self, knob: &str) -> bool {
        self.turns_detail && knob == DETAIL
    }

    /// How pictures are made with a knob at a value, parameters aside.
    fn staging(&self, knob: &str, value: &str) -> Result<RenderSetup, String> {
        let staging = self.stage.staging.clone();
        match self.is_of_host(knob) {
            true => {
                let detail_px = values::detail(value)?;
                Ok(RenderSetup { detail_px, pyramid_detail_px: detail_px, ..staging })
            }
            false => Ok(staging),
        }
    }

    fn made(&self, knob: &str, value: &str) -> anyhow::Result<Candidate> {
        let turned = Setting { unit: None, id: knob.to_owned(), value: value.to_owned() };
        let turned = (!self.is_of_host(knob)).then_some(turned);
        let others = self.arguments.set.iter().filter(|setting| setting.id != knob).cloned();
        let settings: Vec<Setting> = others.chain(turned).collect();
        let (values, _told) = values_of(self.subject, self.opened, &settings)?;
        Ok(started(self.subject, self.studio.as_ref(), values, self.beside.clone()))
    }

    fn measured(&self, knob: &str, value: &str, drawn: &Drawn) -> Result<Cell, String> {
        let truth = self.truth.as_ref().ok_or("there is no reference")?;
        let compared = truth.compare(&drawn.color, self.stage.staging.how);
        let errors = errors(&compared).map_err(|line| format!("{knob}={value}: {line}"))?;
        Ok(Cell {
            n_passes: drawn.n_passes,
            graph_bytes: drawn.graph_bytes,
            ..Cell::of_picture(knob, value, errors, drawn.first_ms)
        })
    }
}

impl Bench for Pictures<'_> {
    fn first(&mut self, knob: &str, value: &str) -> Result<Cell, String> {
        let mut candidate = self.made(knob, value).map_err(|error| format!("{error:#}"))?;
        let staging = self.staging(knob, value)?;
        let drawn =
            candidate.first(&Stage { staging: &staging, ..*self.stage }, self.studio.as_mut());
        let drawn = drawn.map_err(|error| format!("{error:#}"))?;
        self.all.insert(value.to_owned(), candidate);
        self.measured(knob, value, &drawn)
    }

    fn again(&mut self, knob: &str, value: &str) -> Result<Run, String> {
        let staging = self.staging(knob, value)?;
        let stage = Stage { staging: &staging, ..*self.stage };
        let candidate = self.all.get_mut(value).ok_or(format!("{knob}={value} is gone"))?;
        self.n_timed += 1;
        let run = candidate.again(&stage, self.studio.as_mut(), self.n_timed);
        let run = run.map_err(|error| format!("{error:#}"))?;
        // What the host's knobs change is spent before the renderer's own passes.
        let own_passes_ms = run.own_passes_ms.filter(|_| !self.is_of_host(knob));
        Ok(Run { own_passes_ms, ..run })
    }
}
