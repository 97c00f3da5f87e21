//! What is chosen in the panel.

use crate::sweep::knobs::steps;
use crate::viewer::settings::PaneSettings;
use crate::viewer::window::Window;
use std::collections::HashMap;
use surfelshop_api::UnitKind;
use surfelshop_api::params::{ParamDecl, Values};

/// What a measurement is made against.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Against {
    /// The renderer itself with its knob at another value.
    Itself,
    Renderer(String),
    Tracer(String),
    /// A file.
    Picture,
}

/// Frames of each picture that are timed unless another number is chosen: as many as `compare` takes.
const REPEATS: u32 = 5;

/// What is chosen; what is not has the usual value.
pub(crate) struct Form {
    pub(crate) open: bool,
    /// The side of the view whose knob is turned.
    pub(crate) side: usize,
    pub(crate) against: Option<Against>,
    /// Where the knob stands when the renderer is measured against itself.
    pub(crate) best: String,
    /// The picture to measure against.
    pub(crate) path: String,
    /// Parameters of tracers, those at their default left out.
    pub(crate) tracer_values: HashMap<String, Values>,
    /// Whether pictures are as large as the view; else [`Self::size`], pixels.
    pub(crate) as_view: bool,
    pub(crate) size: [u32; 2],
    pub(crate) knob: Option<String>,
    /// Values of the knob with commas between them.
    pub(crate) typed: String,
    /// The renderer and knob whose values are typed.
    typed_for: Option<(String, String)>,
    /// Frames of each picture that are timed, after a first one.
    pub(crate) repeats: u32,
}

impl Default for Form {
    fn default() -> Self {
        Self {
            open: false,
            side: 0,
            against: None,
            best: String::new(),
            path: String::new(),
            tracer_values: HashMap::new(),
            as_view: true,
            size: [640, 480],
            knob: None,
            typed: String::new(),
            typed_for: None,
            repeats: REPEATS,
        }
    }
}

impl Form {
    /// The side whose knob is turned, of those that the view shows.
    pub(crate) fn side(&self, pane: &PaneSettings) -> usize {
        self.side.min(pane.mode.sides() - 1)
    }

    /// The renderer whose knob is turned.
    pub(crate) fn renderer<'a>(&self, window: &'a Window) -> Option<&'a str> {
        let pane = window.settings.pane(window.focused)?;
        Some(&pane.renderers[self.side(pane)])
    }

    /// Parameters of that renderer; none until it was loaded.
    pub(crate) fn declared<'a>(&self, window: &'a Window) -> &'a [ParamDecl] {
        let renderer = self.renderer(window);
        renderer.and_then(|name| window.declared.get(name)).map_or(&[], Vec::as_slice)
    }

    /// The knob: the one chosen, else the first that trades time for quality.
    pub(crate) fn knob<'a>(&self, window: &'a Window) -> Option<&'a ParamDecl> {
        let declared = self.declared(window);
        let chosen = self.knob.as_ref();
        let chosen = chosen.and_then(|id| declared.iter().find(|knob| knob.id == *id));
        chosen.or_else(|| declared.iter().find(|knob| knob.quality))
    }

    /// What is measured against: what was chosen while it is at hand, else the renderer itself at
    /// the end of its knob, or where it has none the view's other renderer.
    pub(crate) fn against(&self, window: &Window) -> Against {
        let is_there = |against: &&Against| match against {
            Against::Itself => self.knob(window).is_some(),
            Against::Renderer(name) => window.renderers().contains(name),
            Against::Tracer(name) => window.registry.names(UnitKind::Tracer).contains(name),
            Against::Picture => true,
        };
        if let Some(chosen) = self.against.as_ref().filter(is_there) {
            return chosen.clone();
        }
        let pane = window.settings.pane(window.focused);
        match (self.knob(window), pane) {
            (None, Some(pane)) => Against::Renderer(pane.renderers[1 - self.side(pane)].clone()),
            _ => Against::Itself,
        }
    }

    /// Size of the pictures in pixels, where no file says it.
    pub(crate) fn size_px(&self, window: &Window) -> [u32; 2] {
        let pane = window.panes.get(&window.focused);
        match self.as_view {
            true => pane.map_or([0, 0], |pane| pane.size_px),
            false => self.size,
        }
    }

    /// The values that are typed.
    pub(crate) fn values(&self) -> impl Iterator<Item = String> {
        let all = self.typed.split(',').map(|value| value.trim().to_owned());
        all.filter(|value| !value.is_empty())
    }

    /// Types the values of another knob: those that `report` takes, and as the best of them the
    /// last, since more costs more with most knobs.
    pub(crate) fn follow(window: &mut Window) {
        let form = &window.measure.form;
        let Some(renderer) = form.renderer(window).map(str::to_owned) else { return };
        let Some(knob) = form.knob(window) else { return };
        let (id, values) = (knob.id.clone(), steps(knob));
        let form = &mut window.measure.form;
        if form.typed_for.as_ref().is_none_or(|of| (&of.0, &of.1) != (&renderer, &id)) {
            form.typed = values.join(", ");
            form.best = values.last().cloned().unwrap_or_default();
            form.typed_for = Some((renderer, id));
        }
    }
}
