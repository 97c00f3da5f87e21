//! The state of the window, in parts by job.

use crate::arguments::ViewerArguments;
use crate::commands::Keymap;
use crate::document::{Document, OpenClouds, Settings, Snapshot};
use crate::measure::Measure;
use crate::panels::Panels;
use crate::plugins::Plugins;
use crate::preferences::{PreferenceFile, Preferences};
use crate::render_thread::RenderThread;
use crate::theme;
use crate::views::messages::Messages;
use crate::views::pane::Side;
use crate::views::{Render, Views, camera_in, initial_camera, navigation};
use eframe::egui::Context;
use std::path::{Path, PathBuf};
use surfelshop_api::{Camera, Projection, UnitKind};
use surfelshop_cloud::display::Legend;
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::inside;
use surfelshop_session::options::camera::{CameraSpec, Extent};
use surfelshop_session::options::{UpAxis, lights};
use surfelshop_session::{parameters, session};

/// The whole state of the window.
pub(crate) struct Window {
    // Dropped first: its thread uses the device.
    pub(crate) render: Render,
    pub(crate) plugins: Plugins,
    pub(crate) measure: Measure,
    pub(crate) settings: Settings,
    pub(crate) document: Document,
    pub(crate) views: Views,
    pub(crate) panels: Panels,
    pub(crate) messages: Messages,
    /// What the user chose for the window itself, its file, and the shortcuts that follow from it.
    pub(crate) preferences: Preferences,
    pub(crate) preference_file: PreferenceFile,
    pub(crate) keymap: Keymap,
}

impl Window {
    pub(crate) fn new(ctx: &Context, arguments: &ViewerArguments) -> anyhow::Result<Self> {
        let registry = session::registry(&arguments.plugins)?;
        let (preference_file, preferences, wrong) = PreferenceFile::open();
        let mut wrong: Vec<String> = wrong.into_iter().collect();
        let (device, refused) = preferences.device.under(&arguments.device);
        wrong.extend(refused);
        wrong.extend(preferences.use_memory());
        let wake = ctx.clone();
        let thread = RenderThread::start(device.clone(), arguments.plugins.clone(), move || {
            wake.request_repaint()
        })?;
        theme::apply(ctx, &preferences);
        let mut window = Self {
            render: Render::new(thread),
            document: Document::new(arguments.up, &arguments.colors),
            plugins: Plugins::new(registry, &device, &arguments.plugins),
            measure: Measure::new(&arguments.plugins),
            settings: Settings::default(),
            views: Views::new(arguments.up),
            panels: Panels::default(),
            messages: Messages::default(),
            preferences,
            preference_file,
            keymap: Keymap::default(),
        };
        wrong.into_iter().for_each(|line| window.messages.warn(line));
        window.draw_by_named(&arguments.plugins.plugin);
        // Without files there is the start page.
        if !arguments.files.is_empty() {
            window.open(ctx, arguments.files.clone());
        }
        Ok(window)
    }

    /// Draws by the renderer of the one plugin file that was named, where it has one alone.
    fn draw_by_named(&mut self, files: &[PathBuf]) {
        let [file] = files else { return };
        let whole = |path: &Path| std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let file = whole(file);
        let units = self.plugins.registry.units(UnitKind::Renderer);
        let own = units.filter(|(entry, ..)| whole(&entry.path) == file);
        let registry = &self.plugins.registry;
        let names: Vec<String> =
            own.map(|(entry, manifest, unit)| registry.name(&entry.unit(manifest, unit))).collect();
        if let ([name], Some(pane)) = (&names[..], self.settings.panes.first_mut()) {
            pane.renderers[0].clone_from(name);
        }
    }

    /// A new request number.
    pub(crate) fn next_serial(&mut self) -> u64 {
        self.render.serial += 1;
        self.render.serial
    }

    /// The names of the renderers that can draw what is shown, as the settings use them.
    pub(crate) fn renderers(&self) -> Vec<String> {
        let registry = &self.plugins.registry;
        let shown = self.document.clouds.as_ref().map(|shown| &shown.clouds.facts.clouds);
        let suits = |name: &String| shown.is_none_or(|clouds| registry.suits(name, clouds));
        registry.names(UnitKind::Renderer).into_iter().filter(suits).collect()
    }

    /// The names of all that draws in views: renderers, and tracers behind them.
    pub(crate) fn drawers(&self) -> Vec<String> {
        let mut names = self.renderers();
        let tracers = self.plugins.registry.names(UnitKind::Tracer);
        names.extend(
            tracers
                .into_iter()
                .filter(|name| self.plugins.registry.find(UnitKind::Renderer, name).is_err()),
        );
        names
    }

    /// The camera of a pane.
    pub(crate) fn camera_of(&self, pane: u32) -> Camera {
        let own = self.settings.pane(pane).filter(|pane| !pane.linked);
        let own = own.and_then(|pane| self.views.own_cameras.get(&pane.id));
        own.copied().unwrap_or(self.views.camera)
    }

    /// Moves the camera of a pane and of the panes linked with it.
    pub(crate) fn set_camera(&mut self, pane: u32, camera: Camera) {
        if self.settings.pane(pane).is_some_and(|pane| !pane.linked) {
            self.views.own_cameras.insert(pane, camera);
        } else {
            self.views.camera = camera;
        }
    }

    /// Gives unlinked panes a camera of their own, at first a copy of the shared one.
    pub(crate) fn copy_shared_camera(&mut self) {
        for pane in self.settings.panes.iter().filter(|pane| !pane.linked) {
            self.views.own_cameras.entry(pane.id).or_insert(self.views.camera);
        }
    }

    /// Whether there is a place inside the clouds.
    pub(crate) fn can_stand_inside(&self) -> bool {
        self.document.clouds.as_ref().is_some_and(|shown| inside::can_stand(&shown.clouds))
    }

    /// A camera inside the clouds, where their device stood or in free space; `None` where nobody knows.
    pub(crate) fn inside(&self) -> Option<Camera> {
        let shown = self.document.clouds.as_ref()?;
        let camera = inside::stand(&shown.clouds, self.document.up)?;
        Some(camera_in(&shown.extent, self.document.up, camera, self.views.shape()))
    }

    /// Moves the camera of the focused pane inside the clouds.
    pub(crate) fn stand_inside(&mut self) {
        match self.inside() {
            Some(camera) => {
                self.views.walking = true;
                lights::suit(&mut self.settings.scene.lights, true);
                self.set_camera(self.views.focused, camera);
            }
            None => self
                .messages
                .warn("the files do not say where a scanner stood, and no room was found in them"),
        }
    }

    /// Moves the camera of the focused pane to where it sees one of the open clouds.
    pub(crate) fn frame_cloud(&mut self, index: usize) {
        let Some(shown) = &self.document.clouds else { return };
        let Some(open_cloud) = shown.open_clouds.all().get(index) else { return };
        let alone = Clouds::of(vec![open_cloud.loaded.clone()]);
        let extent = alone.extent(self.settings.scene.surface.radius_scale);
        self.views.walking = false;
        self.fly_to(self.views.focused, self.framing(&extent));
    }

    /// The camera that sees all of an extent, in the projection of the focused pane.
    pub(crate) fn framing(&self, extent: &Extent) -> Camera {
        self.projected(initial_camera(extent, self.document.up, self.views.shape()))
    }

    /// The same, seen from where the focused pane sees it.
    pub(crate) fn framing_from_here(&self, extent: &Extent) -> Camera {
        let Camera { eye, target, up, .. } = self.camera_of(self.views.focused);
        let Some(towards_camera) = (eye - target).try_normalize() else {
            return self.framing(extent);
        };
        let here = CameraSpec::Preset { towards_camera, up };
        let camera = self.projected(camera_in(extent, UpAxis::Y, here, self.views.shape()));
        // From the usual side it is the usual camera to the last bit, which follows the shape of views.
        let usual = self.framing(extent);
        if usual.eye.distance(camera.eye) < 1e-9 * usual.eye.distance(usual.target) {
            return usual;
        }
        camera
    }

    /// A camera in the projection of the focused pane.
    fn projected(&self, mut camera: Camera) -> Camera {
        camera.projection = match self.camera_of(self.views.focused).projection {
            perspective @ Projection::Perspective { .. } => perspective,
            Projection::Orthographic { .. } => {
                let mut parallel = camera;
                navigation::toggle_projection(&mut parallel, 0.6);
                parallel.projection
            }
        };
        camera
    }

    /// Shows the next renderer of the list in the focused view, or the one before.
    pub(crate) fn step_renderer(&mut self, forward: bool) {
        let mut names = self.renderers();
        if !forward {
            names.reverse();
        }
        let Some(pane) = self.settings.pane_mut(self.views.focused) else { return };
        let at = names.iter().position(|name| *name == pane.renderers[0]).map_or(0, |at| at + 1);
        // Beside another one, that one is passed over where there is a third.
        let beside = |name: &str| pane.mode.sides() == 2 && name == pane.renderers[1];
        let after = names.iter().cycle().skip(at).take(names.len());
        if let Some(name) = after.clone().find(|name| !beside(name)).or(after.clone().next()) {
            pane.renderers[0].clone_from(name);
        }
    }

    /// Closes a list or a window that was opened over the views; returns whether one was open.
    pub(crate) fn close_topmost(&mut self) -> bool {
        let panels = &mut self.panels;
        let open = [
            &mut panels.about,
            &mut panels.settings_window,
            &mut panels.key_list,
            &mut panels.manual.open,
            &mut panels.plugin_list,
            &mut self.messages.open,
            &mut panels.export_form.open,
            &mut panels.start_page,
        ];
        let found = open.into_iter().find(|open| **open);
        let closes = found.is_some_and(|open| std::mem::replace(open, false));
        if closes {
            return true;
        }
        // The tool's window is away while its pairs are clicked, and comes back.
        let open = self.plugins.tools.open.as_deref();
        let is_shown = open.is_some_and(|name| !self.picks_pairs_for(name));
        is_shown && self.plugins.tools.open.take().is_some() || self.let_go()
    }

    /// Writes the settings of the window where they have changed.
    pub(crate) fn save_preferences(&mut self) {
        if let Some(line) = self.preference_file.save(&self.preferences) {
            self.messages.warn(line);
        }
    }

    /// Whether a visible picture is pending or being refined.
    pub(crate) fn works(&self) -> bool {
        self.settings.panes.iter().any(|settings| {
            let sides = self.views.panes.get(&settings.id).map(|pane| &pane.sides);
            sides.is_some_and(|sides| sides[..settings.mode.sides()].iter().any(Side::works))
        })
    }

    /// The state that undo covers.
    pub(crate) fn snapshot(&self) -> Snapshot {
        let open_clouds = self.document.clouds.as_ref().map(|shown| shown.open_clouds.clone());
        Snapshot { settings: self.settings.clone(), up: self.document.up, open_clouds }
    }

    /// Replaces the open clouds, or which of them are visible; the camera stays.
    pub(crate) fn show_clouds(&mut self, open_clouds: OpenClouds) {
        let Some(shown) = &mut self.document.clouds else { return };
        if shown.open_clouds == open_clouds {
            return;
        }
        // What was displayed of the former stays until that of the new ones is there.
        shown.open_clouds = open_clouds;
        self.views.pointer_position = None;
        self.views.pointer_text.clear();
    }

    /// What the colours of the clouds mean; `None` where they are no numbers.
    pub(crate) fn legend(&self) -> Option<Legend> {
        self.document.clouds.as_ref().and_then(|shown| shown.displayed.legend())
    }

    /// Computes the extent of the clouds again where the factor on radii changed.
    pub(crate) fn update_extent(&mut self) {
        let scale = self.settings.scene.surface.radius_scale;
        if let Some(shown) = &mut self.document.clouds
            && shown.radius_scale != scale
        {
            (shown.extent, shown.radius_scale) = (shown.clouds.extent(scale), scale);
        }
    }

    /// Fits the values of a renderer to its parameters, and warns of those that did not fit.
    pub(crate) fn fit_values(&mut self, renderer: &str) {
        let Some(declared) = self.plugins.declared.get(renderer) else { return };
        let scene_file = self.document.scene_file.as_ref();
        let folder = scene_file.map(|file| file.folder.clone()).unwrap_or_default();
        for values in self.settings.panes.iter_mut().filter_map(|p| p.values.get_mut(renderer)) {
            for line in parameters::fit(renderer, declared, values, &folder) {
                self.messages.warn(line);
            }
        }
    }
}
