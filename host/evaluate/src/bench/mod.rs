//! `surfelshop bench`: how long pictures take, with each way to draw surfels; what clouds take in
//! memory; how time grows; and how long the program takes to start.
//!
//! Each variant has a device and an engine of its own, and all draw the same frames in turns, so that
//! what the machine does besides is spread over all of them.

mod arguments;
pub mod body;
mod cells;
mod fit;
mod frames;
mod grown;
mod growth;
mod memory;
mod plot;
mod report;
mod series;
mod split;
mod start;
mod timing;
mod variant;

pub use arguments::BenchArguments;

use crate::compare::requests::{self, Named};
use anyhow::{Context as _, bail};
use std::path::PathBuf;
use surfelshop_api::UnitKind;
use surfelshop_runtime::plugins::Registry;
use surfelshop_session::input::sample::find_sample;
use surfelshop_session::options::explicit::ExplicitOptions;

/// How often the same thing is timed where nothing is typed.
const STILL: u32 = 5;

/// Runs the command.
pub fn run(arguments: &BenchArguments, given: &ExplicitOptions) -> anyhow::Result<()> {
    if let Some(folder) = &arguments.out {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
    }
    match (arguments.growth, arguments.start) {
        (true, _) => growth::run(arguments, given),
        (_, true) => start::run(arguments, given),
        _ => frames::run(arguments, given),
    }
}

/// The files and what they are called: as typed, or the sample where there are none.
fn files(arguments: &BenchArguments) -> anyhow::Result<Vec<(String, PathBuf)>> {
    if arguments.files.is_empty() {
        return Ok(vec![("sample".to_owned(), find_sample()?)]);
    }
    let named = |file: &PathBuf| (file.display().to_string(), file.clone());
    Ok(arguments.files.iter().map(named).collect())
}

/// The renderers, none of them a tracer.
fn renderers(arguments: &BenchArguments, registry: &Registry) -> anyhow::Result<Vec<Named>> {
    let named = requests::named(registry, &arguments.renderer)?;
    if let Some(tracer) = named.iter().find(|one| one.reference.kind != UnitKind::Renderer) {
        bail!("-r {}: expected a renderer, found a tracer; tracers draw no surfels", tracer.name);
    }
    Ok(named)
}
