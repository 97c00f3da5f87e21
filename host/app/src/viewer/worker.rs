//! The thread that makes pictures: it owns the engine's device and everything on it, and the
//! renderers in use.
//!
//! Nothing a plugin does ends it: each has a thread of its own and a deadline, one that fails three
//! times in a row or does not answer is switched off, a rebuilt one takes over only after its first
//! picture, and a lost device is opened again.

mod rebuilt;

use super::arriving::{Arrived, Arriving};
use super::darkroom::{News, Order, Place, Print, Queue, Shot, Task, Teller, UnitConduct};
use super::export;
use crate::arguments::{DeviceArguments, PluginFiles};
use crate::pictures;
use crate::studio::{self, Settled, Studio};
use crate::surroundings::{Probes, Surroundings};
use anyhow::{Context as _, anyhow};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;
use surfelshop_api::UnitKind;
use surfelshop_api::abi::host_side::Fault;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{ParamKind, Value};
use surfelshop_engine::plugins::{
    self, Conduct, Contents, LoadedUnit, Mark, Marks, Origin, Registry, Standing, UnitRef, Watcher,
};
use surfelshop_engine::{Explanation, RenderError, RenderRequest, RendererView};

const OUTPUTS: [Output; 2] = [Output::Color, Output::Depth];

/// A renderer in use at a place.
struct InUse {
    name: String,
    reference: UnitRef,
    unit: LoadedUnit,
    view: RendererView,
    /// Says in a file that the unit's code is on trial, until its first picture.
    mark: Option<Mark>,
    /// What it was asked for last.
    order: Order,
}

impl InUse {
    /// Whether an error is put down to a file that a parameter names: what is wrong with that is no
    /// failure of the plugin, however often.
    fn is_of_a_file(&self, error: &RenderError) -> bool {
        let refused =
            matches!(error, RenderError::Pass { .. } | RenderError::Plugin(Fault::Error(_)));
        refused && self.files().next().is_some()
    }

    /// The files that its parameters name.
    fn files(&self) -> impl Iterator<Item = PathBuf> {
        let declared = self.unit.description.params.iter();
        let paths = declared.filter(|p| matches!(p.kind, ParamKind::File { .. }));
        paths.filter_map(|parameter| match self.order.values.get(&parameter.id)? {
            Value::Text(path) if !path.is_empty() => Some(PathBuf::from(path)),
            _ => None,
        })
    }
}

pub(super) struct Worker {
    studio: Studio,
    device: DeviceArguments,
    plugins: PluginFiles,
    registry: Registry,
    in_use: HashMap<Place, InUse>,
    conduct: Conduct,
    /// Renderers the user does not want.
    avoided: Vec<String>,
    marks: Option<Marks>,
    probes: Probes,
    teller: Teller,
    /// Watches until the worker ends.
    watcher: Option<Watcher>,
    /// Files that parameters name, which are watched, too.
    followed: HashSet<PathBuf>,
    queue: Queue,
    /// Large clouds on their way.
    arriving: Arriving,
    /// Orders that were answered with a few of their surfels, or wait for all.
    unfinished: HashMap<Place, Order>,
}

/// Opens the device. Anything may be asked for at any moment, so that large clouds keep their columns.
fn open(device: &DeviceArguments, plugins: &PluginFiles) -> anyhow::Result<Studio> {
    let mut studio = Studio::open(device, plugins)?;
    studio.engine.keep_whole_from(super::arriving::LARGE);
    Ok(studio)
}

impl Worker {
    /// Opens the device; tells the window and returns nothing where there is none.
    pub(super) fn open(
        device: DeviceArguments,
        plugins: PluginFiles,
        teller: Teller,
        queue: &Queue,
    ) -> Option<Self> {
        // Before the scan, so that nothing changes unseen between the two.
        let changes = queue.clone();
        // Where trust cannot be read, the registry says so below.
        let search = plugins.search().unwrap_or_default();
        let watcher = Watcher::start(&search, move |changed| changes.add(Task::Changed(changed)));
        let opened = studio::registry(&plugins)
            .and_then(|registry| open(&device, &plugins).map(|studio| (studio, registry)));
        match opened {
            Ok((studio, registry)) => {
                let worker = Self {
                    studio,
                    device,
                    plugins,
                    registry,
                    in_use: HashMap::new(),
                    conduct: Conduct::default(),
                    avoided: Vec::new(),
                    marks: Marks::of_user(),
                    probes: Probes::default(),
                    followed: HashSet::new(),
                    watcher: watcher
                        .map_err(|error| {
                            let line = format!("rebuilt plugins will not be noticed: {error}");
                            teller.tell(News::Message(line));
                        })
                        .ok(),
                    teller,
                    queue: queue.clone(),
                    arriving: Arriving::default(),
                    unfinished: HashMap::new(),
                };
                worker.tell_device();
                Some(worker)
            }
            Err(error) => {
                teller.tell(News::NoDevice(format!("{error:#}")));
                None
            }
        }
    }

    fn tell_device(&self) {
        let gpu = self.studio.engine.gpu();
        let (adapter, software) = (gpu.describe(), gpu.is_software());
        self.teller.tell(News::Open { adapter, software });
    }

    /// Works until the window is gone.
    pub(super) fn work(&mut self, queue: &Queue) {
        while let Some(task) = queue.next() {
            match task {
                Task::Picture(place, order) => self.picture(place, *order),
                Task::Changed(changed) if self.followed.contains(&changed.path) => {
                    self.file_changed(&changed.path);
                }
                Task::Changed(changed) => self.changed(&changed),
                Task::Trust(once) => {
                    self.plugins.trusted_once.extend(once);
                    self.list_anew();
                }
                Task::Avoid(renderer) => self.avoided.push(renderer),
                Task::Arriving(serial, fraction) => {
                    if self.arriving.is_meant(serial) {
                        self.teller.tell(News::Arriving(Some(fraction)));
                    }
                }
                Task::Arrived(arrived) => self.arrived(*arrived),
                Task::LetGo(place) => {
                    self.in_use.remove(&place);
                    self.unfinished.remove(&place);
                }
                #[cfg(test)]
                Task::LoseDevice => self.studio.engine.gpu().device.destroy(),
                Task::SwitchOn(renderer) => {
                    self.avoided.retain(|other| *other != renderer);
                    if let Ok(unit) = self.registry.find(UnitKind::Renderer, &renderer) {
                        self.conduct.switch_on(&unit);
                    }
                    self.tell_conduct();
                }
            }
        }
    }

    fn picture(&mut self, place: Place, order: Order) {
        let was_at_work = self.arriving.is_at_work();
        let few = self.arriving.order(&order, &self.studio.engine).unwrap_or_else(|error| {
            self.teller.tell(News::Message(error.to_string()));
            None
        });
        if was_at_work && !self.arriving.is_at_work() {
            self.teller.tell(News::Arriving(None));
        }
        if few.is_some() && (order.is_measured || place == export::PLACE) {
            // Pictures that are measured or written wait for all.
            self.unfinished.insert(place, order);
            return self.go_on_arriving();
        }
        let (serial, renderer) = (order.serial, order.renderer.clone());
        let drawn = few.as_ref().map_or(&order, |(few, _)| few);
        let outcome = self.make(place, &order, drawn).map(|mut shot| {
            shot.one_of = few.as_ref().map_or(1, |(_, stride)| *stride);
            shot
        });
        match few {
            Some(_) => drop(self.unfinished.insert(place, order)),
            None => drop(self.unfinished.remove(&place)),
        }
        let outcome = outcome.map_err(|error| format!("{error:#}"));
        self.teller.tell(News::Counters(self.studio.engine.counters()));
        self.teller.tell(News::Print(Box::new(Print { place, serial, renderer, outcome })));
        // Behind the first picture, which would have to share the processor.
        self.go_on_arriving();
    }

    /// Puts the next large cloud in order, where one is missing.
    fn go_on_arriving(&mut self) {
        let was_at_work = self.arriving.is_at_work();
        if let Err(error) = self.arriving.go_on(&self.studio.engine, &self.queue) {
            self.teller.tell(News::Message(format!("{error:#}")));
            self.order_again();
        }
        if self.arriving.is_at_work() && !was_at_work {
            self.teller.tell(News::Arriving(Some(0.0)));
        }
    }

    /// Makes the pictures again that showed a few surfels of what is there now.
    fn arrived(&mut self, arrived: Arrived) {
        let was_at_work = self.arriving.is_at_work();
        if let Some(supply) = self.arriving.take(arrived) {
            self.studio.engine.take(supply);
        }
        if was_at_work && !self.arriving.is_at_work() {
            self.teller.tell(News::Arriving(None));
            self.order_again();
        }
    }

    fn order_again(&mut self) {
        let unfinished: Vec<(Place, Order)> = self.unfinished.drain().collect();
        for (place, order) in unfinished {
            self.queue.order_again(place, order);
        }
    }

    /// Makes a picture with the renderer that is at the place, or another one; `drawn` is what is drawn
    /// for the order, itself or with a few of its surfels.
    ///
    /// The renderer that was there is let go only when the other one has made its picture.
    fn make(&mut self, place: Place, order: &Order, drawn: &Order) -> anyhow::Result<Shot> {
        let started = Instant::now();
        let here = self.in_use.remove(&place);
        let (mut in_use, before) = match here {
            Some(in_use) if in_use.name == order.renderer => (in_use, None),
            before => match self.start(place, order) {
                Ok(in_use) => (in_use, before),
                Err(error) => {
                    self.in_use.extend(before.map(|before| (place, before)));
                    return Err(error);
                }
            },
        };
        in_use.order = order.clone();
        if let Err(barred) = self.conduct.check(&in_use.reference) {
            self.in_use.extend(before.map(|before| (place, before)));
            return Err(barred.into());
        }
        self.follow(&in_use);
        match self.render(&mut in_use.view, drawn) {
            Ok((settled, explained)) => {
                in_use.mark = None;
                self.conduct.succeeded(&in_use.reference, in_use.unit.contents);
                self.in_use.insert(place, in_use);
                shot(&settled, explained, order, started)
            }
            Err(error) => {
                let lost = matches!(error, RenderError::DeviceLost(_));
                if !in_use.is_of_a_file(&error) {
                    self.failed(&in_use.reference, in_use.unit.contents, &fault_of(&error));
                }
                let stays = before.is_none();
                self.in_use.extend(before.map(|before| (place, before)));
                if stays {
                    self.in_use.insert(place, in_use);
                }
                if lost {
                    self.open_again()?;
                }
                Err(error.into())
            }
        }
    }

    /// Watches the files that a renderer's parameters name.
    fn follow(&mut self, in_use: &InUse) {
        for path in in_use.files() {
            if let Some(watcher) = &self.watcher
                && self.followed.insert(path.clone())
            {
                watcher.add(plugins::Place::new(path, Origin::CommandLine));
            }
        }
    }

    /// Makes the pictures again that a file is part of.
    fn file_changed(&mut self, path: &Path) {
        let affected = self.in_use.iter().filter(|(_, used)| used.files().any(|file| file == path));
        let affected: Vec<(Place, Order)> =
            affected.map(|(place, used)| (*place, used.order.clone())).collect();
        for (place, order) in affected {
            self.picture(place, order);
        }
    }

    /// Loads a renderer and makes an instance.
    fn start(&mut self, place: Place, order: &Order) -> anyhow::Result<InUse> {
        let name = order.renderer.clone();
        let reference = self.registry.find(UnitKind::Renderer, &name)?;
        anyhow::ensure!(
            !self.avoided.contains(&name),
            "{reference} was at work when the program crashed; the plugin list switches it on"
        );
        self.conduct.check(&reference)?;
        self.teller.tell(News::Preparing { place, renderer: name.clone() });
        // Without the mark a crash is not noticed, which is no reason not to draw.
        let mark = self.marks.as_ref().and_then(|marks| marks.leave(&reference).ok());
        let unit = match reference.load(&self.plugins.patience()) {
            Ok(unit) => unit,
            Err(error) => {
                if let Some(fault) = error.fault() {
                    self.failed(&reference, Contents::of_file(&reference.path), fault);
                }
                return Err(error.into());
            }
        };
        let host = self.studio.engine.gpu().host_info();
        let hosted = match unit.start(&host, &self.plugins.patience()) {
            Ok(hosted) => hosted,
            Err(fault) => {
                self.failed(&reference, unit.contents, &fault);
                return Err(anyhow!("{reference} could not start: {fault}"));
            }
        };
        let parameters = unit.description.params.clone();
        self.teller.tell(News::Declared { renderer: name.clone(), parameters });
        let view = RendererView::new(hosted, unit.scope());
        Ok(InUse { name, reference, unit, view, mark, order: order.clone() })
    }

    /// Renders until the picture does not change any more.
    /// Still pictures are explained.
    fn render(
        &mut self,
        view: &mut RendererView,
        order: &Order,
    ) -> Result<(Settled, Option<Explanation>), RenderError> {
        // What is timed is what was asked for.
        self.studio.engine.compile_beside(!order.is_measured);
        if order.is_measured {
            // A view may have drawn the same surfels, and what is timed pays for its own.
            self.studio.engine.forget_surfaces();
        }
        let surroundings = self.surroundings(order);
        let request = RenderRequest {
            clouds: &order.clouds.views(),
            facts: &order.clouds.facts,
            scene: &order.scene,
            view: order.detail.view(order.view),
            values: &order.values,
            // What lies under the pointer is only asked for of still pictures.
            outputs: match order.detail.is_full() && !order.is_measured {
                true => &OUTPUTS,
                false => &OUTPUTS[..1],
            },
            frame_index: 0,
            environment: surroundings.as_ref().map(Surroundings::view),
            stride: order.detail.stride,
            detail_px: 0.0,
        };
        let settled = self.studio.settle_view(view, &request)?;
        let is_still = order.detail.is_full() && !order.is_measured;
        let explained =
            is_still.then(|| self.studio.engine.explain(view, &request, &settled.rendered));
        Ok((settled, explained))
    }

    /// The light around the scene; none where its probe cannot be read, which is told once.
    fn surroundings(&mut self, order: &Order) -> Option<Surroundings> {
        let (probes, teller) = (&mut self.probes, &self.teller);
        probes.light_or_none(order.environment.as_ref()?, |line| teller.tell(News::Message(line)))
    }

    fn failed(&mut self, unit: &UnitRef, contents: Contents, fault: &Fault) {
        self.conduct.failed(unit, contents, fault);
        self.tell_conduct();
    }

    fn tell_conduct(&self) {
        let of = |record: &plugins::Record| UnitConduct {
            renderer: record.unit.id.clone(),
            text: record.to_string(),
            off: record.standing == Standing::Off,
        };
        let mut all: Vec<UnitConduct> = self.conduct.records().iter().map(of).collect();
        all.extend(self.avoided.iter().map(|renderer| UnitConduct {
            renderer: renderer.clone(),
            text: "not used, since it was at work when the program crashed".to_owned(),
            off: true,
        }));
        self.teller.tell(News::Conduct(all));
    }

    /// Opens the device again after it was lost; clouds and shaders follow with the next picture.
    fn open_again(&mut self) -> anyhow::Result<()> {
        self.studio = open(&self.device, &self.plugins)
            .context("the graphics device was lost and cannot be opened again")?;
        // What is on its way was made for the other one.
        self.arriving.let_go();
        self.teller.tell(News::Arriving(None));
        self.teller.tell(News::Message("the graphics device was lost and opened again".to_owned()));
        self.tell_device();
        Ok(())
    }
}

/// What a failed frame says of the plugin. A lost device is answered as a hang is: the next frame
/// of the same renderer would probably lose it again.
fn fault_of(error: &RenderError) -> Fault {
    match error {
        RenderError::Plugin(fault) => fault.clone(),
        RenderError::DeviceLost(_) => Fault::TimedOut(std::time::Duration::ZERO),
        RenderError::Graph(_) | RenderError::Pass { .. } | RenderError::NoOutput { .. } => {
            Fault::Error(error.to_string())
        }
        // Neither the cloud nor the host's own shaders are the plugin's doing.
        _ => Fault::NotAsked(error.to_string()),
    }
}

fn shot(
    settled: &Settled,
    explained: Option<Explanation>,
    order: &Order,
    started: Instant,
) -> anyhow::Result<Shot> {
    let rendered = &settled.rendered;
    let image = |output: &Output| {
        let found = rendered.image(output).cloned();
        found.ok_or_else(|| anyhow!("the renderer gave no output `{}`", output.name()))
    };
    let color = image(&Output::Color)?;
    Ok(Shot {
        size: [color.width, color.height],
        levels: match order.is_measured {
            true => Vec::new(),
            false => pictures::levels(&color, &order.development),
        },
        color,
        depth: rendered.image(&Output::Depth).cloned(),
        view: order.detail.view(order.view),
        passes: rendered.passes.clone(),
        milliseconds: started.elapsed().as_secs_f64() * 1e3,
        frame_ms: settled.milliseconds,
        detail: order.detail,
        explained: explained.map(Arc::new),
        one_of: 1,
    })
}
