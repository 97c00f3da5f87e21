//! `surfelshop compare`: several renderers over one scene, measured against one of them or a picture,
//! from one camera or along a path.

mod arguments;
pub mod candidate;
pub(crate) mod compared;
pub mod measured;
pub(crate) mod part;
pub mod random;
pub mod report;
pub mod requests;

pub use arguments::CompareArguments;

pub use candidate::Stage;
pub use compared::{METRICS, put};
pub use measured::Truth;

use anyhow::{Context as _, bail, ensure};
use candidate::Candidate;
use compared::{Compared, ComparedCandidate};
use measured::{CandidateImage, Measured};
use requests::Named;
use serde::{Deserialize, Serialize};
use std::path::Path;
use surfelshop_api::UnitKind;
use surfelshop_image::{exr, metrics};
use surfelshop_runtime::plugins::{Registry, UnitRef};
use surfelshop_session::input::formats::SessionFormats;
use surfelshop_session::input::plausibility;
use surfelshop_session::input::scenes::Inputs;
use surfelshop_session::options::explicit::ExplicitOptions;
use surfelshop_session::options::values::Limit;
use surfelshop_session::output::part_file::PartStart;
use surfelshop_session::output::terminal::{self, Progress};
use surfelshop_session::render::camera_path;
use surfelshop_session::session::{self, RenderSession};
use surfelshop_session::setup::{self, RenderSetup};

/// Runs the command.
pub fn run(arguments: &CompareArguments, given: &ExplicitOptions) -> anyhow::Result<()> {
    check_limits(arguments)?;
    let inputs = Inputs::open(&arguments.files)?;
    let opened = inputs.opened.as_ref();
    let registry = session::registry(&arguments.plugins)?;
    let mut named = requests::named(&registry, &arguments.renderer)?;
    let judge = judge(arguments, &registry, &mut named)?;
    keeps_reference(arguments, &judge, &named)?;
    let patience = arguments.plugins.patience();
    let mut wanted = requests::with_settings(named, &arguments.set, opened, &patience)?;
    let seen = setup::first_view(opened);
    let mut staging = RenderSetup::new(&arguments.picture, given, opened, seen.as_ref())?;
    let folder = part::folder(arguments);
    std::fs::create_dir_all(&folder)
        .with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
    if arguments.part.is_some() {
        part::begin(&folder)?;
    }
    let begun = PartStart::now();
    let mut studio = match wanted.iter().any(|one| one.reference.kind == UnitKind::Renderer) {
        true => Some(RenderSession::open(&arguments.device, &arguments.plugins)?),
        false => None,
    };
    if let Some(studio) = &mut studio {
        studio.engine.tint_backs(staging.display.splats.tint_backs);
    }
    let formats = SessionFormats::new(&arguments.plugins);
    let (surroundings, displayed) = staging.read(&inputs.sources, &formats)?;
    let clouds = &displayed.clouds;
    requests::draw_beside(&mut wanted, &registry, &inputs.sources, &clouds.facts.clouds)?;
    plausibility::note(clouds, &staging.scene);
    let frames = camera_path::frames(arguments.path, &arguments.picture, &staging, opened, clouds)?;
    let (all_frames, frames) = (frames.clone(), part::own_frames(arguments.part, frames)?);
    let Some(first) = frames.first() else { bail!("there is no camera") };
    let stage = Stage {
        plugins: &arguments.plugins,
        staging: &staging,
        clouds,
        surroundings: surroundings.as_ref(),
        view: first.view,
    };
    let started = wanted.into_iter().map(|wanted| Candidate::new(studio.as_ref(), wanted));
    let mut candidates: Vec<Candidate> = started.collect();
    if let Criterion::Candidate(at) = judge {
        random::check(&candidates, at)?;
    }
    let mut told = report::ComparisonOutput::new(folder);
    let progress = Progress::new("comparing".to_owned());
    for (i, frame) in frames.iter().enumerate() {
        let stage = Stage { view: frame.view, ..stage };
        let shots = shots(&stage, studio.as_mut(), &mut candidates, arguments.repeats);
        let truth = truth(&judge, &candidates, &shots)?;
        let measured: Vec<Measured> =
            shots.iter().map(|shot| measured::measure(shot, &truth, &staging)).collect();
        told.frame(&stage, frame, &candidates, &truth, shots, measured)?;
        // Ctrl-C ends the program; the frames that are done are on the disk.
        let _goes_on = progress.tell((i + 1) as f64 / frames.len() as f64);
    }
    drop(progress);
    told.about(&stage, (&arguments.files, &displayed), studio.as_ref(), &candidates);
    let limits = Limits::of(arguments);
    if let Some(part) = arguments.part {
        let whole = part::Whole {
            arguments,
            stage: &stage,
            sources: &inputs.sources,
            candidates: &candidates,
            frames: &all_frames,
            started: begun,
        };
        return whole.write(part, told.compared, limits);
    }
    told.write(arguments.report.json)?;
    verdict(&limits, &told.compared)
}

/// Refuses limits of metrics that there are not, and of such as are better the other way.
fn check_limits(arguments: &CompareArguments) -> anyhow::Result<()> {
    for limit in &arguments.fail_above {
        if let metric @ ("psnr" | "ssim") = limit.metric.as_str() {
            bail!("more {metric} is better: expected --fail-below {metric}={}", limit.value);
        }
    }
    for limit in arguments.fail_above.iter().chain(&arguments.fail_below) {
        let known = metrics::NAMES;
        ensure!(
            known.contains(&limit.metric.as_str()),
            "there is no metric `{}`; there are: {}",
            limit.metric,
            known.join(", ")
        );
    }
    Ok(())
}

/// What a comparison fails above or below, by metric.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Limits {
    above: Vec<(String, f64)>,
    below: Vec<(String, f64)>,
}

impl Limits {
    fn of(arguments: &CompareArguments) -> Self {
        let all = |limits: &[Limit]| limits.iter().map(|l| (l.metric.clone(), l.value)).collect();
        Self { above: all(&arguments.fail_above), below: all(&arguments.fail_below) }
    }
}

/// What decides.
enum Criterion {
    /// One of those that are compared, by its place.
    Candidate(usize),
    /// A file, as typed.
    Picture(String),
}

/// What the others are measured against: added to them where it is none of them.
fn judge(
    arguments: &CompareArguments,
    registry: &Registry,
    named: &mut Vec<Named>,
) -> anyhow::Result<Criterion> {
    let Some(name) = &arguments.reference else { return Ok(Criterion::Candidate(0)) };
    if Path::new(name).extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
        return match arguments.path {
            None => Ok(Criterion::Picture(name.clone())),
            Some(_) => bail!(
                "{name}: a picture shows what one camera sees; leave --path out, or name a renderer \
                 as --reference"
            ),
        };
    }
    if let Some(at) = named.iter().position(|one| one.name == *name) {
        return Ok(Criterion::Candidate(at));
    }
    let reference: UnitRef = setup::drawer(registry, name)?;
    let is_it = |one: &Named| one.reference == reference && one.name == reference.id;
    let at = named.iter().position(is_it).unwrap_or_else(|| {
        named.push(Named { name: reference.id.clone(), reference });
        named.len() - 1
    });
    Ok(Criterion::Candidate(at))
}

/// Refuses to write over the picture that everything is measured against.
fn keeps_reference(
    arguments: &CompareArguments,
    judge: &Criterion,
    named: &[Named],
) -> anyhow::Result<()> {
    let Criterion::Picture(path) = judge else { return Ok(()) };
    let Ok(reference) = Path::new(path).canonicalize() else { return Ok(()) };
    for Named { name, .. } in named {
        let written = arguments.out.join(format!("{name}.exr"));
        if written.canonicalize().is_ok_and(|written| written == reference) {
            bail!(
                "{path}: it would be overwritten with the picture of `{name}`; name another --out"
            );
        }
    }
    Ok(())
}

/// What all make in one frame: each draws once, then they are timed in turns.
fn shots(
    stage: &Stage<'_>,
    mut studio: Option<&mut RenderSession>,
    candidates: &mut [Candidate],
    n_repeats: u32,
) -> Vec<CandidateImage> {
    let mut shots = Vec::with_capacity(candidates.len());
    for candidate in candidates.iter_mut() {
        let drawn = candidate.first(stage, studio.as_deref_mut());
        let drawn = drawn.map_err(|error| format!("{error:#}"));
        shots.push(CandidateImage { drawn, runs: Vec::new() });
    }
    let mut number = 0;
    for _ in 0..n_repeats {
        for (candidate, shot) in candidates.iter_mut().zip(&mut shots) {
            if !candidate.is_worth_timing() || shot.drawn.is_err() {
                continue;
            }
            number += 1;
            match candidate.again(stage, studio.as_deref_mut(), number) {
                Ok(run) => shot.runs.push(run),
                Err(error) => shot.drawn = Err(format!("{error:#}")),
            }
        }
    }
    shots
}

fn truth(
    judge: &Criterion,
    candidates: &[Candidate],
    shots: &[CandidateImage],
) -> anyhow::Result<Truth> {
    let at = match judge {
        Criterion::Candidate(at) => *at,
        Criterion::Picture(path) => {
            let picture = exr::read_color(Path::new(path), exr::MOST_PIXELS)?;
            return Ok(Truth { name: path.clone(), picture, variance: None, candidate: None });
        }
    };
    let (Some(candidate), Some(shot)) = (candidates.get(at), shots.get(at)) else {
        bail!("there is nothing to compare")
    };
    match &shot.drawn {
        Ok(drawn) => Ok(Truth {
            name: candidate.name.clone(),
            picture: drawn.color.clone(),
            variance: drawn.variance.clone(),
            candidate: Some(at),
        }),
        Err(line) => bail!("{line}; there is nothing to measure the others against"),
    }
}

/// Whether all went well: every candidate drew, and none is above a limit.
///
/// # Errors
/// A line for the first that did not.
pub(crate) fn verdict(limits: &Limits, compared: &Compared) -> anyhow::Result<()> {
    let mut failures = Vec::new();
    for (i, ComparedCandidate { name, .. }) in compared.candidates.iter().enumerate() {
        let is_truth = compared.is_truth(i);
        let errors = match compared.pooled(i) {
            Ok(errors) => errors.named(),
            Err(line) => {
                failures.push(format!("`{name}`: {line}"));
                continue;
            }
        };
        let above = limits.above.iter().map(|limit| (limit, "above"));
        let below = limits.below.iter().map(|limit| (limit, "below"));
        // The reference is no better or worse than itself.
        for ((metric, limit), side) in above.chain(below).filter(|_| !is_truth) {
            let found = errors.iter().find(|(name, _)| name == metric);
            let fails = |value: f64| match side {
                "above" => value > *limit,
                _ => value < *limit,
            };
            match found {
                Some((metric, value)) if fails(*value) => {
                    failures.push(format!("{metric} of `{name}` is {value:.6}, {side} {limit}"));
                }
                Some(_) => {}
                None => failures.push(format!(
                    "`{name}` has no {metric}; there are: {}",
                    errors.iter().map(|(metric, _)| *metric).collect::<Vec<_>>().join(", ")
                )),
            }
        }
    }
    match failures.split_first() {
        None => Ok(()),
        Some((first, more)) => {
            more.iter().for_each(terminal::note);
            bail!("{first}")
        }
    }
}
