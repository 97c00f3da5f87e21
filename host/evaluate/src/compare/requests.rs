//! Which renderers and tracers are compared, under which names and with which parameters.

use super::candidate::CandidateRequest;
use anyhow::bail;
use surfelshop_api::params::Values;
use surfelshop_api::{CloudInfo, UnitKind};
use surfelshop_cloud::scene::OpenedScene;
use surfelshop_runtime::plugins::{Registry, Timeouts, UnitRef};
use surfelshop_session::cloud_renderers::{self, Beside};
use surfelshop_session::input::scenes::Source;
use surfelshop_session::options::values::Setting;
use surfelshop_session::output::terminal;
use surfelshop_session::{parameters, session, setup};

/// A renderer or tracer and what it is called.
#[derive(Clone, Debug, PartialEq)]
pub struct Named {
    /// The name.
    pub name: String,
    /// The unit as it was named.
    pub reference: UnitRef,
}

/// What was typed behind `-r`: `ID`, `PACKAGE/ID`, or either behind a name of the user's, as
/// `soft=PACKAGE/ID`. Names are those of files.
pub fn named(registry: &Registry, typed: &[String]) -> anyhow::Result<Vec<Named>> {
    let mut all = Vec::<Named>::with_capacity(typed.len());
    for typed in typed {
        let (name, id) =
            typed.split_once('=').map_or((None, typed.as_str()), |(n, id)| (Some(n), id));
        let reference = setup::drawer(registry, id)?;
        let name = name.map_or_else(|| reference.id.clone(), str::to_owned);
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        if name.is_empty() || name.starts_with('.') || !name.chars().all(is_plain) {
            bail!("-r {typed}: expected a name of letters, digits, -, _ and . before the =");
        }
        // Files of some systems do not tell large letters from small ones.
        if all.iter().any(|other| other.name.eq_ignore_ascii_case(&name)) {
            bail!(
                "-r {typed}: there is another `{name}`; give each a name of its own, as \
                 -r first={id} -r second={id}"
            );
        }
        all.push(Named { name, reference });
    }
    Ok(all)
}

/// Loads all and deals out the settings that were typed, over what the views of a scene say: to what is called so, else to the renderer of that id; what
/// is meant for nobody in particular is meant for all that have it.
pub fn with_settings(
    all: Vec<Named>,
    typed: &[Setting],
    opened: Option<&OpenedScene>,
    patience: &Timeouts,
) -> anyhow::Result<Vec<CandidateRequest>> {
    let names: Vec<String> = all.iter().map(|one| one.name.clone()).collect();
    let mut used = vec![false; typed.len()];
    let mut wanted = Vec::with_capacity(all.len());
    for Named { name, reference } in all {
        // Of one that cannot be loaded, which the table says later, only its name is known.
        let unit = session::load(&reference, patience).map_err(|error| format!("{error:#}"));
        let declared: &[_] = unit.as_ref().map_or(&[], |unit| &unit.description.params);
        let is_meant = |Setting { unit, id, .. }: &Setting| match unit {
            Some(meant) if names.contains(meant) => *meant == name,
            Some(meant) => parameters::names(&reference, meant),
            None => declared.iter().any(|declared| declared.id == *id),
        };
        let mut settings = Vec::new();
        for (setting, used) in typed.iter().zip(&mut used).filter(|(s, _)| is_meant(s)) {
            settings.push(Setting { unit: None, ..setting.clone() });
            *used = true;
        }
        let mut values = Values::new();
        if unit.is_ok() {
            let view = setup::view_of(opened, &reference);
            let (known, unknown) =
                parameters::resolved(&reference, declared, view.as_ref(), &settings)?;
            unknown.iter().for_each(terminal::warn);
            values = known;
        }
        let beside = Beside::default();
        wanted.push(CandidateRequest { name, reference, unit, values, beside });
    }
    if let Some((setting, _)) = typed.iter().zip(used).find(|(_, used)| !used) {
        let Setting { unit, id, value } = setting;
        let whose = unit.as_ref().map(|unit| format!("{unit}:")).unwrap_or_default();
        let names = names.join(", ");
        bail!(
            "--set {whose}{id}={value} is meant for none of the renderers that are compared: {names}"
        );
    }
    Ok(wanted)
}

/// Has clouds that name a renderer drawn by it, whatever else is compared. Tracers draw whole scenes, which is told.
///
/// # Errors
/// One line where such a renderer cannot draw its cloud, or no cloud is left to what is compared.
pub fn draw_beside(
    all: &mut [CandidateRequest],
    registry: &Registry,
    sources: &[Source],
    infos: &[CloudInfo],
) -> anyhow::Result<()> {
    let is = |kind: UnitKind| move |one: &&mut CandidateRequest| one.reference.kind == kind;
    if all.iter_mut().any(|one| is(UnitKind::Tracer)(&one)) {
        cloud_renderers::note_left_out(sources, "tracers draw the whole scene");
    }
    let mut renderers = all.iter_mut().filter(is(UnitKind::Renderer)).peekable();
    if renderers.peek().is_some() {
        let beside = Beside::of(registry, sources, infos)?;
        renderers.for_each(|one| one.beside = beside.clone());
    }
    Ok(())
}
