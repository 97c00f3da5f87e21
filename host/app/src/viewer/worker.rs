//! The thread that makes pictures: it owns the engine's device and everything on it, and the
//! renderers in use.
//!
//! Nothing a plugin does ends it: each has a thread of its own and a deadline, one that fails three
//! times in a row or does not answer is switched off, a rebuilt one takes over only after its first
//! picture, and a lost device is opened again.

mod making;
mod rebuilt;
mod refining;
mod tidying;

use super::arriving::{Arrived, Arriving};
use super::darkroom::{News, Order, Place, Print, Queue, Task, Teller, UnitConduct};
use super::export;
use crate::arguments::{DeviceArguments, PluginFiles};
use crate::studio::{self, Studio};
use crate::surroundings::Probes;
use anyhow::Context as _;
use refining::Refining;
use std::collections::{HashMap, HashSet, VecDeque};
use std::path::{Path, PathBuf};
use std::time::Instant;
use surfelshop_api::UnitKind;
use surfelshop_api::abi::host_side::Fault;
use surfelshop_api::params::{ParamKind, Value};
use surfelshop_engine::plugins::{
    self, Conduct, Contents, LoadedUnit, Mark, Marks, Origin, Registry, Standing, UnitRef, Watcher,
};
use surfelshop_engine::{RenderError, RendererView};

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
    /// Pictures that get better, the next one first.
    refining: VecDeque<Refining>,
    /// When something that moves was drawn last.
    moved: Option<Instant>,
    /// Frames drawn.
    n_drawn: u64,
    /// When something was drawn or let go last, unless all has been tidied up since.
    drawn: Option<Instant>,
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
                    refining: VecDeque::new(),
                    moved: None,
                    n_drawn: 0,
                    drawn: None,
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
        while let Some(task) = queue.next(self.refines_from(), self.tidies_from()) {
            match task {
                Task::Picture(place, order) => self.picture(place, *order),
                Task::Refine => self.refine(),
                Task::TidyUp => self.tidy_up(),
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
                Task::Rest(place) => self.leave_unrefined(place),
                Task::LetGo(place) => {
                    self.in_use.remove(&place);
                    self.drawn = Some(Instant::now());
                    self.unfinished.remove(&place);
                    self.leave_unrefined(place);
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
        self.leave_unrefined(place);
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
            None => {
                self.unfinished.remove(&place);
                if let Ok(shot) = &outcome {
                    self.refine_on(place, &order, shot);
                }
            }
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
        self.refine_anew();
        self.teller.tell(News::Arriving(None));
        self.teller.tell(News::Message("the graphics device was lost and opened again".to_owned()));
        self.tell_device();
        Ok(())
    }
}
