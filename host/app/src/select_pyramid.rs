//! `surfelshop select` over a pyramid: leaf by leaf, whatever its size.

use crate::arguments::SelectArguments;
use crate::select::said;
use anyhow::{anyhow, bail};
use std::path::Path;
use std::sync::Arc;
use surfelshop_api::Scope;
use surfelshop_cloud::selection::{EditLayer, HiddenOnes, LayerChange, RegionStep};
use surfelshop_pyramid::{Pyramid, RemakeOptions, Rule, remake_leaves};
use surfelshop_session::input::budget::within_limits;
use surfelshop_session::input::layers;
use surfelshop_session::input::led_tools::LedTools;
use surfelshop_session::input::scenes::Source;
use surfelshop_session::options::select::regions;
use surfelshop_session::output::terminal::{self, Progress};

/// Runs the command.
pub(crate) fn run(arguments: &SelectArguments, source: &Source) -> anyhow::Result<()> {
    let SelectArguments { file, what, out, delete, set, .. } = arguments;
    if let Some(out) = out.as_deref().filter(|out| !is_known(out)) {
        bail!(
            "{}: of a pyramid select writes another one, .surfels, or its edits, .{}; found another ending",
            out.display(),
            layers::ENDING
        );
    }
    let pyramid = Pyramid::open(&source.path)?;
    let n_surfels = pyramid.directory().n_surfels;
    let before = match arguments.layer.as_ref().or(source.layer.as_ref()) {
        Some(path) => {
            let tools = Arc::new(LedTools::new(&arguments.plugins));
            layers::read(path, n_surfels)?.with_tools(tools)
        }
        None => EditLayer::default(),
    };
    // Who selects without a window selects of all.
    let layer = before.showing_all();
    if before.hides() {
        terminal::note(format!("{}: what its layer hides is selected, too", file.display()));
    }
    let up = arguments.up.or_of([&pyramid.directory().source.of_cloud()]).into();
    let placed = source.transform.unwrap_or_default();
    if source.transform.is_some() && out.as_deref().is_some_and(|out| !layers::is_layer(out)) {
        bail!(
            "{}: the scene moves the pyramid, and a new one stands as its file does; name {}, or write a .{}",
            file.display(),
            source.path.display(),
            layers::ENDING
        );
    }
    let selection =
        regions(what, placed, up).map_err(|line| anyhow!("{}: {line}", file.display()))?;
    let edited = match (delete, &set[..]) {
        (true, _) => layer.with(selection.clone(), LayerChange::Delete),
        (false, []) => layer.with(selection.with(RegionStep::Invert), LayerChange::Delete),
        (false, set) => set.iter().fold(layer.clone(), |layer, value| {
            let change =
                LayerChange::Set { column: value.name.clone(), values: value.values.clone() };
            layer.with(selection.clone(), change)
        }),
    };
    let one = pyramid.overview_cloud(0)?;
    edited.check(&one).map_err(|error| anyhow!("{}: {error}", file.display()))?;
    let [n_selected, n] = {
        let bar = Progress::new(format!("selecting of {}", source.path.display()));
        pyramid.selected((&layer, &selection), &|fraction| bar.tell(fraction))?
    };
    let mut written = None;
    if let Some(out) = out {
        if n_selected == 0 && (*delete || !set.is_empty()) {
            bail!("{}: nothing is selected; nothing was written", file.display());
        }
        let n_left = match (delete, set.is_empty()) {
            (true, _) => n - n_selected,
            (false, true) => n_selected,
            (false, false) => n,
        };
        if n_left == 0 {
            bail!("{}: nothing would be left of {n} surfels", file.display());
        }
        match layers::is_layer(out) {
            true => layers::write(out, n_surfels, &edited)?,
            false => remade(arguments, &pyramid, (&edited, out))?,
        }
        written = Some(n_left);
    }
    said(arguments, [n_selected, n], written)
}

/// Whether this can be written of a pyramid.
fn is_known(out: &Path) -> bool {
    let is_pyramid = out.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("surfels"));
    is_pyramid || layers::is_layer(out)
}

/// Writes a pyramid with edits done.
fn remade(
    arguments: &SelectArguments,
    pyramid: &Pyramid,
    (layer, out): (&EditLayer, &Path),
) -> anyhow::Result<()> {
    let what = format!("select {}", serde_json::to_string(&layer)?);
    let bar = Progress::new(format!("writing {}", out.display()));
    let tell = |fraction| bar.tell(fraction);
    let options = RemakeOptions {
        scope: Scope::Surfel,
        what: &what,
        depends: &[],
        memory: within_limits(arguments.memory),
        rule: Rule::Merged,
        progress: &tell,
    };
    let mut change =
        |leaf| layer.applied(leaf, None, HiddenOnes::Stay).map_err(|error| error.to_string());
    let done = remake_leaves(pyramid, out, &options, &mut change)?;
    done.warnings.iter().for_each(terminal::warn);
    Ok(())
}
