//! Opening a scene: the file, its format, and what its sections hold.

use super::error::{SceneError, SceneFault};
use super::file::{CloudRenderer, SceneCloud, SceneFile, SceneView};
use super::keyed::Keyed;
use super::limits::{FORMAT, LARGEST_FILE, MOST_CLOUDS, MOST_FILTERS, MOST_VALUES, MOST_VIEWS};
use super::measures::{MOST_MEASURES, table};
use super::source::{Entry, Fault, Section, Source};
use super::{color, environment, light, parts, splats};
use crate::cloud::selection::SurfelRuns;
use crate::files::{self, OpenFault};
use std::path::{Path, PathBuf};
use surfelshop_api::Scene;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};

/// A scene that was read, and what to say of it.
#[derive(Clone, Debug)]
pub struct OpenedScene {
    /// The file it was read from.
    pub path: PathBuf,
    /// The scene.
    pub scene: SceneFile,
    /// A line for each key that is not known, with the file and the place.
    pub warnings: Vec<String>,
    /// The line of each cloud's path, counted from 1.
    pub cloud_lines: Vec<usize>,
    /// The line of each view's renderer, counted from 1.
    pub view_lines: Vec<usize>,
}

/// Whether a file is a scene, by its name: it ends in `.toml`, in any case.
#[must_use]
pub fn is_scene(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"))
}

/// Reads a scene; its clouds are neither opened nor looked for.
///
/// # Errors
/// One line that names the file, the place, what was expected and what was found.
pub fn read(path: impl AsRef<Path>) -> Result<OpenedScene, SceneError> {
    let path = path.as_ref();
    let without_place = |fault| SceneError { path: path.to_owned(), place: None, fault };
    read_bytes(path, &bytes(path).map_err(without_place)?)
}

/// Reads a scene from the contents of its file.
///
/// # Errors
/// As [`read`].
pub fn read_bytes(path: &Path, bytes: &[u8]) -> Result<OpenedScene, SceneError> {
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let (text, rest) = bytes.split_at(error.valid_up_to());
        let text = String::from_utf8_lossy(text);
        let fault = SceneFault::NotText { byte: rest.first().copied().unwrap_or_default() };
        let place = Some(Source::new(&text).place(text.len()));
        SceneError { path: path.to_owned(), place, fault }
    })?;
    let source = Source::new(text);
    let (mut scene, cloud_lines, view_lines) = scene(&source).map_err(|Fault { at, fault }| {
        SceneError { path: path.to_owned(), place: at.map(|at| source.place(at)), fault }
    })?;
    scene.folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let warnings = source.warnings(&path.display().to_string());
    Ok(OpenedScene { path: path.to_owned(), scene, warnings, cloud_lines, view_lines })
}

/// Why a text would not be read.
pub(super) fn check(text: &str) -> Result<(), SceneFault> {
    let source = Source::new(text);
    scene(&source).map(drop).map_err(|fault| fault.fault)
}

fn bytes(path: &Path) -> Result<Vec<u8>, SceneFault> {
    files::read(path, LARGEST_FILE).map_err(|fault| match fault {
        OpenFault::Io(error) => SceneFault::Io(error),
        OpenFault::NotAFile { found } => SceneFault::NotAFile { found },
        OpenFault::TooLong { .. } => SceneFault::TooLarge,
        OpenFault::Memory(out) => SceneFault::Io(std::io::Error::other(out.to_string())),
    })
}

/// The scene, and the lines of its clouds and views.
fn scene(source: &Source<'_>) -> Result<(SceneFile, Vec<usize>, Vec<usize>), Fault> {
    let table = source.table()?;
    let mut whole = Section::whole(source, table.get_ref());
    check_format(&mut whole)?;
    let mut scene = SceneFile::default();
    if let Some(entry) = whole.find("exposure") {
        scene.exposure_stops = parts::stops(&entry)?;
    }
    if let Some(entry) = whole.find("tone_map") {
        scene.tone_map = parts::tone_map(&entry)?;
    }
    if let Some(entry) = whole.find("background") {
        scene.background = parts::backdrop(&entry)?;
    }
    if let Some(entry) = whole.find("antialias") {
        scene.antialias = parts::antialias(&entry)?;
    }
    parts::eye_dome(&mut whole, &mut scene.eye_dome)?;
    if let Some(entry) = whole.find("camera") {
        scene.camera = Some(parts::camera(entry.section()?)?);
    }
    if let Some(entry) = whole.find("environment") {
        scene.environment = Some(environment::read(entry.section()?)?);
    }
    if let Some(entry) = whole.find("lights") {
        let lights = entry.sections("lights", Scene::MAX_LIGHTS)?;
        scene.lights = lights.into_iter().map(light::light).collect::<Result<_, _>>()?;
    }
    if let Some(entry) = whole.find("surface") {
        scene.surface = parts::surface(entry.section()?)?;
    }
    if let Some(entry) = whole.find("up") {
        scene.up = Some(color::up(&entry)?);
    }
    if let Some(entry) = whole.find("color") {
        scene.color = color::color(entry.section()?)?;
    }
    for section in sections(whole.find("filter"), "filters", MOST_FILTERS)? {
        scene.filters.push(color::filter(section)?);
    }
    if let Some(entry) = whole.find("splats") {
        scene.splats = splats::read(entry.section()?)?;
    }
    for section in sections(whole.find("measure"), "measures", MOST_MEASURES)? {
        scene.measures.push(table::read(section)?);
    }
    let (mut cloud_lines, mut view_lines) = (Vec::new(), Vec::new());
    for section in sections(whole.find("clouds"), "clouds", MOST_CLOUDS)? {
        let (cloud, line) = cloud(section)?;
        scene.clouds.push(cloud);
        cloud_lines.push(line);
    }
    for section in sections(whole.find("views"), "views", MOST_VIEWS)? {
        let (view, line) = view(section)?;
        scene.views.push(view);
        view_lines.push(line);
    }
    if let Some(entry) = whole.find("layout") {
        let toml::Value::Table(layout) = entry.value(0)? else {
            return Err(entry.wrong("a table"));
        };
        scene.layout = layout;
    }
    scene.unknown = whole.unknown()?;
    Ok((scene, cloud_lines, view_lines))
}

fn sections<'a>(
    entry: Option<Entry<'a>>,
    what: &'static str,
    most: usize,
) -> Result<Vec<Section<'a>>, Fault> {
    entry.map_or_else(|| Ok(Vec::new()), |entry| entry.sections(what, most))
}

/// Checked before anything else: what a newer program means by a key is not known here.
fn check_format(whole: &mut Section<'_>) -> Result<(), Fault> {
    let Some(entry) = whole.find("format") else {
        return Err(Fault { at: None, fault: SceneFault::NoFormat });
    };
    match entry.whole() {
        Some(FORMAT) => Ok(()),
        Some(found) if found > FORMAT => {
            Err(Fault { fault: SceneFault::Newer { found }, ..entry.wrong("") })
        }
        _ => Err(entry.wrong(FORMAT.to_string())),
    }
}

/// What `renderer` is.
const A_RENDERER: &str = "the id of a renderer";

/// A cloud and the line of its path.
fn cloud(mut section: Section<'_>) -> Result<(Keyed<SceneCloud>, usize), Fault> {
    let expected = "the path of a cloud";
    let path = section.need("path", expected)?;
    let line = path.line();
    let text = path.text().filter(|text| !text.trim().is_empty() && !text.contains('\0'));
    let mut cloud = SceneCloud::new(text.ok_or_else(|| path.wrong(expected))?);
    if let Some(entry) = section.find("name") {
        let name = entry.text().ok_or_else(|| entry.wrong("a name"))?;
        cloud.name = Some(name.to_owned());
    }
    if let Some(entry) = section.find("visible") {
        cloud.visible = entry.flag()?;
    }
    if let Some(entry) = section.find("hidden") {
        let hidden = entry.text().and_then(SurfelRuns::parse);
        let expected = "what a saved scene has here: hidden surfels, in base 64";
        cloud.hidden = Some(hidden.ok_or_else(|| entry.wrong(expected))?);
    }
    if let Some(entry) = section.find("layer") {
        let expected = "the path of a layer of edits";
        let text = entry.text().filter(|text| !text.trim().is_empty() && !text.contains('\0'));
        cloud.layer = Some(text.ok_or_else(|| entry.wrong(expected))?.into());
    }
    if let Some(entry) = section.find("transform") {
        cloud.transform = Some(parts::transform(entry.section()?)?);
    }
    if let Some(entry) = section.find("renderer") {
        let name = entry.text().filter(|name| !name.trim().is_empty());
        let name = name.ok_or_else(|| entry.wrong(A_RENDERER))?.to_owned();
        cloud.renderer = Some(CloudRenderer { name, values: Values::new() });
    }
    if let Some(entry) = section.find("values") {
        let Some(renderer) = &mut cloud.renderer else {
            return Err(entry.wrong("`renderer` beside it, whose parameters these are"));
        };
        renderer.values = some_values(&entry)?;
    }
    Ok((Keyed { known: cloud, unknown: section.unknown()? }, line))
}

/// A view and the line of its renderer.
fn view(mut section: Section<'_>) -> Result<(Keyed<SceneView>, usize), Fault> {
    let expected = A_RENDERER;
    let renderer = section.need("renderer", expected)?;
    let line = renderer.line();
    let id = renderer.text().filter(|id| !id.trim().is_empty());
    let mut view = SceneView::new(id.ok_or_else(|| renderer.wrong(expected))?);
    if let Some(entry) = section.find("output") {
        let expected = "color, depth, normal, albedo, ao or debug.NAME";
        let output = entry.text().and_then(Output::from_name);
        view.output = output.ok_or_else(|| entry.wrong(expected))?;
    }
    if let Some(entry) = section.find("camera") {
        view.camera = Some(parts::camera(entry.section()?)?);
    }
    if let Some(entry) = section.find("values") {
        view.values = some_values(&entry)?;
    }
    Ok((Keyed { known: view, unknown: section.unknown()? }, line))
}

/// The table `values`.
fn some_values(entry: &Entry<'_>) -> Result<Values, Fault> {
    let section = entry.section()?;
    let found = section.all().count();
    if found > MOST_VALUES {
        return Err(entry.too_many("parameters", MOST_VALUES, found));
    }
    values(&section)
}

/// Parameters of a renderer, which nobody but that renderer can tell to be right.
fn values(section: &Section<'_>) -> Result<Values, Fault> {
    let value = |entry: Entry<'_>| {
        let expected = "true, false, a finite number, a text or a colour of three numbers";
        Ok(match entry.value(0)? {
            toml::Value::Boolean(value) => Value::Bool(value),
            toml::Value::Integer(value) => Value::Int(value),
            toml::Value::String(value) => Value::Text(value),
            toml::Value::Float(value) if value.is_finite() => Value::Float(value),
            toml::Value::Array(_) => Value::Color(parts::floats(&entry, expected, |_| true)?),
            _ => return Err(entry.wrong(expected)),
        })
    };
    section.all().map(|(id, entry)| Ok((id.to_owned(), value(entry)?))).collect()
}
