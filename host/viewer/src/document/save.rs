//! Clouds, scenes and the session are written to files.

use super::cloud_writer::CloudWriter;
use super::file_names::{cloud_file_name, layer_file_name};
use super::open_clouds::OpenCloud;
use super::scene_file;
use crate::views::hands::unused;
use crate::window::Window;
use eframe::egui::Context;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use surfelshop_cloud::Formats as _;
use surfelshop_cloud::scene::SceneFile;
use surfelshop_session::input::layers;

/// Time between two saves of the session.
const SESSION_INTERVAL: Duration = Duration::from_secs(10);

impl Window {
    /// Starts to write one of the clouds.
    pub(crate) fn save_cloud(&mut self, ctx: &Context, index: usize, path: &Path) {
        let shown = self.document.complete_clouds();
        let Some(open_cloud) = shown.and_then(|shown| shown.open_clouds.all().get(index)) else {
            return;
        };
        if let Some(pyramid) = open_cloud.pyramid() {
            if pyramid.layer().is_empty() {
                return self.messages.report("the pyramid has no edits that could be written");
            }
            let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
            if self.save_layer(index, &layer_file_name(&path)) {
                self.messages.report("a scene that is saved now names these edits");
            }
            return;
        }
        if let Some(writer) = &self.document.cloud_writer {
            let (first, path) = (writer.path.display(), path.display());
            self.messages.warn(format!("{path} was not written: {first} is still being written"));
            return;
        }
        let formats = Arc::new(self.plugins.formats());
        let path = cloud_file_name(path, &formats.endings(true));
        let path = std::path::absolute(&path).unwrap_or(path);
        let (numbers, wake) = ((index, self.document.n_opened), ctx.clone());
        match CloudWriter::start(open_cloud, numbers, path, formats, move || wake.request_repaint())
        {
            Ok(writer) => self.document.cloud_writer = Some(writer),
            Err(error) => self.messages.warn(format!("nothing can be written: {error}")),
        }
    }

    /// Takes in the result of writing a cloud.
    pub(crate) fn take_saved(&mut self) {
        let Some(result) = self.document.cloud_writer.as_ref().and_then(CloudWriter::finished)
        else {
            return;
        };
        let Some(writer) = self.document.cloud_writer.take() else { return };
        let CloudWriter { index, n_opened, path, cloud, .. } = writer;
        match result {
            Err(reason) => self.messages.warn(reason),
            Ok(lost) => {
                self.messages.report(format!("wrote {}", path.display()));
                self.list_recent(std::slice::from_ref(&path));
                lost.into_iter().for_each(|line| self.messages.warn(line));
                let n_opened_now = self.document.n_opened;
                let shown = self.document.clouds.as_mut();
                if let Some(shown) = shown.filter(|_| n_opened == n_opened_now) {
                    shown.open_clouds = shown.open_clouds.saved(index, &path, &cloud);
                }
            }
        }
    }

    /// Writes the scene.
    pub(crate) fn save_scene(&mut self, path: &Path) {
        if self.document.preview.is_some() {
            let path = path.display();
            self.messages.warn(format!("{path} was not written: files are still being read"));
            return;
        }
        self.save_layers(path);
        let file = scene_file::scene_of(self, path);
        match file.write(path) {
            Ok(()) => {
                self.messages.report(format!("wrote {}", path.display()));
                self.warn_of_unsaved(path);
                // The next save replaces the clouds as they were opened again.
                let clouds = scene_file::opened_clouds(self, &file.folder);
                self.document.scene_file = Some(SceneFile { clouds, ..file });
                self.document.scene_path = Some(path.to_owned());
                self.document.written = Some(self.snapshot());
                self.list_recent(&[path.to_owned()]);
            }
            Err(error) => self.messages.warn(error.to_string()),
        }
    }

    /// Writes the edits of a pyramid into a file, where it has some, and says so; whether that went well.
    fn save_layer(&mut self, index: usize, path: &Path) -> bool {
        let Some(shown) = &mut self.document.clouds else { return false };
        let open_cloud = shown.open_clouds.all().get(index);
        let Some(pyramid) = open_cloud.and_then(|open_cloud| open_cloud.pyramid()) else {
            return false;
        };
        if !pyramid.layer().is_empty() {
            let n_surfels = pyramid.pyramid().directory().n_surfels;
            if let Err(error) = layers::write(path, n_surfels, pyramid.layer()) {
                self.messages.warn(format!("{error:#}"));
                return false;
            }
            self.messages.report(format!("wrote {}", path.display()));
        }
        shown.open_clouds = shown.open_clouds.layer_saved(index, path);
        true
    }

    /// Writes the edits of pyramids that are in no file yet, for a scene: beside it, or where they came from if the scene
    /// is the same one and no other cloud has its edits there.
    fn save_layers(&mut self, scene: &Path) {
        let Some(shown) = &self.document.clouds else { return };
        let stays = self.document.scene_path.as_deref() == Some(scene);
        let name = scene.file_name().unwrap_or_default().to_string_lossy();
        let stem = name.strip_suffix(".scene.toml").or(name.strip_suffix(".toml"));
        let beside = |ending: &str| {
            let stem = stem.unwrap_or(&name);
            unused(&scene.with_file_name(format!("{}.toml", stem.replace('.', "-"))), ending)
        };
        let all = shown.open_clouds.all();
        let files: Vec<Option<PathBuf>> = all.iter().map(OpenCloud::layer_file).collect();
        let unsaved = all.iter().enumerate().filter(|(index, open_cloud)| {
            let has_other_file = !stays && files[*index].is_some();
            open_cloud.pyramid().is_some() && (open_cloud.is_unsaved() || has_other_file)
        });
        let unsaved: Vec<usize> = unsaved.map(|(index, _)| index).collect();
        for index in unsaved {
            let is_own = |path: &&PathBuf| {
                stays && files.iter().flatten().filter(|other| other == path).count() == 1
            };
            let path = files[index].as_ref().filter(is_own).cloned();
            self.save_layer(index, &path.unwrap_or_else(|| beside(layers::ENDING)));
        }
    }

    /// Warns of edits that a written scene does not contain.
    fn warn_of_unsaved(&mut self, path: &Path) {
        let open_clouds = self.document.clouds.iter().flat_map(|shown| shown.open_clouds.all());
        let unsaved = open_clouds.filter(|open_cloud| open_cloud.is_unsaved());
        let names: Vec<String> = unsaved.map(OpenCloud::name).collect();
        if !names.is_empty() {
            self.messages.warn(format!(
                "{} names files, and edits of {} are in none yet; \"File > Save cloud as\" \
                 writes them, and the scene saved after that has them",
                path.display(),
                names.join(", ")
            ));
        }
    }

    /// Saves the session for the next start, at most every [`SESSION_INTERVAL`] unless `at_once`.
    pub(crate) fn save_session(&mut self, ctx: &Context, at_once: bool) {
        let last_session = self.document.last_session.as_ref();
        let recently = last_session.is_some_and(|(_, when)| when.elapsed() < SESSION_INTERVAL);
        let Some(state_folder) = &self.document.state_folder else { return };
        if self.document.complete_clouds().is_none() {
            return;
        }
        if recently && !at_once {
            // An idle window has no frames, and would not save the last changes.
            ctx.request_repaint_after(SESSION_INTERVAL);
            return;
        }
        let scene = scene_file::scene_of(self, &state_folder.last_session_path());
        if self.document.last_session.as_ref().is_none_or(|(saved, _)| *saved != scene)
            && let Err(error) = state_folder.save_session(&scene)
        {
            tracing::debug!("the scene was not kept: {error:#}");
        }
        self.document.last_session = Some((scene, Instant::now()));
        self.save_thumbnail();
    }
}
