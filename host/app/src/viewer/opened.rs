//! Clouds and scenes that are opened, saved, and kept for the next start.

use super::darkroom::Place;
use super::loading::{Loading, Read};
use super::stock::Stock;
use super::window::{Shown, Window, frame};
use super::{recovery, scene_file, surroundings};
use crate::demo;
use crate::surroundings::is_probe;
use eframe::egui::Context;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use surfelshop_api::graph::Output;
use surfelshop_cloud::scene::{SceneCloud, SceneFile, Table};

/// Time between two saves of the scene for the next start.
const BETWEEN_KEEPING: Duration = Duration::from_secs(10);

impl Window {
    /// Begins to read files, which replace what is shown; the sample where there are none.
    ///
    /// Light probes among them are put around what is shown.
    pub(crate) fn open(&mut self, ctx: &Context, files: Vec<PathBuf>) {
        let (probes, files): (Vec<_>, Vec<_>) = files.into_iter().partition(|file| is_probe(file));
        if let Some(probe) = probes.first() {
            surroundings::put(self, probe);
            if files.is_empty() && self.shown.is_some() {
                return;
            }
        }
        // An installed program may have no sample beside it; then there is nothing to show yet.
        let sample = || demo::find_sample().into_iter().collect();
        let files = if files.is_empty() { sample() } else { files };
        if files.is_empty() {
            return;
        }
        let wake = ctx.clone();
        match Loading::start(files, move || wake.request_repaint()) {
            Ok(loading) => {
                self.loading = Some(loading);
                self.replaces = false;
                if let Some(recovery) = &mut self.recovery {
                    recovery.reading = None;
                }
            }
            Err(error) => self.messages.warn(format!("nothing can be read: {error}")),
        }
    }

    /// Opens files that were dropped onto the window.
    pub(crate) fn take_dropped_files(&mut self, ctx: &Context) {
        let dropped: Vec<PathBuf> = ctx.input(|input| {
            input.raw.dropped_files.iter().map(|file| file.path().to_owned()).collect()
        });
        if !dropped.is_empty() {
            self.open(ctx, dropped);
        }
    }

    /// Shows clouds that were read, unless edits would be lost by that.
    pub(crate) fn take_clouds(&mut self) {
        if self.loading.is_none() || !self.may_replace() {
            return;
        }
        let Some(result) = self.loading.as_ref().and_then(Loading::finished) else { return };
        let files = self.loading.take().map(|loading| loading.files.clone()).unwrap_or_default();
        let left = self.recovery.as_mut().and_then(|recovery| recovery.reading.take());
        self.replaces = false;
        let read = match result {
            Ok(read) => read,
            Err(reason) => {
                self.messages.warn(reason);
                return;
            }
        };
        if let Some(opened) = &read.scene {
            opened.warnings.iter().for_each(|line| self.messages.warn(line.as_str()));
        }
        if let Some(left) = left {
            if let Some((stock, file, path)) = recovery::recovered(self, left, read) {
                self.show_stock(stock, Some(&file));
                self.files.clear();
                self.show_scene(file, path);
                self.history.begin_anew();
            }
            return;
        }
        let Read { clouds, scene, entries } = read;
        let file = scene.as_ref().map(|opened| &opened.scene);
        self.show_stock(Stock::read(clouds, &entries), file);
        if let Some(memory) = &self.memory {
            // A list that cannot be kept is no reason not to show what was opened.
            drop(memory.opened(&files));
            self.recent = memory.recent();
        }
        let is_cloud = |file: &PathBuf| !surfelshop_cloud::scene::is_scene(file);
        self.files = files.into_iter().filter(is_cloud).collect();
        if let Some(opened) = scene {
            let mut file = opened.scene;
            file.clouds.extend(self.files.iter().map(|file| {
                let path = std::path::absolute(file).unwrap_or_else(|_| file.clone());
                SceneCloud::new(path).into()
            }));
            // The last session is the program's own file; saving asks where to.
            let own = self.memory.as_ref().is_some_and(|memory| memory.owns(&opened.path));
            self.show_scene(file, Some(opened.path).filter(|_| !own));
        }
        self.history.begin_anew();
    }

    /// Shows other clouds, seen whole.
    fn show_stock(&mut self, stock: Stock, scene: Option<&SceneFile>) {
        let surface = scene.map_or(self.settings.scene.surface, |scene| scene.surface.known);
        let load = self.shown.as_ref().map_or(0, |shown| shown.load) + 1;
        let shown = Shown::new(stock, surface.radius_scale, load);
        let extent = shown.extent;
        self.shown = Some(shown);
        self.n_opened += 1;
        self.tools.cancel();
        self.tools.item = 0;
        self.let_hidden_go();
        self.looked_at = None;
        self.own_cameras.clear();
        self.camera = frame(&extent, self.up).camera;
        self.scene_file = None;
        self.scene_path = None;
        self.hidden_views.clear();
        for pane in &mut self.settings.panes {
            (pane.output, pane.unknown) = (Output::Color, Table::new());
        }
    }

    /// Shows the clouds as a scene says.
    fn show_scene(&mut self, file: SceneFile, path: Option<PathBuf>) {
        scene_file::apply(self, &file);
        let known: Vec<String> = self.declared.keys().cloned().collect();
        known.iter().for_each(|renderer| self.fit_values(renderer));
        (self.scene_file, self.scene_path) = (Some(file), path);
    }

    /// Lets go of renderers that show nothing: they would hold the clouds before these.
    fn let_hidden_go(&mut self) {
        for settings in &self.settings.panes {
            for side in settings.mode.sides()..2 {
                self.darkroom.let_go(Place { pane: settings.id, side });
            }
        }
    }

    /// Keeps what is shown for the next start, at most now and then.
    pub(crate) fn keep(&mut self, ctx: &Context, at_once: bool) {
        let recently = self.kept.as_ref().is_some_and(|(_, when)| when.elapsed() < BETWEEN_KEEPING);
        let Some(memory) = &self.memory else { return };
        if self.shown.is_none() {
            return;
        }
        if recently && !at_once {
            // An idle window has no frames: without this one the last changes would not be kept.
            ctx.request_repaint_after(BETWEEN_KEEPING);
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

    /// Says which edits a scene that was written does not show when it is opened again.
    fn tell_unsaved(&mut self, path: &std::path::Path) {
        let items = self.shown.iter().flat_map(|shown| shown.stock.items());
        let names: Vec<String> =
            items.filter(|item| item.is_unsaved()).map(super::stock::Item::name).collect();
        if !names.is_empty() {
            self.messages.warn(format!(
                "{} names files, and edits of {} are in none yet; \"File > Save cloud as\" \
                 writes them, and the scene saved after that has them",
                path.display(),
                names.join(", ")
            ));
        }
    }

    /// Writes what is shown to a scene file.
    pub(crate) fn save_scene(&mut self, path: &std::path::Path) {
        let file = scene_file::of(self, path);
        match file.write(path) {
            Ok(()) => {
                self.messages.tell(format!("wrote {}", path.display()));
                self.tell_unsaved(path);
                // Clouds as they are now are put in the place of these anew with every save.
                let clouds = scene_file::opened_clouds(self, &file.folder);
                self.scene_file = Some(SceneFile { clouds, ..file });
                self.scene_path = Some(path.to_owned());
            }
            Err(error) => self.messages.warn(error.to_string()),
        }
    }
}
