//! The axis that points upwards is changed, and remembered for files of a kind.

use crate::document::set_environment_map;
use crate::views::initial_camera;
use crate::window::Window;
use std::path::PathBuf;
use surfelshop_cloud::scene::Axis;
use surfelshop_session::options::UpAxis;

/// The ending of files, in small letters; `None` where they differ or have none.
fn ending_of(files: &[PathBuf]) -> Option<String> {
    let ending = |file: &PathBuf| Some(file.extension()?.to_str()?.to_ascii_lowercase());
    let first = ending(files.first()?)?;
    files.iter().all(|file| ending(file).as_ref() == Some(&first)).then_some(first)
}

impl Window {
    /// Lets an axis point upwards: cameras and the environment turn.
    pub(crate) fn set_up(&mut self, up: UpAxis) {
        if self.document.up == up {
            return;
        }
        self.turn_up(up);
        if let Some(environment) = self.settings.environment.take() {
            // As a new one stands, turned as the former was.
            let (rotation, stops) = (environment.rotation, environment.stops);
            set_environment_map(self, environment.source);
            if let Some(environment) = &mut self.settings.environment {
                (environment.rotation, environment.stops) = (rotation, stops);
            }
        }
    }

    /// The same, where the environment stands as it should: views look at everything again.
    pub(crate) fn turn_up(&mut self, up: UpAxis) {
        self.document.up = up;
        // Of what is open now: other files may have been opened first.
        if let Some(ending) = ending_of(&self.file_names()) {
            self.preferences.up.insert(ending, up.axis());
        }
        let Some(shown) = &self.document.clouds else { return };
        let camera = initial_camera(&shown.extent, up, self.views.shape());
        self.views.own_cameras.clear();
        self.views.walking = false;
        self.views.flight = None;
        self.views.camera = camera;
        // Heights are measured along it.
        self.views.pointer_position = None;
    }

    /// Turns everything upside down.
    pub(crate) fn turn_upside_down(&mut self) {
        let down = -self.document.up.axis().direction();
        self.set_up(Axis::nearest(down).into());
    }

    /// The axis that the user chose for files of this kind.
    pub(crate) fn preferred_up(&self, files: &[PathBuf]) -> Option<UpAxis> {
        let chosen = self.preferences.up.get(&ending_of(files)?)?;
        Some(UpAxis::from(*chosen))
    }
}
