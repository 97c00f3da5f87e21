//! Files that are being read are shown before all of them is there: some of the points, with estimates of their own.

use super::preview::Preview;
use crate::document::open_clouds::OpenClouds;
use crate::document::visible_clouds::VisibleClouds;
use crate::views::layout::follow_settings;
use crate::window::Window;
use surfelshop_api::Camera;
use surfelshop_session::input::clouds::Clouds;

impl Window {
    /// Shows what was read so far, unless edits or a scene that are in no file would be out of sight.
    pub(crate) fn take_preview(&mut self) {
        // What is open stays in sight while more is read.
        let loader = self.document.loader.as_ref().filter(|loader| !loader.adds);
        let Some(clouds) = loader.and_then(|loader| loader.preview()) else { return };
        let is_empty = clouds.facts.n_surfels == 0;
        if !is_empty && (self.document.replace_confirmed || !self.replacing_loses()) {
            self.show_preview(clouds);
        }
    }

    fn show_preview(&mut self, clouds: Clouds) {
        let entries: Vec<usize> = (0..clouds.loaded.len()).collect();
        let sources: Vec<_> = clouds.loaded.iter().map(|one| one.cloud.source().clone()).collect();
        let revision = self.document.clouds.as_ref().map_or(0, |shown| shown.revision) + 1;
        let radius_scale = self.settings.scene.surface.radius_scale;
        let mut shown =
            VisibleClouds::new(OpenClouds::read(clouds, &entries), radius_scale, revision);
        shown.frames = true;
        let former = self.document.clouds.replace(shown);
        let moved = match self.document.preview.take() {
            Some(preview) => {
                let moved = self.views.camera != preview.camera;
                self.document.preview = Some(preview);
                moved
            }
            None => {
                self.plugins.tools.cancel();
                self.document.preview = Some(Preview {
                    former,
                    former_camera: self.views.camera,
                    former_walking: self.views.walking,
                    former_up: self.document.up,
                    former_settings: self.settings.clone(),
                    former_tree: self.views.tree.clone(),
                    camera: self.views.camera,
                });
                self.leave_settings();
                self.choose_renderers();
                false
            }
        };
        let files = self.file_names();
        self.document.up = self.up_of(&files).or_of(sources.iter());
        if !moved {
            self.look_first();
            if let Some(preview) = &mut self.document.preview {
                preview.camera = self.views.camera;
            }
        }
        self.views.pointer_position = None;
    }

    /// Puts back what was open before; returns the camera of a user who looked around meanwhile.
    pub(crate) fn end_preview(&mut self) -> Option<Camera> {
        let preview = self.document.preview.take()?;
        let moved = Some(self.views.camera).filter(|camera| *camera != preview.camera);
        let revision = self.document.clouds.as_ref().map_or(0, |shown| shown.revision) + 1;
        self.document.clouds = preview.former.map(|former| VisibleClouds { revision, ..former });
        self.document.up = preview.former_up;
        self.settings = preview.former_settings;
        follow_settings(self);
        self.views.tree = preview.former_tree;
        (self.views.camera, self.views.walking) = (preview.former_camera, preview.former_walking);
        self.views.pointer_position = None;
        moved
    }
}
