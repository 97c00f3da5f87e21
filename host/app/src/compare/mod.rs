//! `surfelshop compare`: several renderers over one scene, measured against one of them or a picture.

pub(crate) mod candidate;
mod told;

pub(crate) use told::quoted;

use crate::arguments::CompareArguments;
use crate::clouds::Clouds;
use crate::given::Given;
use crate::scenes::Inputs;
use crate::staging::{self, Staging};
use crate::studio::{self, Studio};
use crate::surroundings::{self, Surroundings};
use crate::{exr_file, files, render, terminal};
use anyhow::{Context as _, bail};
use candidate::{Candidate, Drawn};
use std::path::Path;
use surfelshop_api::{UnitKind, View};
use surfelshop_engine::Image;
use surfelshop_engine::metrics::{self, Comparison, Maps, Reference};
use surfelshop_engine::plugins::{Registry, UnitRef};

/// What all candidates draw.
pub(crate) struct Stage<'a> {
    pub(crate) arguments: &'a CompareArguments,
    pub(crate) staging: &'a Staging,
    pub(crate) clouds: &'a Clouds,
    pub(crate) surroundings: Option<&'a Surroundings>,
    pub(crate) view: View,
}

/// What candidates are measured against.
pub(crate) struct Truth {
    pub(crate) name: String,
    pub(crate) picture: Image,
    pub(crate) variance: Option<Image>,
    /// The candidate that it is, where it is one.
    pub(crate) candidate: Option<usize>,
}

/// A candidate's numbers, or why there are none.
struct Measured {
    comparison: Result<Comparison, String>,
    maps: Option<Maps>,
}

/// Runs the command.
pub(crate) fn run(arguments: &CompareArguments, given: &Given) -> anyhow::Result<()> {
    let inputs = Inputs::open(&arguments.files)?;
    let opened = inputs.opened.as_ref();
    let registry = studio::registry(&arguments.plugins.plugin)?;
    let mut references = Vec::new();
    for name in &arguments.renderer {
        references.push(staging::drawer(&registry, name)?);
    }
    let known = |unit: &UnitRef| references.iter().position(|other| other == unit);
    let judge = judge(arguments, &registry)?;
    let judge_at = match &judge {
        Judge::First => Some(0),
        Judge::Unit(unit) => known(unit),
        Judge::Picture(_) => None,
    };
    let added = match &judge {
        Judge::Unit(unit) if judge_at.is_none() => Some(unit.clone()),
        _ => None,
    };
    references.extend(added);
    let seen = staging::first_view(opened);
    let staging = Staging::new(&arguments.picture, given, opened, seen.as_ref())?;
    std::fs::create_dir_all(&arguments.out)
        .with_context(|| format!("{}: the folder cannot be made", arguments.out.display()))?;
    let mut studio = match references.iter().any(|unit| unit.kind == UnitKind::Renderer) {
        true => Some(Studio::open(&arguments.device, &arguments.plugins)?),
        false => None,
    };
    let surroundings = surroundings::read_wanted(staging.environment.as_ref())?;
    let clouds = Clouds::read(&inputs.sources)?;
    let view = render::view(&arguments.picture, &staging, &clouds);
    let surroundings = surroundings.as_ref();
    let stage = Stage { arguments, staging: &staging, clouds: &clouds, surroundings, view };
    let mut candidates = candidate::all(&stage, studio.as_ref(), references)?;
    candidate::draw(&stage, studio.as_mut(), &mut candidates);
    let truth = truth(&judge, judge_at, &candidates)?;
    let measured: Vec<Measured> =
        candidates.iter().map(|candidate| measure(candidate, &truth, &staging)).collect();
    told::write(&stage, studio.as_ref(), &candidates, &truth, &measured)?;
    verdict(arguments, &candidates, &measured)
}

/// What decides, as typed.
enum Judge {
    First,
    Unit(UnitRef),
    Picture(String),
}

fn judge(arguments: &CompareArguments, registry: &Registry) -> anyhow::Result<Judge> {
    let Some(name) = &arguments.reference else { return Ok(Judge::First) };
    let is_picture = Path::new(name).extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    match is_picture {
        true => Ok(Judge::Picture(name.clone())),
        false => Ok(Judge::Unit(staging::drawer(registry, name)?)),
    }
}

fn truth(judge: &Judge, at: Option<usize>, candidates: &[Candidate]) -> anyhow::Result<Truth> {
    if let Judge::Picture(path) = judge {
        let picture = exr_file::read_color(Path::new(path))?;
        return Ok(Truth { name: path.clone(), picture, variance: None, candidate: None });
    }
    let index = at.unwrap_or(candidates.len().saturating_sub(1));
    let Some(candidate) = candidates.get(index) else { bail!("there is nothing to compare") };
    match &candidate.drawn {
        Ok(Drawn { color, variance, .. }) => Ok(Truth {
            name: candidate.name.clone(),
            picture: color.clone(),
            variance: variance.clone(),
            candidate: Some(index),
        }),
        Err(line) => bail!("{line}; there is nothing to measure the others against"),
    }
}

fn measure(candidate: &Candidate, truth: &Truth, staging: &Staging) -> Measured {
    let settings = metrics::Settings { development: staging.how, ..Default::default() };
    let reference = Reference { picture: &truth.picture, variance: truth.variance.as_ref() };
    let compared = match &candidate.drawn {
        Ok(drawn) => metrics::compare_with_maps(&drawn.color, reference, &settings)
            .map_err(|error| error.to_string()),
        Err(line) => Err(line.clone()),
    };
    match compared {
        Ok((comparison, maps)) => Measured { comparison: Ok(comparison), maps: Some(maps) },
        Err(line) => Measured { comparison: Err(line), maps: None },
    }
}

/// Whether all went well: every candidate drew, and none is above a limit.
fn verdict(
    arguments: &CompareArguments,
    candidates: &[Candidate],
    measured: &[Measured],
) -> anyhow::Result<()> {
    let mut failures = Vec::new();
    for (Candidate { name, .. }, measured) in candidates.iter().zip(measured) {
        let errors = match &measured.comparison {
            Err(line) => {
                failures.push(line.clone());
                continue;
            }
            Ok(Comparison { errors: Some(errors), .. }) => errors,
            Ok(comparison) => {
                let n = comparison.n_not_finite;
                failures.push(format!("{n} pixels of `{name}` are not finite"));
                continue;
            }
        };
        for limit in &arguments.fail_above {
            let found = errors.named().into_iter().find(|(metric, _)| *metric == limit.metric);
            match found {
                Some((metric, value)) if value > limit.value => {
                    failures
                        .push(format!("{metric} of `{name}` is {value:.6}, above {}", limit.value));
                }
                Some(_) => {}
                None => failures.push(format!(
                    "`{name}` has no {}; there are: {}",
                    limit.metric,
                    errors.named().iter().map(|(metric, _)| *metric).collect::<Vec<_>>().join(", ")
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

/// Writes a file into the folder.
pub(crate) fn put(folder: &Path, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
    files::write_whole(&folder.join(name), bytes)
}
