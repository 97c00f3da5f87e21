//! The window's state and what happens in each of its frames.

use super::arrangement;
use super::darkroom::{Darkroom, News, Place, Print, UnitConduct};
use super::export::{self, Export, ExportWindow};
use super::loading::{Loading, Read};
use super::memory::Memory;
use super::messages::Messages;
use super::pane::{Pane, Side, Wanted};
use super::settings::Settings;
use super::{menus, panels, scene_file};
use crate::arguments::{LensArguments, UpAxis, ViewerArguments};
use crate::camera::{self, CameraSpec, Extent};
use crate::clouds::Clouds;
use crate::demo;
use crate::settings;
use crate::studio;
use eframe::egui::util::undoer::{self, Undoer};
use eframe::egui::{self, Context, Ui};
use egui_tiles::Tree;
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};
use surfelshop_api::params::ParamDecl;
use surfelshop_api::{Camera, UnitKind};
use surfelshop_cloud::scene::{SceneCloud, SceneFile};
use surfelshop_engine::Counters;
use surfelshop_engine::plugins::{Crash, Marks, Registry};

/// The clouds on show.
pub(crate) struct Shown {
    pub(crate) clouds: Arc<Clouds>,
    pub(crate) extent: Extent,
    /// Counts the loads.
    pub(crate) load: u64,
}

/// Everything the window knows.
pub(crate) struct Window {
    pub(crate) darkroom: Darkroom,
    pub(crate) settings: Settings,
    pub(crate) history: Undoer<Settings>,
    /// The camera that linked panes share.
    pub(crate) camera: Camera,
    /// Cameras of panes that are not linked.
    pub(crate) own_cameras: HashMap<u32, Camera>,
    pub(crate) shown: Option<Shown>,
    pub(crate) loading: Option<Loading>,
    /// Files that were opened and are clouds.
    pub(crate) files: Vec<PathBuf>,
    /// The scene that was opened or saved last, with all its keys.
    pub(crate) scene_file: Option<SceneFile>,
    pub(crate) scene_path: Option<PathBuf>,
    /// Where to remember things, if anywhere.
    pub(crate) memory: Option<Memory>,
    pub(crate) recent: Vec<PathBuf>,
    /// What was kept last, and when.
    kept: Option<(SceneFile, Instant)>,
    pub(crate) panes: BTreeMap<u32, Pane>,
    pub(crate) tree: Tree<u32>,
    pub(crate) focused: u32,
    /// Parameters by renderer, once it was loaded.
    pub(crate) declared: HashMap<String, Vec<ParamDecl>>,
    pub(crate) registry: Registry,
    pub(crate) adapter: String,
    /// Whether there will be no device; the reason is the message.
    pub(crate) no_device: bool,
    pub(crate) counters: Counters,
    /// Renderers that failed.
    pub(crate) conduct: Vec<UnitConduct>,
    /// A plugin that was at work when the program crashed, until the user decides about it.
    pub(crate) crash: Option<Crash>,
    /// Draw less while something moves.
    pub(crate) adaptive: bool,
    /// The axis that points upwards in the cloud.
    pub(crate) up: UpAxis,
    /// What there is to say.
    pub(crate) messages: Messages,
    /// The name typed for a preset.
    pub(crate) preset: String,
    /// A file dialog that is open.
    pub(crate) dialog: Option<(menus::Asked, Receiver<Option<Vec<PathBuf>>>)>,
    pub(crate) open_windows: menus::OpenWindows,
    pub(crate) export_window: ExportWindow,
    pub(crate) export: Option<Export>,
    /// The pane and depth that the wheel zooms to while pictures have no depth.
    pub(crate) anchor_depth: Option<(u32, f64)>,
    /// When the last frame began, and whether the window draws on the CPU.
    last_frame: Instant,
    software: bool,
    /// The point under the pointer that `under_pointer` describes.
    pub(crate) looked_at: Option<DVec3>,
    /// What lies under the pointer, in one line.
    pub(crate) under_pointer: String,
    serial: u64,
}

impl Window {
    pub(crate) fn new(ctx: &Context, arguments: &ViewerArguments) -> anyhow::Result<Self> {
        let registry = studio::registry(&arguments.plugins.plugin)?;
        let wake = ctx.clone();
        let darkroom =
            Darkroom::open(arguments.device.clone(), arguments.plugins.clone(), move || {
                wake.request_repaint()
            })?;
        let settings = Settings::default();
        let memory = Memory::of_user();
        if let Some(memory) = &memory {
            memory.begin_session();
        }
        let mut window = Self {
            darkroom,
            history: history(),
            settings,
            camera: frame(&Extent::new(DVec3::ZERO, 1.0), arguments.up).camera,
            own_cameras: HashMap::new(),
            shown: None,
            loading: None,
            files: Vec::new(),
            scene_file: None,
            scene_path: None,
            recent: memory.as_ref().map(Memory::recent).unwrap_or_default(),
            memory,
            kept: None,
            panes: BTreeMap::from([(0, Pane::new())]),
            tree: arrangement::usual(&[0]),
            focused: 0,
            declared: HashMap::new(),
            registry,
            adapter: String::new(),
            no_device: false,
            counters: Counters::default(),
            conduct: Vec::new(),
            crash: Marks::of_user().and_then(|marks| marks.crashed_last_time()),
            adaptive: true,
            up: arguments.up,
            messages: Messages::default(),
            dialog: None,
            preset: String::new(),
            open_windows: menus::OpenWindows::default(),
            export_window: ExportWindow::default(),
            export: None,
            anchor_depth: None,
            last_frame: Instant::now(),
            software: false,
            looked_at: None,
            under_pointer: String::new(),
            serial: 0,
        };
        window.open(ctx, arguments.files.clone());
        Ok(window)
    }

    /// Begins to read files, which replace what is shown; the sample where there are none.
    pub(crate) fn open(&mut self, ctx: &Context, files: Vec<PathBuf>) {
        // An installed program may have no sample beside it; then there is nothing to show yet.
        let sample = || demo::find_sample().into_iter().collect();
        let files = if files.is_empty() { sample() } else { files };
        if files.is_empty() {
            return;
        }
        let wake = ctx.clone();
        match Loading::start(files, move || wake.request_repaint()) {
            Ok(loading) => self.loading = Some(loading),
            Err(error) => self.messages.warn(format!("nothing can be read: {error}")),
        }
    }

    /// A number no order has had.
    pub(crate) fn next_serial(&mut self) -> u64 {
        self.serial += 1;
        self.serial
    }

    /// Names of the renderers, as `settings` uses them.
    pub(crate) fn renderers(&self) -> Vec<String> {
        let mut names: Vec<String> =
            self.registry.units(UnitKind::Renderer).map(|(_, _, unit)| unit.id.clone()).collect();
        names.sort();
        names.dedup();
        names
    }

    /// The camera of a pane.
    pub(crate) fn camera_of(&self, pane: u32) -> Camera {
        let own = self.settings.pane(pane).filter(|pane| !pane.linked);
        own.and_then(|pane| self.own_cameras.get(&pane.id)).copied().unwrap_or(self.camera)
    }

    /// Gives panes that were let go a camera of their own, where the shared one stands.
    fn let_go(&mut self) {
        for pane in self.settings.panes.iter().filter(|pane| !pane.linked) {
            self.own_cameras.entry(pane.id).or_insert(self.camera);
        }
    }

    /// Moves the camera of a pane, and of those linked with it.
    pub(crate) fn set_camera(&mut self, pane: u32, camera: Camera) {
        if self.settings.pane(pane).is_some_and(|pane| !pane.linked) {
            self.own_cameras.insert(pane, camera);
        } else {
            self.camera = camera;
        }
    }

    /// Puts the camera of the focused pane where it sees everything.
    pub(crate) fn frame_all(&mut self) {
        if let Some(shown) = &self.shown {
            let mut camera = frame(&shown.extent, self.up).camera;
            camera.projection = match self.camera_of(self.focused).projection {
                kept @ surfelshop_api::Projection::Perspective { .. } => kept,
                surfelshop_api::Projection::Orthographic { .. } => {
                    let mut parallel = camera;
                    super::navigation::toggle_projection(&mut parallel, 0.6);
                    parallel.projection
                }
            };
            self.set_camera(self.focused, camera);
        }
    }

    fn take_news(&mut self, ctx: &Context) {
        for news in self.darkroom.news() {
            match news {
                News::Open { adapter, software } => {
                    self.adapter = adapter;
                    self.software = software;
                }
                // The first reason is the one: the thread ends after it.
                News::NoDevice(_) if self.no_device => {}
                News::NoDevice(reason) => {
                    self.no_device = true;
                    self.messages.warn(reason);
                }
                News::Declared { renderer, parameters } => {
                    let known = self.declared.insert(renderer.clone(), parameters);
                    if known != self.declared.get(&renderer).cloned() {
                        self.fit_values(&renderer);
                    }
                }
                News::Preparing { place, renderer } => {
                    if let Some(pane) = self.panes.get_mut(&place.pane) {
                        pane.sides[place.side].preparing = Some(renderer);
                    }
                }
                News::Print(print) => self.take_print(ctx, *print),
                News::Counters(counters) => self.counters = counters,
                News::Plugins(registry) => self.registry = registry,
                News::Reloaded { renderer, values, report } => {
                    self.messages.tell(report);
                    for pane in &mut self.settings.panes {
                        if pane.values.contains_key(&renderer) {
                            pane.values.insert(renderer.clone(), values.clone());
                        }
                    }
                }
                News::Conduct(conduct) => self.conduct = conduct,
                News::Message(line) => self.messages.warn(line),
            }
        }
    }

    /// Brings the values of a renderer to what it declares, and says which were meant otherwise.
    fn fit_values(&mut self, renderer: &str) {
        let Some(declared) = self.declared.get(renderer) else { return };
        for values in self.settings.panes.iter_mut().filter_map(|p| p.values.get_mut(renderer)) {
            for line in settings::fit(renderer, declared, values) {
                self.messages.warn(line);
            }
        }
    }

    /// Shows a picture. A renderer that failed gives way to the one whose picture is shown.
    fn take_print(&mut self, ctx: &Context, print: Print) {
        let Print { place, serial, renderer, outcome } = print;
        if place == export::PLACE {
            export::take(self, serial, outcome);
            return;
        }
        let Some(pane) = self.panes.get_mut(&place.pane) else { return };
        if let Ok(shot) = &outcome {
            let detail = shot.detail.describe();
            let passes: Vec<String> = (shot.passes.iter())
                .filter_map(|pass| Some(format!("{} {:.1}", pass.name, pass.gpu_ms?)))
                .collect();
            let (ms, passes) = (shot.milliseconds, passes.join(", "));
            tracing::debug!(pane = place.pane, renderer, ms, detail, passes, "picture");
        }
        let failed = outcome.as_ref().err().cloned();
        let side = &mut pane.sides[place.side];
        side.take(ctx, place, renderer.clone(), serial, outcome);
        let Some(reason) = failed else { return };
        let before = side.shown.as_ref().map(|shown| shown.renderer.clone());
        self.messages.warn(format!("{renderer}: {reason}"));
        if let Some(before) = before
            && before != renderer
            && let Some(pane) = self.settings.pane_mut(place.pane)
            && pane.renderers[place.side] == renderer
        {
            pane.renderers[place.side] = before;
        }
    }

    fn take_clouds(&mut self) {
        let Some(result) = self.loading.as_ref().and_then(Loading::finished) else { return };
        let files = self.loading.take().map(|loading| loading.files.clone()).unwrap_or_default();
        let Read { clouds, scene } = match result {
            Ok(read) => read,
            Err(reason) => {
                self.messages.warn(reason);
                return;
            }
        };
        let extent = clouds.extent(self.settings.scene.surface.radius_scale);
        let load = self.shown.as_ref().map_or(0, |shown| shown.load) + 1;
        self.shown = Some(Shown { clouds: Arc::new(clouds), extent, load });
        self.messages.dismiss_all();
        self.looked_at = None;
        self.own_cameras.clear();
        self.camera = frame(&extent, self.up).camera;
        if let Some(memory) = &self.memory {
            // A list that cannot be kept is no reason not to show what was opened.
            drop(memory.opened(&files));
            self.recent = memory.recent();
        }
        let is_cloud = |file: &PathBuf| !surfelshop_cloud::scene::is_scene(file);
        self.files = files.into_iter().filter(is_cloud).collect();
        self.scene_file = None;
        self.scene_path = None;
        if let Some(opened) = scene {
            let warnings: Vec<String> = opened.warnings.iter().map(ToString::to_string).collect();
            warnings.into_iter().for_each(|line| self.messages.warn(line));
            scene_file::apply(self, &opened.scene);
            let known: Vec<String> = self.declared.keys().cloned().collect();
            known.iter().for_each(|renderer| self.fit_values(renderer));
            let mut file = opened.scene;
            file.clouds.extend(self.files.iter().map(|file| {
                let path = std::path::absolute(file).unwrap_or_else(|_| file.clone());
                SceneCloud::new(path).into()
            }));
            self.scene_file = Some(file);
            // The last session is the program's own file; saving asks where to.
            let kept = self.memory.as_ref().map(Memory::last_scene_path);
            self.scene_path = Some(opened.path).filter(|path| Some(path) != kept.as_ref());
        }
        self.history = history();
    }

    /// Keeps what is shown for the next start, at most now and then.
    fn keep(&mut self, at_once: bool) {
        let recently = self.kept.as_ref().is_some_and(|(_, when)| when.elapsed() < BETWEEN_KEEPING);
        let Some(memory) = &self.memory else { return };
        if self.shown.is_none() || (recently && !at_once) {
            return;
        }
        let scene = scene_file::of(self, &memory.last_scene_path());
        if self.kept.as_ref().is_none_or(|(kept, _)| *kept != scene)
            && let Err(error) = memory.keep(&scene)
        {
            tracing::debug!("the scene was not kept: {error:#}");
        }
        self.kept = Some((scene, Instant::now()));
    }

    /// Writes what is shown to a scene file.
    pub(crate) fn save_scene(&mut self, path: &std::path::Path) {
        let file = scene_file::of(self, path);
        match file.write(path) {
            Ok(()) => {
                self.messages.tell(format!("wrote {}", path.display()));
                self.scene_file = Some(file);
                self.scene_path = Some(path.to_owned());
            }
            Err(error) => self.messages.warn(error.to_string()),
        }
    }

    /// Orders the pictures that are missing.
    fn place_orders(&mut self, ctx: &Context) {
        let Some(shown) = &self.shown else { return };
        // Until the user has decided, no plugin's code runs.
        if self.no_device || self.crash.is_some() {
            return;
        }
        for settings in &self.settings.panes {
            let camera = self.camera_of(settings.id);
            let Some(pane) = self.panes.get_mut(&settings.id) else { continue };
            if pane.size_px[0] == 0 || pane.size_px[1] == 0 {
                continue;
            }
            for side in 0..settings.mode.sides() {
                let wanted = Wanted {
                    renderer: settings.renderers[side].clone(),
                    values: settings.values_of(side),
                    scene: self.settings.scene.clone(),
                    development: self.settings.development(),
                    view: camera::framed_view(camera, &shown.extent, pane.size_px),
                    load: shown.load,
                };
                let side_state = &mut pane.sides[side];
                let (order, again) =
                    side_state.next_order(&wanted, &shown.clouds, self.adaptive, &mut self.serial);
                if let Some(order) = order {
                    self.darkroom.order(Place { pane: settings.id, side }, order);
                }
                if let Some(again) = again {
                    ctx.request_repaint_after(again);
                }
            }
        }
    }

    fn take_dropped_files(&mut self, ctx: &Context) {
        let dropped: Vec<PathBuf> = ctx.input(|input| {
            input.raw.dropped_files.iter().map(|file| file.path().to_owned()).collect()
        });
        if !dropped.is_empty() {
            self.open(ctx, dropped);
        }
    }
}

impl Window {
    /// Lets the engine have the processor: where both draw on the CPU, a frame of the window for
    /// every move of the mouse would leave little for the picture it waits for.
    fn pace(&mut self) {
        let busy = self.panes.values().flat_map(|pane| &pane.sides).any(Side::waits);
        if self.software && busy {
            std::thread::sleep(BETWEEN_FRAMES.saturating_sub(self.last_frame.elapsed()));
        }
        self.last_frame = Instant::now();
    }

    /// One frame of the window.
    pub(crate) fn frame(&mut self, ui: &mut Ui) {
        let ctx = ui.ctx().clone();
        self.pace();
        self.take_news(&ctx);
        self.take_clouds();
        export::go_on(self);
        self.take_dropped_files(&ctx);
        menus::take_dialog(self, &ctx);
        menus::take_keys(self, &ctx);
        egui::Panel::top("menu").show(ui, |ui| menus::show(self, ui));
        egui::Panel::bottom("status").show(ui, |ui| panels::status(self, ui));
        egui::Panel::left("panels")
            .default_size(300.0)
            .size_range(220.0..=520.0)
            .show(ui, |ui| panels::side(self, ui));
        let pictures = egui::CentralPanel::no_frame().show(ui, |ui| super::canvas::show(self, ui));
        self.messages.show(&ctx, pictures.response.rect);
        menus::show_windows(self, &ctx);
        self.let_go();
        self.place_orders(&ctx);
        if !ctx.egui_is_using_pointer() && !ctx.input(|input| input.pointer.any_down()) {
            let now = ctx.input(|input| input.time);
            self.history.feed_state(now, &self.settings);
            self.keep(false);
        }
    }
}

impl eframe::App for Window {
    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        self.frame(ui);
    }

    fn on_exit(&mut self) {
        self.keep(true);
    }
}

/// Time between two frames of the window while it waits for a picture, on software drivers.
const BETWEEN_FRAMES: Duration = Duration::from_millis(20);

/// Time between two saves of the scene for the next start.
const BETWEEN_KEEPING: Duration = Duration::from_secs(10);

/// The view that frames a cloud.
fn frame(extent: &Extent, up: UpAxis) -> surfelshop_api::View {
    let camera = CameraSpec::three_quarter();
    let lens = LensArguments { camera, up, fov: None, orthographic: false, zoom: 1.0 };
    camera::view(&lens, extent, [4, 3])
}

/// A history that begins with what it is fed next. A drag is one step: nothing is fed meanwhile.
fn history() -> Undoer<Settings> {
    Undoer::with_settings(undoer::Settings {
        max_undos: 200,
        stable_time: 0.0,
        ..Default::default()
    })
}
