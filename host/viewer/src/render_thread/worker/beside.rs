//! Renderers that draw some clouds of a picture, where another draws the rest.

use super::state::{ActiveRenderer, RenderWorker};
use crate::render_thread::event::RenderEvent;
use crate::render_thread::view_request::ViewSlot;
use anyhow::ensure;
use std::path::Path;
use surfelshop_api::CloudInfo;
use surfelshop_api::params::Values;
use surfelshop_cloud::scene::SceneView;
use surfelshop_render::{Companion, RendererView};
use surfelshop_runtime::plugins::{Contents, CrashMark, LoadedUnit, PluginHealth, UnitRef};
use surfelshop_session::cloud_renderers::{self, DealtRenderer};
use surfelshop_session::input::scenes::NamedRenderer;
use surfelshop_session::parameters;
use surfelshop_session::setup::SelectedView;

/// One of them; its instance is with the view of the one that draws the rest.
struct StartedUnit {
    reference: UnitRef,
    unit: LoadedUnit,
    /// A file that names the unit until its first picture, so that a crash is attributed to it.
    mark: Option<CrashMark>,
}

/// The renderers beside that of a slot, in the order of the view's companions.
#[derive(Default)]
pub(super) struct Beside {
    units: Vec<StartedUnit>,
    /// What they were started for.
    named: Vec<Option<NamedRenderer>>,
    infos: Vec<CloudInfo>,
}

impl Beside {
    pub(super) fn is_empty(&self) -> bool {
        self.units.is_empty()
    }

    /// Whether one of them is of this file.
    pub(super) fn is_of(&self, file: &Path) -> bool {
        self.units.iter().any(|unit| unit.reference.path == file)
    }

    /// Notes that they drew a picture.
    pub(super) fn succeeded(&mut self, health: &mut PluginHealth) {
        for started in &mut self.units {
            started.mark = None;
            health.succeeded(&started.reference, started.unit.contents);
        }
    }
}

impl ActiveRenderer {
    /// The unit that the last frame failed by.
    pub(super) fn failed_by(&self) -> (UnitRef, Contents) {
        let name = self.view.at_fault();
        let other = self.view.others().iter().position(|other| Some(other.name.as_str()) == name);
        match other.and_then(|at| self.beside.units.get(at)) {
            Some(other) => (other.reference.clone(), other.unit.contents),
            None => (self.reference.clone(), self.unit.contents),
        }
    }
}

impl RenderWorker {
    /// Has the renderers that clouds of the request name draw these; those that did before go on where they still do.
    pub(super) fn share(
        &mut self,
        slot: ViewSlot,
        active: &mut ActiveRenderer,
    ) -> anyhow::Result<()> {
        let named = active.request.named.clone();
        let infos = active.request.clouds.facts.clouds.clone();
        if active.beside.named == named
            && (named.iter().all(Option::is_none) || active.beside.infos == infos)
        {
            return Ok(());
        }
        let dealt = cloud_renderers::dealt(&self.registry, &named, &infos)?;
        for one in &dealt {
            let name = &one.named.renderer.name;
            ensure!(
                !self.avoided.contains(name),
                "{} was at work when the program crashed; the plugin list switches it on",
                one.reference
            );
            self.health.check(&one.reference)?;
        }
        let before = active.view.share(active.reference.id.clone(), Vec::new());
        let mut before: Vec<(StartedUnit, Companion)> =
            std::mem::take(&mut active.beside).units.into_iter().zip(before).collect();
        let mut names = vec![active.reference.id.clone()];
        let (mut units, mut others) = (Vec::new(), Vec::new());
        for one in dealt {
            let same = before.iter().position(|(unit, _)| unit.reference == one.reference);
            let (started, view) = match same.map(|at| before.swap_remove(at)) {
                Some((started, companion)) => (started, companion.view),
                None => self.start_beside(slot, &one)?,
            };
            let values = self.values_of(&one, &started.unit)?;
            let name = cloud_renderers::distinct(&one.reference.id, &names);
            names.push(name.clone());
            others.push(Companion { name, view, values, clouds: one.clouds });
            units.push(started);
        }
        active.view.share(active.reference.id.clone(), others);
        active.beside = Beside { units, named, infos };
        Ok(())
    }

    fn start_beside(
        &mut self,
        slot: ViewSlot,
        one: &DealtRenderer,
    ) -> anyhow::Result<(StartedUnit, RendererView)> {
        let (reference, name) = (one.reference.clone(), &one.named.renderer.name);
        let (unit, hosted, mark) = self.start_unit(slot, name, &reference)?;
        let view = RendererView::new(hosted, unit.scope()).needing(&unit.description.needs);
        Ok((StartedUnit { reference, unit, mark }, view))
    }

    /// The values that a cloud has for its renderer.
    fn values_of(&self, one: &DealtRenderer, unit: &LoadedUnit) -> anyhow::Result<Values> {
        let NamedRenderer { renderer, place, folder } = &one.named;
        let view = SceneView { values: renderer.values.clone(), ..SceneView::new(&renderer.name) };
        let (place, folder) = (place.clone(), folder.clone());
        let of_scene = SelectedView { view: &view, place, folder };
        let declared = &unit.description.params;
        let (values, unknown) = parameters::of_view(&one.reference, declared, &of_scene)?;
        unknown.into_iter().for_each(|line| self.events.send(RenderEvent::Message(line)));
        Ok(values)
    }
}
