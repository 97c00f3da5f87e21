//! What is to be measured, against what: read off the window when it begins, and again in each frame
//! to tell whether a result still stands.

use super::form::Against;
use crate::camera::Extent;
use crate::clouds::Clouds;
use crate::sweep::knobs::typed;
use crate::viewer::settings::PaneSettings;
use crate::viewer::window::Window;
use std::path::PathBuf;
use std::sync::Arc;
use surfelshop_api::params::{ParamDecl, Values};
use surfelshop_api::{Camera, Scene};
use surfelshop_cloud::scene::SceneEnvironment;
use surfelshop_engine::picture::Development;

/// Most pixels of a picture that is measured, a screen of 7680 x 4320: comparing two takes some 200
/// bytes for each.
pub(crate) const MOST_PIXELS: u64 = 7680 * 4320;

/// Most values of a sweep at once: a renderer stays ready for each, so that they are timed in turns.
const MOST_VALUES: usize = 16;

/// Which of the two measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Of the present picture of each side of the view.
    Present,
    /// Of one renderer while its knob turns.
    Sweep,
}

/// Where the picture comes from that others are measured against.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Source {
    Renderer { name: String, values: Values },
    Tracer { name: String, values: Values },
    Picture(PathBuf),
}

impl Source {
    /// In words, with the values that are not at their default.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::Picture(path) => path.display().to_string(),
            Self::Renderer { name, values } | Self::Tracer { name, values } => {
                let set = values.iter().map(|(id, value)| format!("{id}={}", typed(value)));
                let set = set.collect::<Vec<_>>().join(" ");
                if set.is_empty() { name.clone() } else { format!("{name} {set}") }
            }
        }
    }
}

/// Everything that numbers depend on; a result is stale where it is another one now.
#[derive(Clone, PartialEq)]
pub(crate) struct Basis {
    /// The view, by its number.
    pub(crate) pane: u32,
    /// Renderers with their values, that of the knob left out.
    pub(crate) renderers: Vec<(String, Values)>,
    pub(crate) knob: Option<String>,
    pub(crate) source: Source,
    /// Width and height in pixels; none where the picture that is measured against says it.
    pub(crate) size: Option<[u32; 2]>,
    pub(crate) camera: Camera,
    pub(crate) scene: Scene,
    pub(crate) environment: Option<SceneEnvironment>,
    pub(crate) development: Development,
    /// Counts the loads and edits of clouds.
    pub(crate) load: u64,
    /// Counts the pictures that were drawn again since a file had changed.
    pub(crate) remade: u64,
}

impl Basis {
    /// What only the reference depends on.
    pub(crate) fn of_truth(&self) -> Self {
        let (renderers, knob, development) = Default::default();
        Self { pane: 0, renderers, knob, development, ..self.clone() }
    }

    /// What is another now than it was, in a few words.
    pub(crate) fn changed(&self, now: &Self) -> Option<&'static str> {
        let names = |basis: &Self| basis.renderers.iter().map(|r| r.0.clone()).collect::<Vec<_>>();
        let is_of = |basis: &Self| std::mem::discriminant(&basis.source);
        let differs = [
            (self.pane != now.pane, "another view is chosen"),
            (self.load != now.load, "the clouds have changed"),
            (names(self) != names(now), "another renderer is shown"),
            (self.knob != now.knob, "another parameter is chosen"),
            (self.camera != now.camera, "the camera has moved"),
            (self.environment != now.environment, "the environment has changed"),
            (self.scene != now.scene, "light or surface have changed"),
            (self.renderers != now.renderers, "a parameter has changed"),
            (is_of(self) != is_of(now), "another reference is chosen"),
            (self.source != now.source, "the reference has changed"),
            (self.size != now.size, "the size has changed"),
            (self.development != now.development, "highlights or background have changed"),
            (self.remade != now.remade, "a plugin or a file has changed"),
        ];
        differs.into_iter().find_map(|(differs, what)| differs.then_some(what))
    }
}

/// A picture to be measured.
#[derive(Clone, Debug)]
pub(crate) struct Subject {
    /// What sets it apart from the others, and its value of that as typed.
    pub(crate) knob: String,
    pub(crate) value: String,
    pub(crate) renderer: String,
    pub(crate) values: Values,
}

/// A measurement.
pub(crate) struct Plan {
    pub(crate) basis: Basis,
    pub(crate) subjects: Vec<Subject>,
    pub(crate) clouds: Arc<Clouds>,
    pub(crate) extent: Extent,
    /// Frames of each subject that are timed.
    pub(crate) repeats: u32,
}

/// Values with one of them set, or left out where it is the default, as the panels do.
pub(crate) fn with(mut values: Values, declared: &ParamDecl, text: &str) -> Result<Values, String> {
    let value = declared.parse(text)?;
    if value == declared.default {
        values.remove(&declared.id);
    } else {
        values.insert(declared.id.clone(), value);
    }
    Ok(values)
}

/// What numbers would depend on that were measured now; why there is nothing to measure, in a line.
pub(crate) fn basis(window: &Window, kind: Kind) -> Result<Basis, String> {
    let shown = window.shown.as_ref().ok_or("open a cloud first")?;
    let pane = window.settings.pane(window.focused).ok_or("no view is chosen")?;
    let form = &window.measure.form;
    let knob = form.knob(window);
    let side = form.side(pane);
    let of = |side: usize| (pane.renderers[side].clone(), pane.values_of(side));
    let (renderers, knob) = match kind {
        Kind::Present => ((0..pane.mode.sides()).map(of).collect(), None),
        Kind::Sweep => {
            let (name, mut values) = of(side);
            let knob = knob.ok_or_else(|| format!("choose a parameter of `{name}` to turn"))?;
            values.remove(&knob.id);
            (vec![(name, values)], Some(knob.id.clone()))
        }
    };
    let settings = &window.settings;
    let source = source(window, pane)?;
    Ok(Basis {
        pane: pane.id,
        renderers,
        knob,
        size: match source {
            Source::Picture(_) => None,
            _ => Some(form.size_px(window)),
        },
        source,
        camera: window.camera_of(pane.id),
        scene: settings.scene.clone(),
        environment: settings.environment.clone(),
        development: settings.development(),
        load: shown.load,
        remade: window.measure.remade,
    })
}

/// What is chosen to be measured against, with its values.
fn source(window: &Window, pane: &PaneSettings) -> Result<Source, String> {
    let form = &window.measure.form;
    match form.against(window) {
        Against::Itself => {
            let side = form.side(pane);
            let name = pane.renderers[side].clone();
            let knob = form.knob(window).ok_or("choose a knob, or another reference")?;
            let values = with(pane.values_of(side), knob, &form.best)?;
            Ok(Source::Renderer { name, values })
        }
        Against::Renderer(name) => {
            // Its values here, else in the first view that shows it.
            let here = std::iter::once(pane).chain(&window.settings.panes);
            let values = here.filter_map(|pane| pane.values.get(&name)).next().cloned();
            Ok(Source::Renderer { name, values: values.unwrap_or_default() })
        }
        Against::Tracer(name) => {
            let values = form.tracer_values.get(&name).cloned().unwrap_or_default();
            Ok(Source::Tracer { name, values })
        }
        Against::Picture => match form.path.trim() {
            "" => Err("choose a picture to measure against".to_owned()),
            path => Ok(Source::Picture(PathBuf::from(path))),
        },
    }
}

/// What is measured when it begins now; why it cannot, in a line.
pub(crate) fn plan(window: &Window, kind: Kind) -> Result<Plan, String> {
    let basis = basis(window, kind)?;
    let shown = window.shown.as_ref().ok_or("open a cloud first")?;
    if let Some([width, height]) = basis.size {
        let n_pixels = u64::from(width) * u64::from(height);
        if n_pixels == 0 || n_pixels > MOST_PIXELS {
            return Err(format!("expected 1 to {MOST_PIXELS} pixels, found {width} x {height}"));
        }
    }
    let subjects = match kind {
        Kind::Present => present(&basis),
        Kind::Sweep => turned(window, &basis)?,
    };
    let (clouds, extent) = (shown.clouds.clone(), shown.extent);
    Ok(Plan { basis, subjects, clouds, extent, repeats: window.measure.form.repeats })
}

/// Each renderer once; the one that is the reference only where it is alone.
fn present(basis: &Basis) -> Vec<Subject> {
    let is_truth = |(renderer, values): &(String, Values)| match &basis.source {
        Source::Renderer { name, values: others } => name == renderer && values == others,
        _ => false,
    };
    let mut shown: Vec<&(String, Values)> = basis.renderers.iter().collect();
    shown.dedup();
    if !shown.iter().all(|one| is_truth(one)) {
        shown.retain(|one| !is_truth(one));
    }
    let subject = |(renderer, values): &(String, Values)| Subject {
        knob: "renderer".to_owned(),
        value: renderer.clone(),
        renderer: renderer.clone(),
        values: values.clone(),
    };
    shown.into_iter().map(subject).collect()
}

/// One renderer with its knob at each of the values that are typed.
fn turned(window: &Window, basis: &Basis) -> Result<Vec<Subject>, String> {
    let form = &window.measure.form;
    let knob = form.knob(window).ok_or("there is no knob to turn")?;
    let (renderer, values) = basis.renderers.first().ok_or("there is no renderer")?;
    let mut subjects = Vec::<Subject>::new();
    for value in form.values() {
        // Twice the same would be one point above the other.
        if subjects.iter().all(|subject| subject.value != value) {
            let values = with(values.clone(), knob, &value)?;
            let (knob, renderer) = (knob.id.clone(), renderer.clone());
            subjects.push(Subject { knob, value, renderer, values });
        }
    }
    match subjects.len() {
        0 => Err(format!("type values of `{}`, with commas between them", knob.id)),
        1..=MOST_VALUES => Ok(subjects),
        n => Err(format!("expected at most {MOST_VALUES} values of `{}`, found {n}", knob.id)),
    }
}
