//! Clouds and scenes are opened.

mod add;
pub(crate) mod file_loader;
pub(crate) mod preview;
mod previewing;

use super::environment_map::set_environment_file;
use super::open_clouds::OpenClouds;
use super::recovery::restored_clouds;
use super::scene_file;
use super::visible_clouds::VisibleClouds;
use crate::document::settings::{Settings, USUAL_RENDERER};
use crate::panels::Selection;
use crate::render_thread::{RenderCommand, ViewSlot};
use crate::views::layout::follow_settings;
use crate::views::{arrangement, initial_camera};
use crate::window::Window;
use eframe::egui::Context;
use file_loader::{FileLoader, LoadedFiles};
use std::path::PathBuf;
use surfelshop_api::SurfaceSettings;
use surfelshop_api::graph::Output;
use surfelshop_cloud::Cloud;
use surfelshop_cloud::display::{Attribute, ColorBy, ColorSource, Display, Look};
use surfelshop_cloud::scene::{SceneCloud, SceneFile, Table};
use surfelshop_runtime::plugins::has_library_extension;
use surfelshop_session::cloud_renderers;
use surfelshop_session::input::bare_land::is_bare_land;
use surfelshop_session::input::clouds;
use surfelshop_session::input::environment_map::is_probe;
use surfelshop_session::input::inside::is_first_view;
use surfelshop_session::input::plausibility;
use surfelshop_session::input::sample::find_sample;
use surfelshop_session::options::{UpAxis, lights};

impl Window {
    /// Starts to read files, which replace the open ones; the sample where there are none. The first
    /// environment map among them is chosen at once.
    pub(crate) fn open(&mut self, ctx: &Context, files: Vec<PathBuf>) {
        let (probes, files): (Vec<_>, Vec<_>) = files.into_iter().partition(|file| is_probe(file));
        if let Some(probe) = probes.first() {
            set_environment_file(self, probe);
            if files.is_empty() && self.document.clouds.is_some() {
                return;
            }
        }
        // An installed program may have no sample; then there is nothing to show yet.
        let sample = || find_sample().into_iter().collect();
        let files = if files.is_empty() { sample() } else { files };
        if files.is_empty() {
            return;
        }
        self.read(ctx, files, false);
    }

    /// Starts to read files, whose clouds are added to what is open or replace it.
    fn read(&mut self, ctx: &Context, files: Vec<PathBuf>, adds: bool) {
        let wake = ctx.clone();
        let (formats, up) = (self.plugins.formats(), self.up_of(&files));
        match FileLoader::start(files, adds, (formats, up), move || wake.request_repaint()) {
            Ok(loader) => {
                self.document.loader = Some(loader);
                self.panels.start_page = false;
                self.document.replace_confirmed = false;
                if let Some(recovery) = &mut self.document.recovery {
                    recovery.reading = None;
                }
            }
            Err(error) => self.messages.warn(format!("nothing can be read: {error}")),
        }
    }

    /// The axis that points upwards in files where they do not say it: as it was typed, or chosen for their kind.
    pub(super) fn up_of(&self, files: &[PathBuf]) -> UpAxis {
        match self.document.typed_up {
            // What was chosen for other files does not turn the program's own.
            UpAxis::Auto if is_sample(files) => UpAxis::default(),
            UpAxis::Auto => self.preferred_up(files).unwrap_or_default(),
            typed => typed,
        }
    }

    /// The files of the clouds that are shown.
    pub(crate) fn file_names(&self) -> Vec<PathBuf> {
        let shown = self.document.clouds.iter().flat_map(|shown| &shown.clouds.loaded);
        shown.map(|loaded| PathBuf::from(&loaded.summary.file)).collect()
    }

    /// Puts plugin files into the list; those that are native are asked about.
    fn add_plugins(&mut self, files: Vec<PathBuf>) {
        for told in self.plugins.add_files(&files) {
            match told {
                Ok(line) => self.messages.report(line),
                Err(line) => self.messages.warn(line),
            }
        }
        self.render.thread.add(RenderCommand::AddPlugins(files));
    }

    /// Opens files that were dropped onto the window, or adds them where Shift is held.
    pub(crate) fn take_dropped_files(&mut self, ctx: &Context) {
        let (dropped, adds) = ctx.input(|input| {
            let files = input.raw.dropped_files.iter().map(|file| file.path().to_owned());
            (files.collect::<Vec<PathBuf>>(), input.modifiers.shift)
        });
        let (plugins, dropped): (Vec<_>, Vec<_>) =
            dropped.into_iter().partition(|file| has_library_extension(file));
        if !plugins.is_empty() {
            self.add_plugins(plugins);
        }
        match (dropped.is_empty(), adds) {
            (true, _) => {}
            (false, true) => self.add(ctx, dropped),
            (false, false) => self.open(ctx, dropped),
        }
    }

    /// Shows clouds that were read, unless unsaved edits would be lost.
    pub(crate) fn take_loaded(&mut self) {
        let Some(loader) = &self.document.loader else { return };
        let adds = loader.adds;
        if !adds && !self.may_replace_clouds() {
            return;
        }
        let Some(result) = self.document.loader.as_ref().and_then(FileLoader::finished) else {
            return;
        };
        let loader = self.document.loader.take();
        let mut files = loader.map(|loader| loader.files.clone()).unwrap_or_default();
        let recovery = self.document.recovery.as_mut();
        let session = recovery.and_then(|recovery| recovery.reading.take());
        self.document.replace_confirmed = false;
        // What was changed while some of the points were shown stays.
        let previewed = self.document.preview.as_ref().map(|_| self.settings.clone());
        let moved = self.end_preview();
        let loaded = match result {
            Ok(loaded) => loaded,
            Err(reason) => {
                self.messages.warn(reason);
                return;
            }
        };
        if !adds && self.document.clouds.is_some() {
            // They are of the files before.
            self.messages.dismiss_all();
        }
        for (file, line) in &loaded.unread {
            files.retain(|other| other != file);
            self.messages.warn(line.as_str());
        }
        if let Some(line) = plausibility::nothing_to_see(&loaded.clouds) {
            self.messages.warn(line);
        }
        for one in &loaded.clouds.loaded {
            let doubts = clouds::doubts(one);
            let more = match doubts.len() {
                0 | 1 => String::new(),
                n => format!(" ({} more among its properties)", n - 1),
            };
            if let Some(line) = doubts.first() {
                self.messages.warn(format!("{}: {line}{more}", one.summary.file));
            }
        }
        if adds {
            return self.show_added(&files, &loaded);
        }
        if let Some(opened) = &loaded.scene {
            opened.warnings.iter().for_each(|line| self.messages.warn(line.as_str()));
        }
        if let Some(session) = session {
            if let Some((open_clouds, file, path)) = restored_clouds(self, session, loaded) {
                self.show_new_clouds(open_clouds, Some(&file));
                self.document.files.clear();
                self.show_scene(file, path);
                self.document.history.clear();
            }
            return;
        }
        if let Some(settings) = &previewed {
            self.settings.clone_from(settings);
            follow_settings(self);
        }
        let has_camera = loaded.scene.as_ref().is_some_and(|file| file.scene.camera.is_some());
        self.show_loaded(files, loaded, previewed.is_some());
        if let Some(camera) = moved.filter(|_| !has_camera) {
            self.views.camera = camera;
            if let Some(shown) = &mut self.document.clouds {
                shown.frames = false;
            }
        }
    }

    /// Shows clouds and the scene that were read from these files, of which some points may have been shown before.
    fn show_loaded(&mut self, files: Vec<PathBuf>, loaded: LoadedFiles, previewed: bool) {
        let LoadedFiles { clouds, scene, entries, .. } = loaded;
        if scene.is_none() && !previewed {
            self.leave_settings();
        }
        self.document.written = None;
        let file = scene.as_ref().map(|opened| &opened.scene);
        self.show_new_clouds(OpenClouds::read(clouds, &entries), file);
        self.list_recent(&files);
        let is_cloud = |file: &PathBuf| !surfelshop_cloud::scene::is_scene(file);
        self.document.files = files.into_iter().filter(is_cloud).collect();
        let typed = self.document.typed_colors.as_ref();
        if scene.is_none() && typed.is_none_or(|typed| typed.color_by.is_none()) {
            self.color_bare_land();
        }
        if let Some(opened) = scene {
            let mut file = opened.scene;
            file.clouds.extend(self.document.files.iter().map(|file| {
                let path = std::path::absolute(file).unwrap_or_else(|_| file.clone());
                SceneCloud::new(path).into()
            }));
            // The file of the last session is the program's own: saving asks for another one.
            let state_folder = self.document.state_folder.as_ref();
            let own = state_folder.is_some_and(|folder| folder.owns(&opened.path));
            self.show_scene(file, Some(opened.path).filter(|_| !own));
        }
        self.apply_typed_colors();
        self.document.history.clear();
        self.views.pointer_text.clear();
        if !self.measure.is_busy() {
            // They are of other clouds.
            (self.measure.current_view, self.measure.series) = (None, None);
        }
    }

    /// Puts files that were opened or written on top of the list of recent ones.
    pub(super) fn list_recent(&mut self, files: &[PathBuf]) {
        if let Some(state_folder) = &self.document.state_folder {
            // A list that cannot be written prevents nothing.
            drop(state_folder.add_recent(files));
            self.document.recent = state_folder.recent();
        }
    }

    /// Leaves what belongs to the former files: all settings of a scene; of other files their colours, filters, and whether
    /// they are shown as points.
    pub(super) fn leave_settings(&mut self) {
        if self.document.scene_file.is_some() {
            let antialias = self.document.usual_antialias;
            self.settings = Settings { antialias, ..Settings::default() };
            self.views.own_cameras.clear();
            follow_settings(self);
            self.views.tree = arrangement::default_tree(&self.settings.pane_ids());
            return;
        }
        let settings = &mut self.settings;
        settings.color = ColorSource::default();
        settings.filters.clear();
        if settings.splats.look != Look::Surface {
            settings.splats.look = Look::Surface;
            settings.scene.surface.low_pass = SurfaceSettings::default().low_pass;
        }
    }

    /// Colours clouds by height that are land without colours, unless somebody chose something else.
    fn color_bare_land(&mut self) {
        let up = self.document.up.axis();
        let shown = self.document.clouds.as_ref();
        if self.settings.color == ColorSource::default()
            && shown.is_some_and(|shown| is_bare_land(&shown.clouds, up))
        {
            self.settings.color.by = ColorBy::Attribute(Attribute::Height);
            self.messages.report("coloured by height, since these points have no colours");
        }
    }

    /// Puts what was typed about colours and filters over what a scene says, for the first files.
    fn apply_typed_colors(&mut self) {
        let Some(typed) = self.document.typed_colors.take() else { return };
        match typed.over(self.display_settings()) {
            Ok(settings) => {
                (self.settings.color, self.settings.filters) = (settings.color, settings.filters);
                let before = std::mem::replace(&mut self.settings.splats, settings.splats);
                typed.over_surface(&before, &mut self.settings.scene.surface);
            }
            Err(error) => self.messages.warn(format!("{error:#}")),
        }
    }

    /// Shows other clouds with a camera that sees all of them.
    fn show_new_clouds(&mut self, open_clouds: OpenClouds, scene: Option<&SceneFile>) {
        let surface = scene.map_or(self.settings.scene.surface, |scene| scene.surface.known);
        let revision = self.document.clouds.as_ref().map_or(0, |shown| shown.revision) + 1;
        let mut shown = VisibleClouds::new(open_clouds, surface.radius_scale, revision);
        shown.frames = scene.is_none_or(|scene| scene.camera.is_none());
        // Filters are of the former clouds, and so are colours by a column that these do not have.
        self.settings.filters.clear();
        let clouds: Vec<&Cloud> = shown.clouds.loaded.iter().map(|loaded| &loaded.cloud).collect();
        if Display::new(&self.display_settings(), &clouds).is_err() {
            self.settings.color = ColorSource::default();
        }
        self.document.clouds = Some(shown);
        self.document.n_opened += 1;
        self.plugins.tools.cancel();
        self.plugins.tools.cloud_index = 0;
        self.release_hidden();
        let views = &mut self.views;
        (views.pointer_position, views.pointer_cloud, views.measuring.pointer) = (None, None, None);
        self.end_pairs();
        self.views.own_cameras.clear();
        let shown = self.document.clouds.iter().flat_map(|shown| &shown.clouds.loaded);
        let sources = shown.map(|loaded| loaded.cloud.source());
        // A scene says how its own files stand, or leaves it to them.
        let chosen = match scene {
            Some(_) => self.document.typed_up,
            None => self.up_of(&self.file_names()),
        };
        let of_files = chosen.or_of(sources);
        let of_scene = scene.and_then(|scene| scene.up).map(UpAxis::from);
        self.document.up = of_scene.unwrap_or(of_files);
        self.look_first();
        let shown = self.document.clouds.as_ref().filter(|_| scene.is_none());
        if let Some(line) = shown.and_then(|shown| plausibility::far_apart(&shown.clouds)) {
            self.messages.warn(format!("{line}: double-click one in the list to look at it"));
        }
        match scene {
            Some(scene) => {
                if let Some(shown) = &mut self.document.clouds {
                    let (open_clouds, faults) =
                        shown.open_clouds.drawn_as_in(scene).hiding_as_in(scene);
                    shown.open_clouds = open_clouds;
                    faults.into_iter().for_each(|line| self.messages.warn(line));
                }
                if scene.views.is_empty() {
                    self.choose_renderers();
                }
            }
            None => self.choose_renderers(),
        }
        self.document.scene_file = None;
        self.document.scene_path = None;
        self.document.hidden_views.clear();
        self.settings.bookmarks.clear();
        self.settings.measures.clear();
        self.views.measuring.places.clear();
        self.panels.selection = Selection::default();
        for pane in &mut self.settings.panes {
            (pane.output, pane.unknown) = (Output::Color, Table::new());
            pane.clouds = Default::default();
        }
    }

    /// Looks at new clouds: at a scan that is seen from within from where it was taken, in even light, at everything
    /// else from outside.
    pub(crate) fn look_first(&mut self) {
        let Some(shown) = &self.document.clouds else { return };
        let is_within = shown.frames && is_first_view(&shown.clouds);
        let outside = initial_camera(&shown.extent, self.document.up, self.views.shape());
        let inside = self.inside().filter(|_| is_within);
        self.views.walking = inside.is_some();
        lights::suit(&mut self.settings.scene.lights, inside.is_some());
        self.views.camera = inside.unwrap_or(outside);
    }

    /// Draws clouds by the renderer that reads what others do not, where the usual one drew, and by the usual one where a
    /// renderer needs what they lack. Where one suits some of them, it draws these beside the usual one.
    pub(super) fn choose_renderers(&mut self) {
        let Some(shown) = &mut self.document.clouds else { return };
        let visible = shown.open_clouds.clouds.clone();
        let clouds = &visible.facts.clouds;
        let registry = &self.plugins.registry;
        let all = shown.open_clouds.all().iter().enumerate();
        let (indices, places): (Vec<usize>, Vec<String>) =
            all.filter(|(_, cloud)| cloud.visible).map(|(i, cloud)| (i, cloud.name())).unzip();
        let mut named = shown.open_clouds.named();
        let suited = cloud_renderers::suit(registry, clouds, &mut named, &places);
        let suited = suited.map(|unit| registry.name(&unit));
        for (i, renderer) in indices.into_iter().zip(named) {
            shown.open_clouds = shown.open_clouds.drawn_by(i, renderer);
        }
        let is_suited = |name: &str| registry.suits(name, clouds);
        for pane in &mut self.settings.panes {
            let [renderer, _] = &mut pane.renderers;
            match &suited {
                Some(suited) if renderer == USUAL_RENDERER => renderer.clone_from(suited),
                _ if !is_suited(renderer) => USUAL_RENDERER.clone_into(renderer),
                _ => {}
            }
        }
    }

    /// Applies a scene to the clouds.
    fn show_scene(&mut self, file: SceneFile, path: Option<PathBuf>) {
        scene_file::apply(self, &file);
        let known: Vec<String> = self.plugins.declared.keys().cloned().collect();
        known.iter().for_each(|renderer| self.fit_values(renderer));
        (self.document.scene_file, self.document.scene_path) = (Some(file), path);
    }

    /// Releases the renderers of hidden sides, which would hold the former clouds.
    fn release_hidden(&mut self) {
        for settings in &self.settings.panes {
            for side in settings.mode.sides()..2 {
                self.render.thread.release(ViewSlot { pane: settings.id, side });
            }
        }
    }
}

/// Whether these files are the sample that comes with the program.
fn is_sample(files: &[PathBuf]) -> bool {
    files.len() == 1 && find_sample().is_ok_and(|sample| files[0] == sample)
}
