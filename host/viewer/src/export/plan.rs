//! The pictures of an export and their file names.

use super::form::ExportKind;
use super::job::ExportPicture;
use crate::render_thread::{Detail, ViewRequest};
use crate::window::Window;
use std::path::{Path, PathBuf};
use surfelshop_api::Camera;
use surfelshop_image::display_transform::Background;
use surfelshop_session::eye_dome;
use surfelshop_session::options::camera;
use surfelshop_session::options::values::OutputFile;
use surfelshop_session::output::files;
use surfelshop_session::output::overlay::Overlay;
use surfelshop_session::render::camera_path;

/// The pictures that the form describes.
pub(super) fn plan(window: &Window, camera: Camera) -> Result<Vec<ExportPicture>, String> {
    let form = &window.panels.export_form;
    let file = OutputFile::parse(form.path.trim());
    let OutputFile { path, format } =
        file.map_err(|reason| format!("`{}`: {reason}", form.path))?;
    files::check_folder(&path).map_err(|error| format!("{error:#}"))?;
    // Absolute, so that messages name the folder.
    let path = std::path::absolute(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let cameras = match form.kind {
        ExportKind::View => vec![camera],
        ExportKind::Turntable => camera_path::turntable(camera, form.n_frames),
        ExportKind::Path if form.keys.len() < 2 => {
            return Err("a path needs two cameras or more".to_owned());
        }
        ExportKind::Path => camera_path::path_of(&form.keys, form.n_frames),
    };
    let shown = window.document.complete_clouds().ok_or("there is nothing to draw yet")?;
    let settings = window.settings.pane(window.views.focused).ok_or("no view is chosen")?;
    let sides = form.renderers.sides();
    let size = size_of(window);
    let parts = [0, 1].map(|side| shown.part(settings.clouds[side].as_ref()));
    let mut display = window.settings.display_transform();
    if form.transparent {
        display.background = Background::Transparent;
    }
    let request = |side: usize, camera: Camera| ViewRequest {
        renderer: settings.renderers[side].clone(),
        values: settings.values_of(side),
        clouds: parts[side].clouds.clone(),
        named: parts[side].named.clone(),
        scene: window.settings.scene.clone(),
        environment: window.settings.environment.clone(),
        display,
        view: camera::framed_view(camera, &shown.extent, size),
        antialias: window.settings.antialias,
        tint_backs: window.settings.splats.tint_backs,
        eye_dome: eye_dome::shown(&window.settings.eye_dome, &shown.clouds),
        detail: Detail::FULL,
        in_motion: false,
        for_measurement: false,
        serial: 0,
    };
    let legend = window.legend().filter(|_| form.legend);
    let measures = match form.measures {
        true => window.drawn_measures(),
        false => Vec::new(),
    };
    let mut pictures = Vec::new();
    // One renderer after the other, so that each is prepared once.
    for &side in sides {
        let mut own = path.clone();
        if sides.len() > 1 {
            own = with_suffix(&own, &format!("{}-{}", side + 1, settings.renderers[side]));
        }
        for (i, &camera) in cameras.iter().enumerate() {
            let path = match cameras.len() {
                1 => own.clone(),
                _ => with_suffix(&own, &format!("{:04}", i + 1)),
            };
            let (request, legend) = (request(side, camera), legend.clone());
            let overlay = Overlay { view: request.view, measures: measures.clone(), legend };
            pictures.push(ExportPicture { request, path, format, overlay });
        }
    }
    Ok(pictures)
}

/// Width and height of the pictures, pixels.
pub(super) fn size_of(window: &Window) -> [u32; 2] {
    let form = &window.panels.export_form;
    let pane = window.views.panes.get(&window.views.focused).filter(|_| form.as_view);
    pane.map(|pane| pane.size_px).filter(|size| !size.contains(&0)).unwrap_or(form.size)
}

/// `pictures/snail.png` with `0007` becomes `pictures/snail-0007.png`.
fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    // A renderer's full name has a slash.
    path.with_file_name(format!("{stem}-{}.{ending}", suffix.replace('/', "-")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suffixes_stand_before_the_ending() {
        let path = with_suffix(Path::new("pictures/snail.exr"), "0007");
        assert_eq!(path, Path::new("pictures/snail-0007.exr"));
        let path = with_suffix(Path::new("snail.exr"), "1-org.example/flat");
        assert_eq!(path, Path::new("snail-1-org.example-flat.exr"));
    }
}
