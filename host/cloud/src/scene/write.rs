//! Saving a scene: always the same text for the same scene.

use super::angle::degrees;
use super::color::{color_entries, filter_entries};
use super::display::{Backdrop, EyeDomeLighting, ToneMap};
use super::environment::{ProbeSource, SceneEnvironment};
use super::error::{SceneFault, SceneWriteError};
use super::file::{SceneCloud, SceneFile, SceneView};
use super::keyed::Keyed;
use super::light::light_entries;
use super::limits::{FORMAT, LARGEST_FILE};
use super::measures::table;
use super::parts::channel;
use super::paths;
use super::read::{check, is_scene};
use super::splats::splat_entries;
use crate::cloud::transform::{Rotation, Transform};
use crate::error::quoted;
use crate::files::replace;
use crate::toml_text::{
    Entries, Node, color, entry, float, lines, parameter, vector, with_unknown,
};
use glam::{DVec3, Vec3};
use std::path::{MAIN_SEPARATOR, Path, PathBuf};
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{Camera, Projection, SurfaceSettings};
use toml::Value;

/// The first line of every file.
const HEADING: &str = "# A Surfelshop scene: angles in degrees, paths from this folder.\n";

impl SceneFile {
    /// Writes the scene; relative paths are named anew where the folder is another than it was
    /// read from.
    ///
    /// The file is written beside its target and renamed when it is complete, so that a failure or
    /// a crash leaves what stood there before.
    ///
    /// # Errors
    /// Where the name does not end in `.toml`, a path of a cloud is not UTF-8, the scene holds
    /// what [`read()`](super::read()) would refuse, or the system refuses.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), SceneWriteError> {
        let path = path.as_ref();
        if !is_scene(path) {
            let ending = path.extension().unwrap_or_default();
            let found = match ending.is_empty() {
                true => "no ending".to_owned(),
                false => quoted(format!(".{}", ending.to_string_lossy()).as_bytes()),
            };
            return Err(SceneWriteError::Name { path: path.to_owned(), found });
        }
        let text = self.text(path)?;
        let content = |fault| SceneWriteError::Content { path: path.to_owned(), fault };
        if text.len() as u64 > LARGEST_FILE {
            return Err(content(SceneFault::TooLarge));
        }
        check(&text).map_err(content)?;
        let failed = |error| SceneWriteError::Io { path: path.to_owned(), error };
        replace(path, |file| file.write_all(text.as_bytes()).map_err(failed), failed)
    }

    /// The scene as the text of a file at `path`.
    fn text(&self, path: &Path) -> Result<String, SceneWriteError> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut clouds = Vec::with_capacity(self.clouds.len());
        for cloud in &self.clouds {
            let named = |file: &PathBuf| {
                path_text(&paths::moved(file, &self.folder, folder)).ok_or_else(|| {
                    SceneWriteError::Cloud { path: path.to_owned(), cloud: file.clone() }
                })
            };
            let layer = cloud.layer.as_ref().map(named).transpose()?;
            clouds.push(cloud_entries(cloud, named(&cloud.path)?, layer));
        }
        let tone_map = match self.tone_map {
            ToneMap::Clamp => "clamp",
            ToneMap::Neutral => "neutral",
        };
        let mut entries = vec![
            entry("format", FORMAT),
            entry("exposure", float(self.exposure_stops)),
            entry("tone_map", tone_map),
            entry("background", backdrop(self.background)),
        ];
        if self.antialias != 1 {
            entries.push(entry("antialias", i64::from(self.antialias)));
        }
        entries.extend(eye_dome_entries(self.eye_dome));
        if let Some(up) = self.up {
            entries.push(entry("up", up.name()));
        }
        let lights: Vec<Entries> = self.lights.iter().map(light_entries).collect();
        // Without the key a scene has the usual light.
        entries.push(match lights.is_empty() {
            true => entry("lights", Value::Array(Vec::new())),
            false => ("lights".to_owned(), Node::Tables(lights)),
        });
        if let Some(environment) = &self.environment {
            let probe = self.probe_text(environment, path, folder)?;
            let entries_of = environment_entries(environment, probe);
            entries.push(("environment".to_owned(), Node::Table(entries_of)));
        }
        entries.push(("surface".to_owned(), Node::Table(surface_entries(&self.surface))));
        if let Some(color) = color_entries(&self.color) {
            entries.push(("color".to_owned(), Node::Table(color)));
        }
        let filters = self.filters.iter().map(filter_entries).collect();
        entries.push(("filter".to_owned(), Node::Tables(filters)));
        if let Some(splats) = splat_entries(&self.splats) {
            entries.push(("splats".to_owned(), Node::Table(splats)));
        }
        if let Some(camera) = &self.camera {
            entries.push(("camera".to_owned(), Node::Table(camera_entries(camera))));
        }
        entries.push(("clouds".to_owned(), Node::Tables(clouds)));
        let measures = self.measures.iter().map(table::entries).collect();
        entries.push(("measure".to_owned(), Node::Tables(measures)));
        let views = self.views.iter().map(view_entries).collect();
        entries.push(("views".to_owned(), Node::Tables(views)));
        if !self.layout.is_empty() {
            entries.push(("layout".to_owned(), Node::from(&Value::Table(self.layout.clone()))));
        }
        with_unknown(&mut entries, &self.unknown);
        let mut text = HEADING.to_owned();
        lines(&mut text, "", &entries);
        Ok(text)
    }
}

impl SceneFile {
    fn probe_text(
        &self,
        environment: &SceneEnvironment,
        path: &Path,
        folder: &Path,
    ) -> Result<String, SceneWriteError> {
        match &environment.source {
            ProbeSource::Studio => Ok("studio".to_owned()),
            ProbeSource::Sky => Ok("sky".to_owned()),
            ProbeSource::File(file) => {
                let moved = paths::moved(file, &self.folder, folder);
                // A file of a built-in one's name is told from it by its folder.
                let named = match path_text(&moved).as_deref() {
                    Some(name @ ("studio" | "sky")) => Some(format!("./{name}")),
                    _ => path_text(&moved),
                };
                let unnamed =
                    || SceneWriteError::Cloud { path: path.to_owned(), cloud: file.clone() };
                named.ok_or_else(unnamed)
            }
        }
    }
}

fn environment_entries(environment: &Keyed<SceneEnvironment>, probe: String) -> Entries {
    let mut entries = vec![entry("probe", probe)];
    if let Some(mapping) = environment.mapping {
        entries.push(entry("mapping", mapping.name()));
    }
    entries.extend([
        entry("forward", environment.forward.name()),
        entry("up", environment.up.name()),
        entry("rotation", degrees(environment.rotation)),
        entry("exposure", float(environment.stops)),
    ]);
    with_unknown(&mut entries, &environment.unknown);
    entries
}

/// A path as text, with forward slashes where it is relative.
fn path_text(path: &Path) -> Option<String> {
    let text = path.to_str()?;
    let is_slash = MAIN_SEPARATOR == '/' || path.is_absolute();
    Some(if is_slash { text.to_owned() } else { text.replace(MAIN_SEPARATOR, "/") })
}

fn cloud_entries(cloud: &Keyed<SceneCloud>, path: String, layer: Option<String>) -> Entries {
    let mut entries = vec![entry("path", path)];
    if let Some(name) = &cloud.name {
        entries.push(entry("name", name.as_str()));
    }
    if !cloud.visible {
        entries.push(entry("visible", false));
    }
    if let Some(hidden) = &cloud.hidden {
        entries.push(entry("hidden", hidden.text()));
    }
    entries.extend(layer.map(|layer| entry("layer", layer)));
    if let Some(transform) = &cloud.transform {
        entries.push(("transform".to_owned(), Node::Table(transform_entries(transform))));
    }
    if let Some(renderer) = &cloud.renderer {
        entries.push(entry("renderer", renderer.name.as_str()));
        entries.extend(values_entry(&renderer.values));
    }
    with_unknown(&mut entries, &cloud.unknown);
    entries
}

fn transform_entries(transform: &Keyed<Transform>) -> Entries {
    let rotation = match transform.rotation {
        Rotation::Euler(angles) => entry("rotation", vector(angles.to_array().map(degrees))),
        Rotation::Quaternion(turn) => entry("quaternion", vector(turn.to_array())),
    };
    let translation = entry("translation", vector(transform.translation.to_array()));
    let mut entries = vec![translation, rotation, entry("scale", transform.scale)];
    with_unknown(&mut entries, &transform.unknown);
    entries
}

fn camera_entries(camera: &Keyed<Camera>) -> Entries {
    let place = |key: &str, place: DVec3| entry(key, vector(place.to_array()));
    let Camera { eye, target, up, projection } = camera.known;
    let projection = match projection {
        Projection::Perspective { fov_y } => entry("fov", degrees(fov_y)),
        Projection::Orthographic { height } => entry("height", height),
    };
    let mut entries = vec![place("eye", eye), place("target", target), place("up", up), projection];
    with_unknown(&mut entries, &camera.unknown);
    entries
}

fn surface_entries(surface: &Keyed<SurfaceSettings>) -> Entries {
    let SurfaceSettings { depth_tolerance, two_sided, radius_scale, low_pass } = surface.known;
    let mut entries = vec![
        entry("depth_tolerance", float(depth_tolerance)),
        entry("two_sided", two_sided),
        entry("radius_scale", float(radius_scale)),
        entry("low_pass", float(low_pass)),
    ];
    with_unknown(&mut entries, &surface.unknown);
    entries
}

/// The table `values`; none where there are none.
fn values_entry(values: &Values) -> Option<(String, Node)> {
    let entries = values.iter().map(|(id, value)| entry(id, parameter(value)));
    (!values.is_empty()).then(|| ("values".to_owned(), Node::Table(entries.collect())))
}

fn view_entries(view: &Keyed<SceneView>) -> Entries {
    let mut entries = vec![entry("renderer", view.renderer.as_str())];
    if view.output != Output::Color {
        entries.push(entry("output", view.output.name()));
    }
    entries.extend(values_entry(&view.values));
    if let Some(camera) = &view.camera {
        entries.push(("camera".to_owned(), Node::Table(camera_entries(camera))));
    }
    with_unknown(&mut entries, &view.unknown);
    entries
}

/// What is not as usual.
fn eye_dome_entries(eye_dome: EyeDomeLighting) -> Entries {
    let EyeDomeLighting { when, strength, radius } = eye_dome;
    let usual = EyeDomeLighting::default();
    let is_other = |a: f32, b: f32| a.to_bits() != b.to_bits();
    let when = (when != usual.when).then(|| entry("eye_dome_lighting", when.name()));
    let strength =
        is_other(strength, usual.strength).then(|| entry("eye_dome_strength", float(strength)));
    let radius = is_other(radius, usual.radius).then(|| entry("eye_dome_radius", float(radius)));
    when.into_iter().chain(strength).chain(radius).collect()
}

fn backdrop(backdrop: Backdrop) -> Value {
    match backdrop {
        Backdrop::Transparent => "transparent".into(),
        Backdrop::Color(linear) => short_color(linear),
        Backdrop::Gradient { top, bottom } => Value::Array([top, bottom].map(short_color).to_vec()),
    }
}

/// `#rrggbb` where that is read as this very colour.
fn short_color(linear: [f32; 3]) -> Value {
    let code = |value: &f32| (0..=u8::MAX).find(|code| channel(*code) == *value);
    let codes: Vec<u8> = linear.iter().filter_map(code).collect();
    match codes[..] {
        [red, green, blue] => format!("#{red:02x}{green:02x}{blue:02x}").into(),
        _ => color(Vec3::from(linear)),
    }
}
