//! Clouds of further files come beside what is open.

use super::file_loader::LoadedFiles;
use crate::document::environment_map::set_environment_file;
use crate::panels::Selection;
use crate::window::Window;
use eframe::egui::Context;
use std::path::PathBuf;
use surfelshop_session::input::environment_map::is_probe;
use surfelshop_session::input::plausibility;

impl Window {
    /// Starts to read files whose clouds come beside the open ones; camera, lights and views stay. They are opened where
    /// nothing is open yet.
    pub(crate) fn add(&mut self, ctx: &Context, files: Vec<PathBuf>) {
        if self.document.loader.is_some() {
            return self
                .messages
                .warn("files are still being read; add others when they are there");
        }
        if self.document.clouds.is_none() {
            return self.open(ctx, files);
        }
        let (probes, files): (Vec<_>, Vec<_>) = files.into_iter().partition(|file| is_probe(file));
        if let Some(probe) = probes.first() {
            set_environment_file(self, probe);
        }
        if let Some(scene) = files.iter().find(|file| surfelshop_cloud::scene::is_scene(file)) {
            return self.messages.warn(format!(
                "{}: expected clouds to add, found a scene, which has a camera and lights of its own; open it, or add \
                 the files that it names",
                scene.display()
            ));
        }
        if !files.is_empty() {
            self.read(ctx, files, true);
        }
    }

    /// Shows clouds that were read beside the open ones, as one step of the history.
    pub(super) fn show_added(&mut self, files: &[PathBuf], loaded: &LoadedFiles) {
        let Some(shown) = &self.document.clouds else { return };
        let first = shown.open_clouds.all().len();
        let with_them = shown.open_clouds.with(&loaded.clouds);
        let names: Vec<String> =
            with_them.all().iter().skip(first).map(|cloud| cloud.name()).collect();
        let far_apart = plausibility::far_apart(&with_them.clouds);
        self.show_clouds(with_them);
        self.choose_renderers();
        self.panels.selection = Selection::Cloud(first);
        self.messages.report(format!("added {}", names.join(", ")));
        if let Some(line) = far_apart {
            self.messages.warn(line);
        }
        if let Some(state_folder) = &self.document.state_folder {
            // A list that cannot be written does not prevent adding.
            drop(state_folder.add_recent(files));
            self.document.recent = state_folder.recent();
        }
    }
}
