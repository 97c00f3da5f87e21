//! How a drag of the mouse moves the camera.

use crate::preferences::Orbit;
use crate::window::Window;
use surfelshop_api::Camera;

/// What a drag does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CameraMode {
    /// Turns about what is in the middle, and up stays up.
    Turntable,
    /// Turns about what is in the middle, over the poles, too.
    Trackball,
    /// Looks around; keys move.
    Walk,
}

impl CameraMode {
    /// All, in the order of the menu.
    pub(crate) const ALL: [Self; 3] = [Self::Turntable, Self::Trackball, Self::Walk];

    /// Its name.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Turntable => "turntable",
            Self::Trackball => "trackball",
            Self::Walk => "walk",
        }
    }

    /// What mouse and keys do, for the status line.
    pub(crate) fn hint(self) -> &'static str {
        match self {
            Self::Turntable => {
                "Drag to turn, right drag to pan, wheel to zoom, double click to centre"
            }
            Self::Trackball => {
                "Drag to tumble over the poles, right drag to pan, wheel to zoom, double click to centre"
            }
            Self::Walk => "Drag to look around; W A S D walk, E and Q rise and sink, wheel to step",
        }
    }
}

impl Window {
    /// How a drag moves the camera of the focused view.
    pub(crate) fn camera_mode(&self) -> CameraMode {
        match (self.views.walking, self.preferences.orbit) {
            (true, _) => CameraMode::Walk,
            (false, Orbit::Turntable) => CameraMode::Turntable,
            (false, Orbit::Trackball) => CameraMode::Trackball,
        }
    }

    /// Lets a drag move the camera in another way. A turntable brings the camera upright again.
    pub(crate) fn set_camera_mode(&mut self, mode: CameraMode) {
        self.views.walking = mode == CameraMode::Walk;
        match mode {
            CameraMode::Turntable => self.preferences.orbit = Orbit::Turntable,
            CameraMode::Trackball => self.preferences.orbit = Orbit::Trackball,
            CameraMode::Walk => {}
        }
        if mode != CameraMode::Trackball {
            let focused = self.views.focused;
            let camera = self.camera_of(focused);
            let up = self.document.up.axis().direction();
            // One that looks along the axis would have no right.
            let is_along = camera.forward().cross(up).length() < 0.02;
            if camera.up.distance(up) > 1e-9 && !is_along {
                self.fly_to(focused, Camera { up, ..camera });
            }
        }
        self.messages.report(format!("{}: {}", capital(mode.name()), mode.hint()));
    }
}

fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |first| first.to_uppercase().chain(chars).collect())
}
