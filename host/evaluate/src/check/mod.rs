//! `surfelshop check`: plugins against scenes with known answers, extreme cases and symmetries.

mod arguments;
mod own;
mod report;

pub use arguments::CheckArguments;

use crate::conformance::{Case, Outcome, Setup, Verdict, cases, check};
use anyhow::{Context as _, bail};
use own::OwnCases;
use report::CheckOutput;
use std::path::{Path, PathBuf};
use surfelshop_api::UnitKind;
use surfelshop_render::{Engine, EngineOptions, Gpu, SurfelDrawing};
use surfelshop_runtime::plugins::{self, Entry, Registry, UnitRef};
use surfelshop_session::session::{self, surfel_drawing};

const KINDS: [UnitKind; 4] =
    [UnitKind::Renderer, UnitKind::Tracer, UnitKind::Tool, UnitKind::Format];

/// A unit and what came of its cases; or why it could not be checked.
struct Checked {
    reference: UnitRef,
    outcomes: Result<Vec<Outcome>, String>,
}

/// Runs the command.
pub fn run(arguments: &CheckArguments) -> anyhow::Result<()> {
    if arguments.list && arguments.wanted.is_empty() {
        return report::list(arguments, &[]);
    }
    if let Some(folder) = &arguments.out {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
    }
    // A plugin that was named by its file is at hand as with --plugin.
    let files: Vec<PathBuf> = arguments.wanted.iter().filter_map(|text| file(text)).collect();
    let mut given = arguments.plugins.clone();
    given.plugin.extend(files);
    let registry = session::registry(&given)?;
    let mut wanted = wanted(&registry, &arguments.wanted)?;
    let mut own = OwnCases::find(arguments, &wanted)?;
    check_names(&arguments.case, &own)?;
    if arguments.list {
        return report::list(arguments, &own.names().collect::<Vec<_>>());
    }
    let is_own_alone = arguments.scene.is_some() || arguments.accept;
    if arguments.accept && own.is_empty() {
        bail!(
            "--accept: these plugins have no cases of their own; declare some in a file check.toml, or \
             name one with --scene and --expect"
        );
    }
    // A kind without such a case has nothing to say.
    let has_case = |unit: &UnitRef| cases(unit.kind).iter().any(|case| is_wanted(arguments, case));
    wanted.retain(|unit| own.has(unit) || !is_own_alone && has_case(unit));
    let refused: Vec<String> = match arguments.wanted.is_empty() {
        // What was named is there, or was refused in a line already.
        true => registry.entries().iter().filter_map(Entry::refusal).collect(),
        false => Vec::new(),
    };
    let mut all = Vec::with_capacity(wanted.len());
    let mut told = CheckOutput { arguments, refused: &refused, failure: None };
    told.refusals()?;
    for reference in wanted {
        told.begin(&reference)?;
        let outcomes = match is_own_alone {
            true => Ok(Vec::new()),
            false => unit(arguments, &reference, &mut told),
        };
        let outcomes = outcomes.map(|mut outcomes| {
            outcomes.extend(own.run(&reference, &mut telling(&reference, &mut told)));
            outcomes
        });
        if let Err(line) = &outcomes {
            told.not_checked(line)?;
        }
        all.push(Checked { reference, outcomes });
        // One that takes the program with it leaves what was known before.
        told.write(&all)?;
        told.failure.take().map_or(Ok(()), Err)?;
    }
    told.end(&all)?;
    let n_outcomes: usize = all.iter().map(|one| one.outcomes.as_ref().map_or(1, Vec::len)).sum();
    if n_outcomes == 0 {
        bail!("nothing was checked: none of these units has a case {}", arguments.case.join(", "));
    }
    match all.iter().map(Checked::n_failed).sum::<usize>() + refused.len() {
        0 => Ok(()),
        1 => bail!("1 failure"),
        n => bail!("{n} failures"),
    }
}

impl Checked {
    /// Cases that failed; a unit that cannot be checked counts as one.
    fn n_failed(&self) -> usize {
        let failed = |outcome: &&Outcome| outcome.verdict == Verdict::Failed;
        self.outcomes.as_ref().map_or(1, |outcomes| outcomes.iter().filter(failed).count())
    }
}

/// Checks a unit.
fn unit(
    arguments: &CheckArguments,
    reference: &UnitRef,
    told: &mut CheckOutput<'_>,
) -> Result<Vec<Outcome>, String> {
    let patience = arguments.plugins.patience();
    let unit = session::load(reference, &patience).map_err(|error| format!("{error:#}"))?;
    let engine = |options: &EngineOptions| {
        let gpu = Gpu::headless(&session::gpu_options(&arguments.device));
        let gpu = gpu.map_err(|error| error.to_string())?;
        // A case may be about one way to draw.
        let surfels = match options.surfels {
            SurfelDrawing::Automatic => surfel_drawing(&arguments.device),
            way => way,
        };
        let options = EngineOptions { surfels, ..options.clone() };
        Engine::new(gpu, &options).map_err(|error| error.to_string())
    };
    let setup =
        Setup { engine: &engine, device: session::gpu_options(&arguments.device), patience };
    let is_wanted = |case: &Case| is_wanted(arguments, case);
    // Ctrl-C ends the program.
    check(&unit, &setup, &is_wanted, &mut telling(reference, told))
}

/// Tells of outcomes until that fails.
fn telling<'a, 'b>(
    reference: &'a UnitRef,
    told: &'a mut CheckOutput<'b>,
) -> impl FnMut(&Outcome) -> bool + use<'a, 'b> {
    move |outcome| match told.outcome(reference, outcome) {
        Ok(()) => true,
        Err(error) => {
            told.failure = Some(error);
            false
        }
    }
}

/// Whether a case is among those that were typed, or all are wanted.
fn is_wanted(arguments: &CheckArguments, case: &Case) -> bool {
    arguments.case.is_empty() || arguments.case.iter().any(|name| name == case.name)
}

/// Refuses names that no kind of unit has a case of.
fn check_names(typed: &[String], own: &OwnCases<'_>) -> anyhow::Result<()> {
    let mut known: Vec<&str> = KINDS.into_iter().flat_map(cases).map(|case| case.name).collect();
    known.extend(own.names());
    known.sort_unstable();
    known.dedup();
    match typed.iter().find(|name| !known.contains(&name.as_str())) {
        None => Ok(()),
        Some(name) => bail!("--case {name}: there is no such case; there are {}", known.join(", ")),
    }
}

/// The plugin file that an argument names.
fn file(text: &str) -> Option<PathBuf> {
    let path = Path::new(text);
    (plugins::has_library_extension(path) || path.components().count() > 1 && path.is_file())
        .then(|| path.to_owned())
}

/// The units that are meant, each once, in the order of the plugins.
fn wanted(registry: &Registry, typed: &[String]) -> anyhow::Result<Vec<UnitRef>> {
    let mut all = Vec::new();
    for kind in KINDS {
        for (entry, manifest, unit) in registry.units(kind) {
            all.push(entry.unit(manifest, unit));
        }
    }
    if typed.is_empty() {
        return match all.is_empty() {
            true => bail!("no plugin is installed; `surfelshop plugins` says where it looked"),
            false => Ok(all),
        };
    }
    let mut used = vec![false; typed.len()];
    all.retain(|unit| {
        let full = format!("{}/{}", unit.package, unit.id);
        let is_meant = |text: &String| match file(text) {
            Some(path) => same_file(&path, &unit.path),
            None => *text == unit.id || *text == unit.package || *text == full,
        };
        let mut any = false;
        for (text, used) in typed.iter().zip(&mut used).filter(|(text, _)| is_meant(text)) {
            tracing::debug!("{text} means {unit}");
            (any, *used) = (true, true);
        }
        any
    });
    match typed.iter().zip(used).find(|(_, used)| !used) {
        None => Ok(all),
        Some((text, _)) => bail!(
            "{text}: expected a plugin's file, a package, a unit or PACKAGE/UNIT, found none; \
             `surfelshop plugins` lists what is at hand"
        ),
    }
}

fn same_file(a: &Path, b: &Path) -> bool {
    a == b || a.canonicalize().ok().zip(b.canonicalize().ok()).is_some_and(|(a, b)| a == b)
}
