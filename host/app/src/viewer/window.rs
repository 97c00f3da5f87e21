//! The window's state and what happens in each of its frames.

use super::arrangement;
use super::darkroom::{Darkroom, Place, Task, UnitConduct};
use super::dialogs::Dialogs;
use super::export::{self, Export, ExportWindow};
use super::history::{History, State};
use super::leaving::{self, Leaving};
use super::loading::Loading;
use super::measure::{self, Measure};
use super::memory::Memory;
use super::messages::Messages;
use super::pane::{Pane, Side, Wanted};
use super::recovery::{self, End, Recovery};
use super::saving::Saving;
use super::settings::Settings;
use super::stock::Stock;
use super::tools::Tools;
use super::{dialogs, menus, panels};
use crate::arguments::{LensArguments, UpAxis, ViewerArguments};
use crate::camera::{self, CameraSpec, Extent};
use crate::clouds::Clouds;
use crate::studio;
use eframe::egui::{self, Context, Ui};
use egui_tiles::Tree;
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use surfelshop_api::params::ParamDecl;
use surfelshop_api::{Camera, UnitKind};
use surfelshop_cloud::scene::{Keyed, SceneFile, SceneView};
use surfelshop_engine::Counters;
use surfelshop_engine::plugins::{Contents, Crash, Mark, Marks, Registry};

/// The clouds on show.
pub(crate) struct Shown {
    /// All that are open; those on show are [`Shown::clouds`].
    pub(crate) stock: Stock,
    pub(crate) clouds: Arc<Clouds>,
    pub(crate) extent: Extent,
    /// The factor on radii that the extent was measured with.
    pub(crate) radius_scale: f32,
    /// Counts the loads and edits.
    pub(crate) load: u64,
}

impl Shown {
    pub(crate) fn new(stock: Stock, radius_scale: f32, load: u64) -> Self {
        let clouds = stock.clouds.clone();
        let extent = clouds.extent(radius_scale);
        Self { stock, clouds, extent, radius_scale, load }
    }
}

/// Everything the window knows.
pub(crate) struct Window {
    pub(crate) darkroom: Darkroom,
    pub(crate) settings: Settings,
    pub(crate) history: History,
    pub(crate) tools: Tools,
    pub(crate) measure: Measure,
    /// A cloud that is being written.
    pub(crate) saving: Option<Saving>,
    /// Counts the openings of files.
    pub(crate) n_opened: u64,
    /// The camera that linked panes share.
    pub(crate) camera: Camera,
    /// Cameras of panes that are not linked.
    pub(crate) own_cameras: HashMap<u32, Camera>,
    pub(crate) shown: Option<Shown>,
    pub(crate) loading: Option<Loading>,
    /// How far large clouds are on their way to where they are drawn, in [0, 1].
    pub(crate) arriving: Option<f32>,
    /// Files that were opened and are clouds.
    pub(crate) files: Vec<PathBuf>,
    /// The scene that was opened or saved last, with all its keys.
    pub(crate) scene_file: Option<SceneFile>,
    pub(crate) scene_path: Option<PathBuf>,
    /// Views of the scene beyond those that fit into the window.
    pub(crate) hidden_views: Vec<Keyed<SceneView>>,
    /// Where to remember things, if anywhere.
    pub(crate) memory: Option<Memory>,
    pub(crate) recent: Vec<PathBuf>,
    /// What was kept last, and when.
    pub(crate) kept: Option<(SceneFile, Instant)>,
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
    /// Keeps the question for the next start, should this program be killed first.
    pub(crate) crash_mark: Option<Mark>,
    /// Draw less while something moves.
    pub(crate) adaptive: bool,
    /// The axis that points upwards in the cloud.
    pub(crate) up: UpAxis,
    /// Plugins from new places about which the user has not decided when asked.
    pub(crate) undecided: BTreeSet<Contents>,
    /// The list of trusted plugins, instead of the user's own.
    pub(crate) trust_file: Option<PathBuf>,
    /// What there is to say.
    pub(crate) messages: Messages,
    /// The name typed for a preset.
    pub(crate) preset: String,
    pub(crate) dialogs: Dialogs,
    /// Edits on disk, and those that another window left.
    pub(crate) recovery: Option<Recovery>,
    /// A question before edits are lost.
    pub(crate) leaving: Option<Leaving>,
    /// Whether the window closes, and whether what is being read takes the place of edits: the user said
    /// so, or there is nothing to lose.
    pub(crate) closes: bool,
    pub(crate) replaces: bool,
    pub(crate) open_windows: menus::OpenWindows,
    pub(crate) export_window: ExportWindow,
    pub(crate) export: Option<Export>,
    /// The pane and depth that the wheel zooms to while pictures have no depth.
    pub(crate) anchor_depth: Option<(u32, f64)>,
    /// When the last frame began, and whether the window draws on the CPU.
    last_frame: Instant,
    pub(crate) software: bool,
    /// The point under the pointer that `under_pointer` describes.
    pub(crate) looked_at: Option<DVec3>,
    /// What lies under the pointer, in one line.
    pub(crate) under_pointer: String,
    serial: u64,
}

impl Window {
    pub(crate) fn new(ctx: &Context, arguments: &ViewerArguments) -> anyhow::Result<Self> {
        let registry = studio::registry(&arguments.plugins)?;
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
        let crash = Marks::of_user().and_then(|marks| marks.crashed_last_time());
        let mut window = Self {
            darkroom,
            history: History::default(),
            tools: Tools::new(&arguments.device, &arguments.plugins),
            measure: Measure::new(&arguments.plugins),
            saving: None,
            n_opened: 0,
            settings,
            camera: frame(&Extent::new(DVec3::ZERO, 1.0), arguments.up).camera,
            own_cameras: HashMap::new(),
            shown: None,
            loading: None,
            arriving: None,
            files: Vec::new(),
            scene_file: None,
            scene_path: None,
            hidden_views: Vec::new(),
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
            crash_mark: crash.as_ref().and_then(|crash| Marks::of_user()?.keep(crash).ok()),
            crash,
            adaptive: true,
            up: arguments.up,
            undecided: BTreeSet::new(),
            trust_file: arguments.plugins.trust_file.clone(),
            messages: Messages::default(),
            dialogs: Dialogs::default(),
            recovery: Recovery::of_user(),
            leaving: None,
            closes: false,
            replaces: false,
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
            if settings.mode.sides() < 2 {
                pane.let_comparison_go();
            }
            let (shown_sides, hidden) = pane.sides.split_at_mut(settings.mode.sides());
            if let [side] = hidden {
                let place = Place { pane: settings.id, side: 1 };
                if side.is_to_rest() {
                    self.darkroom.add(Task::Rest(place));
                }
                if side.let_larger_go(pane.size_px) {
                    self.darkroom.let_go(place);
                }
            }
            for (side, side_state) in shown_sides.iter_mut().enumerate() {
                let wanted = Wanted {
                    renderer: settings.renderers[side].clone(),
                    values: settings.values_of(side),
                    scene: self.settings.scene.clone(),
                    environment: self.settings.environment.clone(),
                    development: self.settings.development(),
                    view: camera::framed_view(camera, &shown.extent, pane.size_px),
                    load: shown.load,
                };
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
}

impl Window {
    /// Lets the engine have the processor: where both draw on the CPU, a frame of the window for
    /// every move of the mouse would leave little for the picture it waits for.
    fn pace(&mut self) {
        if self.software && self.works() {
            std::thread::sleep(BETWEEN_FRAMES.saturating_sub(self.last_frame.elapsed()));
        }
        self.last_frame = Instant::now();
    }

    /// Whether a picture on show is on its way or still gets better.
    pub(crate) fn works(&self) -> bool {
        self.settings.panes.iter().any(|settings| {
            let sides = self.panes.get(&settings.id).map(|pane| &pane.sides);
            sides.is_some_and(|sides| sides[..settings.mode.sides()].iter().any(Side::works))
        })
    }

    /// What undo covers.
    pub(crate) fn state(&self) -> State {
        let stock = self.shown.as_ref().map(|shown| shown.stock.clone());
        State { settings: self.settings.clone(), stock }
    }

    /// Shows other clouds, or the same ones otherwise; the camera stays.
    pub(crate) fn restock(&mut self, stock: Stock) {
        let Some(shown) = &self.shown else { return };
        if shown.stock == stock {
            return;
        }
        self.shown = Some(Shown::new(stock, shown.radius_scale, shown.load + 1));
        self.looked_at = None;
    }

    /// Takes what the tool at work has done.
    fn take_edits(&mut self, ctx: &Context) {
        let stock = self.shown.as_ref().map(|shown| &shown.stock);
        if let Some(edited) = self.tools.go_on(ctx, stock, &mut self.messages) {
            // What was changed before the edit is a step of its own.
            self.history.feed(&self.state());
            self.restock(edited);
        }
    }

    /// Measures the clouds again where the factor on radii changed.
    fn measure_clouds(&mut self) {
        let scale = self.settings.scene.surface.radius_scale;
        if let Some(shown) = &mut self.shown
            && shown.radius_scale != scale
        {
            (shown.extent, shown.radius_scale) = (shown.clouds.extent(scale), scale);
        }
    }

    /// One frame of the window.
    pub(crate) fn frame(&mut self, ui: &mut Ui) {
        let ctx = ui.ctx().clone();
        self.check_close(&ctx);
        self.pace();
        self.measure_clouds();
        self.take_news(&ctx);
        self.take_clouds();
        self.take_saved();
        self.take_edits(&ctx);
        export::go_on(self);
        measure::go_on(self, &ctx);
        self.take_dropped_files(&ctx);
        dialogs::take_dialog(self, &ctx);
        menus::take_keys(self, &ctx);
        egui::Panel::top("menu").show(ui, |ui| menus::show(self, ui));
        egui::Panel::bottom("status").show(ui, |ui| panels::status(self, ui));
        egui::Panel::left("panels")
            .default_size(300.0)
            .size_range(220.0..=520.0)
            .show(ui, |ui| panels::side(self, ui));
        if self.measure.form.open {
            egui::Panel::right("measure")
                .default_size(400.0)
                .size_range(300.0..=720.0)
                .show(ui, |ui| measure::panel::show(self, ui));
        }
        let pictures = egui::CentralPanel::no_frame().show(ui, |ui| super::canvas::show(self, ui));
        self.messages.show(&ctx, pictures.response.rect);
        menus::show_windows(self, &ctx);
        self.let_go();
        recovery::keep(self, &ctx);
        self.place_orders(&ctx);
        if !ctx.egui_is_using_pointer() && !ctx.input(|input| input.pointer.any_down()) {
            self.history.feed(&self.state());
            self.keep(&ctx, false);
        }
    }
}

impl eframe::App for Window {
    fn logic(&mut self, ctx: &Context, _frame: &mut eframe::Frame) {
        self.check_close(ctx);
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        self.frame(ui);
    }

    fn on_exit(&mut self) {
        self.keep(&Context::default(), true);
        // The user decided about the edits, unless nobody was asked.
        let end = match self.closes && !leaving::ends() {
            true => End::Remove,
            false => End::Keep,
        };
        recovery::end(self, end);
    }
}

/// Time between two frames of the window while it waits for a picture, on software drivers.
const BETWEEN_FRAMES: Duration = Duration::from_millis(20);

/// The view that frames a cloud.
pub(crate) fn frame(extent: &Extent, up: UpAxis) -> surfelshop_api::View {
    let camera = CameraSpec::three_quarter();
    let lens = LensArguments { camera, up, fov: None, orthographic: false, zoom: 1.0 };
    camera::view(&lens, extent, [4, 3])
}
