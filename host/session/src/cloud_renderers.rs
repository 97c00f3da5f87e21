//! Which renderer draws which cloud of a scene: what a cloud names, else what draws the view.

use crate::input::scenes::{NamedRenderer, Source};
use crate::options::values::Setting;
use crate::output::terminal;
use crate::parameters;
use crate::session::{LoadedCompanion, LoadedRenderer, RenderSession};
use crate::setup::SelectedView;
use anyhow::{Context as _, bail};
use std::path::PathBuf;
use surfelshop_api::params::Values;
use surfelshop_api::{CloudInfo, Need, UnitKind};
use surfelshop_cloud::scene::{CloudRenderer, SceneView};
use surfelshop_render::Companion;
use surfelshop_runtime::plugins::{Registry, UnitRef};

/// A renderer and its clouds, by their numbers among those that are shown.
#[derive(Clone, Debug)]
pub struct DealtRenderer {
    /// The renderer.
    pub reference: UnitRef,
    /// What the first of its clouds says.
    pub named: NamedRenderer,
    /// Its clouds.
    pub clouds: Vec<u32>,
}

/// The renderers that clouds name, beside one that is measured and draws the rest.
#[derive(Clone, Debug, Default)]
pub struct Beside {
    dealt: Vec<DealtRenderer>,
    infos: Vec<CloudInfo>,
}

impl Beside {
    /// Those of a scene.
    ///
    /// # Errors
    /// One line where a renderer is not there or cannot draw its cloud, and where every cloud names one: nothing that is
    /// measured would draw then.
    pub fn of(
        registry: &Registry,
        sources: &[Source],
        infos: &[CloudInfo],
    ) -> anyhow::Result<Self> {
        let named = named(sources);
        let dealt = dealt(registry, &named, infos)?;
        let is_left = |(i, info): (usize, &CloudInfo)| {
            info.n_surfels > 0 && !named.get(i).is_some_and(Option::is_some)
        };
        if let Some(first) = dealt.first()
            && !infos.iter().enumerate().any(is_left)
        {
            bail!(
                "{}: every cloud names a renderer, and none is left to those that are measured; leave `renderer` out \
                 of the clouds that they shall draw",
                first.named.place
            );
        }
        Ok(Self { dealt, infos: infos.to_vec() })
    }

    /// What decides which pictures come of it, in words.
    #[must_use]
    pub fn describe(&self) -> Vec<String> {
        let line = |one: &DealtRenderer| {
            format!("{} {:?} {:?}", one.reference, one.named.renderer.values, one.clouds)
        };
        self.dealt.iter().map(line).collect()
    }
}

/// What each cloud names.
pub fn named(sources: &[Source]) -> Vec<Option<NamedRenderer>> {
    sources.iter().map(|source| source.renderer.clone()).collect()
}

/// Says that clouds' own renderers do not count, where they do not.
pub fn note_left_out(sources: &[Source], what: &str) {
    let n = sources.iter().filter(|source| source.renderer.is_some()).count();
    if n > 0 {
        let clouds = if n == 1 { "1 cloud names".to_owned() } else { format!("{n} clouds name") };
        terminal::note(format!("{clouds} a renderer; {what}"));
    }
}

/// The settings that are typed for a renderer among several: those that name it, and for the view's own those that
/// name none. What names nothing that is used is left to the view's own, which refuses it.
pub fn settings_of_view(
    typed: &[Setting],
    own: &UnitRef,
    named: &[Option<NamedRenderer>],
) -> Vec<Setting> {
    let is_clouds = |unit: &str| {
        let id = |name: &str| name.rsplit('/').next().unwrap_or(name).to_owned();
        named.iter().flatten().any(|named| id(&named.renderer.name) == id(unit))
    };
    let is_own = |setting: &&Setting| {
        let unit = setting.unit.as_deref();
        unit.is_none_or(|unit| parameters::names(own, unit) || !is_clouds(unit))
    };
    typed.iter().filter(is_own).cloned().collect()
}

/// What draws clouds where nobody says anything: the renderer that suits all that name none, if there is one; else for
/// each what suits it alone is noted, and the usual one draws the rest.
pub fn suit(
    registry: &Registry,
    infos: &[CloudInfo],
    named: &mut [Option<NamedRenderer>],
    places: &[String],
) -> Option<UnitRef> {
    let unsaid: Vec<CloudInfo> = infos
        .iter()
        .zip(named.iter())
        .filter(|(_, named)| named.is_none())
        .map(|(info, _)| info.clone())
        .collect();
    if let Some(all) = registry.suited(&unsaid) {
        return Some(all);
    }
    for ((info, named), place) in infos.iter().zip(named.iter_mut()).zip(places) {
        if named.is_none()
            && let Some(suited) = registry.suited(std::slice::from_ref(info))
        {
            let renderer = CloudRenderer { name: registry.name(&suited), values: Values::new() };
            let (place, folder) = (place.clone(), PathBuf::new());
            *named = Some(NamedRenderer { renderer, place, folder });
        }
    }
    None
}

/// The renderers that clouds name, each with its clouds: in the order of their names and values, whatever the order of
/// the clouds.
///
/// # Errors
/// One line that names the cloud and the renderer, where there is none or the cloud lacks what it needs.
pub fn dealt(
    registry: &Registry,
    named: &[Option<NamedRenderer>],
    infos: &[CloudInfo],
) -> anyhow::Result<Vec<DealtRenderer>> {
    let mut all: Vec<DealtRenderer> = Vec::new();
    for (i, named) in (0..).zip(named) {
        let Some(named) = named else { continue };
        let reference = found(registry, named)?;
        if let Some(info) = infos.get(i as usize) {
            check_needs(registry, named, &reference, info)?;
        }
        let same = all.iter_mut().find(|other| {
            other.reference == reference
                && other.named.renderer.values == named.renderer.values
                && other.named.folder == named.folder
        });
        match same {
            Some(other) => other.clouds.push(i),
            None => all.push(DealtRenderer { reference, named: named.clone(), clouds: vec![i] }),
        }
    }
    let values = |dealt: &DealtRenderer| format!("{:?}", dealt.named.renderer.values);
    all.sort_by_cached_key(|dealt| {
        (dealt.reference.id.clone(), dealt.reference.package.clone(), values(dealt))
    });
    Ok(all)
}

fn found(registry: &Registry, named: &NamedRenderer) -> anyhow::Result<UnitRef> {
    let (name, place) = (&named.renderer.name, &named.place);
    match registry.find(UnitKind::Renderer, name) {
        Ok(reference) => Ok(reference),
        Err(_) if registry.find(UnitKind::Tracer, name).is_ok() => bail!(
            "{place}: expected a renderer for the cloud, found the tracer `{name}`, which draws whole scenes; name a \
             renderer, or have the tracer draw the view"
        ),
        Err(unknown) => Err(anyhow::Error::from(unknown)).with_context(|| place.clone()),
    }
}

/// # Errors
/// Where a cloud with surfels lacks columns that its renderer needs.
fn check_needs(
    registry: &Registry,
    named: &NamedRenderer,
    reference: &UnitRef,
    info: &CloudInfo,
) -> anyhow::Result<()> {
    let needs: Vec<Need> = registry.needs(reference);
    let missing: Vec<String> = info.lacks(&needs).map(Need::to_string).collect();
    if missing.is_empty() || info.n_surfels == 0 {
        return Ok(());
    }
    let NamedRenderer { renderer: CloudRenderer { name, .. }, place, .. } = named;
    bail!(
        "{place}: renderer `{name}` cannot draw the cloud, which lacks {}; name another renderer for it, or none for \
         the view's own",
        missing.join(", ")
    )
}

impl RenderSession {
    /// Has the renderers that clouds name draw these, where another draws the rest; with parameters that are typed for
    /// them. Where no cloud is left to that other, the first of them takes its place.
    pub fn share(
        &self,
        chosen: &mut LoadedRenderer,
        dealt: Vec<DealtRenderer>,
        typed: &[Setting],
        infos: &[CloudInfo],
    ) -> anyhow::Result<()> {
        let mut loaded: Vec<LoadedRenderer> = Vec::new();
        let mut clouds: Vec<Vec<u32>> = Vec::new();
        for one in dealt {
            let started = self.companion(&one, typed)?;
            let is_same = |other: &LoadedRenderer| {
                other.reference == started.reference && other.values == started.values
            };
            if is_same(chosen) {
                continue;
            }
            match loaded.iter().position(is_same) {
                Some(at) => clouds[at].extend(&one.clouds),
                None => {
                    loaded.push(started);
                    clouds.push(one.clouds);
                }
            }
        }
        let is_left = |(i, info): (usize, &CloudInfo)| {
            info.n_surfels > 0 && !clouds.iter().flatten().any(|cloud| *cloud as usize == i)
        };
        if !infos.iter().enumerate().any(is_left) && !loaded.is_empty() {
            *chosen = loaded.remove(0);
            clouds.remove(0);
        }
        let mut names = vec![chosen.reference.id.clone()];
        let mut others = Vec::new();
        for (one, clouds) in loaded.into_iter().zip(clouds) {
            let LoadedRenderer { reference, unit, values, view, .. } = one;
            let name = distinct(&reference.id, &names);
            names.push(name.clone());
            others.push(Companion { name, view, values: values.clone(), clouds: clouds.clone() });
            chosen.beside.push(LoadedCompanion { reference, unit, values, clouds });
        }
        chosen.view.share(chosen.reference.id.clone(), others);
        Ok(())
    }

    /// The same beside a renderer that is measured.
    ///
    /// # Errors
    /// Where one of them cannot be loaded.
    pub fn share_measured(
        &self,
        chosen: &mut LoadedRenderer,
        beside: &Beside,
    ) -> anyhow::Result<()> {
        match beside.dealt.is_empty() {
            true => Ok(()),
            false => self.share(chosen, beside.dealt.clone(), &[], &beside.infos),
        }
    }

    /// Loads a renderer that clouds name.
    fn companion(&self, one: &DealtRenderer, typed: &[Setting]) -> anyhow::Result<LoadedRenderer> {
        let NamedRenderer { renderer, place, folder } = &one.named;
        let view = SceneView { values: renderer.values.clone(), ..SceneView::new(&renderer.name) };
        let (place, folder) = (place.clone(), folder.clone());
        let of_scene = SelectedView { view: &view, place, folder };
        let is_meant = |setting: &&Setting| {
            setting.unit.as_ref().is_some_and(|unit| parameters::names(&one.reference, unit))
        };
        let typed: Vec<Setting> = typed.iter().filter(is_meant).cloned().collect();
        self.choose_for(one.reference.clone(), Some(&of_scene), &typed)
    }
}

/// A name that none of these has: a renderer may draw several clouds with other parameters each.
pub fn distinct(id: &str, names: &[String]) -> String {
    let numbered = (2..).map(|n| format!("{id} {n}"));
    let mut all = std::iter::once(id.to_owned()).chain(numbered);
    all.find(|name| !names.contains(name)).unwrap_or_else(|| id.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(name: &str) -> Option<NamedRenderer> {
        let renderer = CloudRenderer { name: name.to_owned(), values: Values::new() };
        let (place, folder) = ("a.scene.toml:7".to_owned(), PathBuf::new());
        Some(NamedRenderer { renderer, place, folder })
    }

    #[test]
    fn unknown_renderers_are_named_with_their_cloud() {
        let registry = Registry::default();
        let line = dealt(&registry, &[None, named("nobody")], &[]).unwrap_err();
        let line = format!("{line:#}");
        assert!(line.starts_with("a.scene.toml:7: ") && line.contains("`nobody`"), "{line}");
    }

    #[test]
    fn typed_settings_reach_the_renderer_that_they_name() {
        let own = UnitRef::named(UnitKind::Renderer, "org.example", "mine", "mine.so");
        let typed = ["a=1", "mine:b=2", "org.other/theirs:c=3", "nobody:d=4"];
        let typed: Vec<Setting> = typed.iter().map(|text| Setting::parse(text).unwrap()).collect();
        let found = settings_of_view(&typed, &own, &[named("theirs")]);
        let ids: Vec<&str> = found.iter().map(|setting| setting.id.as_str()).collect();
        assert_eq!(ids, ["a", "b", "d"]);
    }

    #[test]
    fn names_differ() {
        let names = ["flat", "flat 2"].map(str::to_owned);
        assert_eq!(distinct("flat", &names), "flat 3");
        assert_eq!(distinct("ewa-phong", &names), "ewa-phong");
    }
}
