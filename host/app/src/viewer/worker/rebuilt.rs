//! Rebuilt renderers take over from the old ones, once they have made a picture.

use super::making::{Frames, shot};
use super::{InUse, Worker};
use crate::viewer::darkroom::{News, Order, Place, Print, Shot};
use std::time::Instant;
use surfelshop_api::FrameRequest;
use surfelshop_engine::RendererView;
use surfelshop_engine::plugins::{Changed, Registry};

impl Worker {
    /// Puts rebuilt renderers to use, and lists the plugins anew.
    pub(super) fn changed(&mut self, changed: &Changed) {
        self.list_anew();
        if !changed.exists {
            return;
        }
        let same_file = |in_use: &InUse| in_use.reference.path == changed.path;
        let places: Vec<Place> = self
            .in_use
            .iter()
            .filter(|(_, used)| same_file(used))
            .map(|(place, _)| *place)
            .collect();
        for place in places {
            let Some(old) = self.in_use.remove(&place) else { continue };
            match self.reload(place, &old, changed) {
                Ok((new, shot, report)) => {
                    self.leave_unrefined(place);
                    self.refine_on(place, &new.order, &shot);
                    let (serial, renderer) = (new.order.serial, new.name.clone());
                    self.in_use.insert(place, new);
                    let print = Print { place, serial, renderer, outcome: Ok(shot) };
                    self.teller.tell(News::Print(Box::new(print)));
                    // Once it says so, the picture is there.
                    self.teller.tell(News::Reloaded(report));
                }
                Err(error) => {
                    let name = &old.name;
                    let line = format!("rebuilt {name} is not used, the old one is: {error:#}");
                    self.teller.tell(News::Message(line));
                    self.in_use.insert(place, old);
                }
            }
        }
    }

    /// Lists the plugins anew: files, or what of them is trusted, may have changed.
    pub(super) fn list_anew(&mut self) {
        match self.plugins.search() {
            // Here a file of the command line that is no good is listed as such and no failure.
            Ok(search) => {
                self.registry = Registry::scan(&search);
                self.teller.tell(News::Plugins(self.registry.clone()));
            }
            Err(error) => self.teller.tell(News::Message(format!("{error:#}"))),
        }
    }

    /// A rebuilt renderer, its first picture, made of the order that the old one had last, and what it
    /// took.
    fn reload(
        &mut self,
        place: Place,
        old: &InUse,
        changed: &Changed,
    ) -> anyhow::Result<(InUse, Shot, String)> {
        let order = &old.order;
        let request = FrameRequest {
            view: order.view,
            scene: order.scene.clone(),
            cloud: order.clouds.facts.clone(),
            frame_index: 0,
            values: order.values.clone(),
            environment: self.surroundings(order).map(|light| light.view().environment.clone()),
        };
        // As it was listed anew: a link may lead to another file now, which nobody has said yes to.
        let reference = self.registry.at(&changed.path, &old.reference);
        let reference = reference.unwrap_or_else(|| old.reference.clone());
        let mark = self.marks.as_ref().and_then(|marks| marks.leave(&reference).ok());
        let host = self.studio.engine.gpu().host_info();
        let patience = self.plugins.patience();
        let reloaded = reference.reload(&host, &request, &patience)?;
        let (unit, kept) = (reloaded.unit, reloaded.kept);
        let order = Order { values: kept.values.clone(), ..order.clone() };
        let mut view = RendererView::new(reloaded.hosted, unit.scope());
        let started = Instant::now();
        let (settled, explained) = self.render(&mut view, &order, Frames::of(place, &order))?;
        let shot = shot(&settled, explained, &order, started)?;
        let ms = |duration: std::time::Duration| duration.as_secs_f64() * 1e3;
        let report = format!(
            "{} was rebuilt: load and first graph {:.1} ms, compiling and drawing {:.0} ms, after \
             {:.0} ms to be sure the file is whole{}",
            old.name,
            ms(reloaded.took.total()),
            shot.milliseconds,
            ms(changed.debounce()),
            kept.notes.iter().map(|note| format!("; {note}")).collect::<String>()
        );
        let parameters = unit.description.params.clone();
        let renderer = old.name.clone();
        self.teller.tell(News::Declared { renderer, parameters });
        self.conduct.succeeded(&reference, unit.contents);
        drop(mark);
        let name = old.name.clone();
        Ok((InUse { name, reference, unit, view, mark: None, order }, shot, report))
    }
}
