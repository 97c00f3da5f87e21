//! What draws a picture where nobody says it, and what clouds name for themselves.

use super::arguments::RenderArguments;
use crate::cloud_renderers;
use crate::input::clouds::Clouds;
use crate::input::scenes::{Inputs, NamedRenderer};
use crate::options::values::Setting;
use crate::session::{LoadedRenderer, RenderSession};
use anyhow::ensure;
use surfelshop_api::CloudInfo;
use surfelshop_runtime::plugins::Registry;

/// Has the renderers that clouds name draw these; and chooses what reads columns that only some clouds have, where
/// nobody said what draws. A graph that is to be saved has all bytes in it.
pub(super) fn choose_suited(
    arguments: &RenderArguments,
    inputs: &Inputs,
    registry: &Registry,
    clouds: &Clouds,
    studio: &mut RenderSession,
    (is_said, first): (bool, anyhow::Result<LoadedRenderer>),
) -> anyhow::Result<LoadedRenderer> {
    // A captured graph is of a scene of then.
    if arguments.graph.is_some() {
        return first;
    }
    let infos = &clouds.facts.clouds;
    let mut named = cloud_renderers::named(&inputs.sources);
    let typed = &arguments.set;
    let mut chosen = match is_said {
        true => first?,
        false => suited_or(first, typed, inputs, registry, infos, &mut named, studio)?,
    };
    if arguments.save_graph.is_some() {
        chosen.view.send_all();
    }
    let dealt = cloud_renderers::dealt(registry, &named, infos)?;
    studio.share(&mut chosen, dealt, typed, infos)?;
    let alone = chosen.beside.is_empty() || arguments.save_graph.is_none();
    ensure!(alone, "--save-graph: {} draw the clouds, and one graph is saved", chosen.ids());
    Ok(chosen)
}

/// A renderer that may have failed to start, where that is not final: clouds that are yet to be read may suit another.
///
/// # Errors
/// Why it failed, where that is final.
pub fn known_now(
    first: anyhow::Result<LoadedRenderer>,
    is_final: bool,
) -> anyhow::Result<anyhow::Result<LoadedRenderer>> {
    match first {
        Err(error) if is_final => Err(error),
        first => Ok(first),
    }
}

/// Where nobody says what draws: the renderer that suits the clouds, where one does, with what was typed; else the
/// usual one, which was tried `first`. What was typed for that, and suits it, says that it is meant.
///
/// # Errors
/// Why neither can be started.
pub fn suited_or(
    first: anyhow::Result<LoadedRenderer>,
    typed: &[Setting],
    inputs: &Inputs,
    registry: &Registry,
    infos: &[CloudInfo],
    named: &mut [Option<NamedRenderer>],
    studio: &RenderSession,
) -> anyhow::Result<LoadedRenderer> {
    if first.is_ok() && !typed.is_empty() {
        return first;
    }
    let places: Vec<String> =
        inputs.sources.iter().map(|source| source.path.display().to_string()).collect();
    match cloud_renderers::suit(registry, infos, named, &places) {
        Some(suited) => {
            let own = cloud_renderers::settings_of_view(typed, &suited, named);
            studio.choose_for(suited, None, &own)
        }
        None => first,
    }
}
