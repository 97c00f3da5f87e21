//! The environment map of the settings is chosen.

use crate::window::Window;
use std::path::Path;
use surfelshop_cloud::scene::{ProbeSource, SceneEnvironment};
use surfelshop_session::input::environment_map::standing;

/// Chooses an environment map, with the orientation of the present one.
pub(crate) fn set_environment_map(window: &mut Window, source: ProbeSource) {
    let before = window.settings.environment.take();
    let new = standing(source.clone(), window.document.up);
    // The mapping belongs to the old file; the orientation is the user's choice.
    let turned = before.map(|old| SceneEnvironment { source, mapping: None, ..old });
    window.settings.environment = Some(turned.unwrap_or(new));
}

/// Chooses an environment map from a file.
pub(crate) fn set_environment_file(window: &mut Window, path: &Path) {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    set_environment_map(window, ProbeSource::File(path));
}
