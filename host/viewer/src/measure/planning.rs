//! The plan of a measurement is derived from the window: when it begins, and again in each frame to tell
//! whether its result is stale.

use super::form::ReferenceChoice;
use super::plan::{Basis, Kind, MOST_PIXELS, Plan, ReferenceSource, Subject, with};
use crate::document::PaneSettings;
use crate::window::Window;
use std::path::PathBuf;
use surfelshop_api::params::Values;
use surfelshop_session::eye_dome;

/// Most values of a series: a renderer stays loaded for each, so that they are timed in turns.
const MOST_VALUES: usize = 16;

/// The basis of a measurement made now; an error in one line where nothing can be measured.
pub(crate) fn basis(window: &Window, kind: Kind) -> Result<Basis, String> {
    let shown = window.document.complete_clouds().ok_or("open a cloud first")?;
    let pane = window.settings.pane(window.views.focused).ok_or("no view is chosen")?;
    if pane.clouds.iter().take(pane.mode.sides()).any(Option::is_some) {
        let line = "the view shows one of several clouds, and all are measured";
        return Err(format!("{line}; choose all clouds under Compare"));
    }
    let form = &window.measure.form;
    let knob = form.knob(window);
    let side = form.side(pane);
    let of = |side: usize| (pane.renderers[side].clone(), pane.values_of(side));
    let (renderers, knob) = match kind {
        Kind::CurrentView => ((0..pane.mode.sides()).map(of).collect(), None),
        Kind::Series => {
            let (name, mut values) = of(side);
            let knob = knob.ok_or_else(|| format!("choose a parameter of `{name}` to vary"))?;
            values.remove(&knob.id);
            (vec![(name, values)], Some(knob.id.clone()))
        }
    };
    let settings = &window.settings;
    let source = source(window, pane)?;
    let named = shown.named();
    if !named.is_empty() && named.iter().all(Option::is_some) {
        let line = "every cloud names a renderer, and none is left to be measured";
        return Err(format!("{line}; choose `as the view` for one in the list of clouds"));
    }
    Ok(Basis {
        pane: pane.id,
        renderers,
        named,
        knob,
        size: match source {
            ReferenceSource::Picture(_) => None,
            _ => Some(form.size_px(window)),
        },
        source,
        camera: window.camera_of(pane.id),
        scene: settings.scene.clone(),
        environment: settings.environment.clone(),
        display: settings.display_transform(),
        antialias: settings.antialias,
        tint_backs: settings.splats.tint_backs,
        eye_dome: eye_dome::measured(&settings.eye_dome),
        revision: shown.revision,
        n_redrawn: window.measure.n_redrawn,
    })
}

/// The chosen reference, with its values.
fn source(window: &Window, pane: &PaneSettings) -> Result<ReferenceSource, String> {
    let form = &window.measure.form;
    match form.against(window) {
        ReferenceChoice::Itself => {
            let side = form.side(pane);
            let name = pane.renderers[side].clone();
            let knob = form.knob(window).ok_or("choose a knob, or another reference")?;
            let values = with(pane.values_of(side), knob, &form.best)?;
            Ok(ReferenceSource::Renderer { name, values })
        }
        ReferenceChoice::Renderer(name) => {
            // Its values in this view, else in the first view that shows it.
            let here = std::iter::once(pane).chain(&window.settings.panes);
            let values = here.filter_map(|pane| pane.values.get(&name)).next().cloned();
            Ok(ReferenceSource::Renderer { name, values: values.unwrap_or_default() })
        }
        ReferenceChoice::Tracer(name) => {
            let values = form.tracer_values.get(&name).cloned().unwrap_or_default();
            Ok(ReferenceSource::Tracer { name, values })
        }
        ReferenceChoice::Picture => match form.path.trim() {
            "" => Err("choose a picture to measure against".to_owned()),
            path => Ok(ReferenceSource::Picture(PathBuf::from(path))),
        },
    }
}

/// The plan of a measurement made now; an error in one line where nothing can be measured.
pub(crate) fn plan(window: &Window, kind: Kind) -> Result<Plan, String> {
    let basis = basis(window, kind)?;
    let shown = window.document.complete_clouds().ok_or("open a cloud first")?;
    if let Some([width, height]) = basis.size {
        let n_pixels = u64::from(width) * u64::from(height);
        if n_pixels == 0 || n_pixels > MOST_PIXELS {
            return Err(format!("expected 1 to {MOST_PIXELS} pixels, found {width} x {height}"));
        }
    }
    let subjects = match kind {
        Kind::CurrentView => current_view(&basis),
        Kind::Series => series(window, &basis)?,
    };
    let (clouds, extent) = (shown.clouds.clone(), shown.extent);
    Ok(Plan { basis, subjects, clouds, extent, repeats: window.measure.form.repeats })
}

/// Each renderer once, without the one that is the reference unless it is the only one.
fn current_view(basis: &Basis) -> Vec<Subject> {
    let is_reference = |(renderer, values): &(String, Values)| match &basis.source {
        ReferenceSource::Renderer { name, values: others } => name == renderer && values == others,
        _ => false,
    };
    let mut shown: Vec<&(String, Values)> = basis.renderers.iter().collect();
    shown.dedup();
    if !shown.iter().all(|one| is_reference(one)) {
        shown.retain(|one| !is_reference(one));
    }
    let subject = |(renderer, values): &(String, Values)| Subject {
        knob: "renderer".to_owned(),
        value: renderer.clone(),
        renderer: renderer.clone(),
        values: values.clone(),
    };
    shown.into_iter().map(subject).collect()
}

/// One renderer with its knob at each typed value.
fn series(window: &Window, basis: &Basis) -> Result<Vec<Subject>, String> {
    let form = &window.measure.form;
    let knob = form.knob(window).ok_or("there is no knob to turn")?;
    let (renderer, values) = basis.renderers.first().ok_or("there is no renderer")?;
    let mut subjects = Vec::<Subject>::new();
    for value in form.values() {
        // Equal values would be points above each other.
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
