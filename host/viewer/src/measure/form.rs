//! The fields of the panel.

use crate::document::PaneSettings;
use std::collections::HashMap;
use surfelshop_api::params::Values;

/// The chosen reference.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum ReferenceChoice {
    /// The renderer itself with its knob at another value.
    Itself,
    Renderer(String),
    Tracer(String),
    /// A file.
    Picture,
}

/// Default number of timed frames of each picture, as for `compare`.
const REPEATS: u32 = 5;

/// The fields; what is not chosen has a default.
pub(crate) struct Form {
    pub(crate) open: bool,
    /// The side of the view whose knob is varied.
    pub(crate) side: usize,
    pub(crate) against: Option<ReferenceChoice>,
    /// The knob's value in the reference, where that is the renderer itself.
    pub(crate) best: String,
    /// The reference file.
    pub(crate) path: String,
    /// Parameter values of tracers, without those at their default.
    pub(crate) tracer_values: HashMap<String, Values>,
    /// Whether pictures have the size of the view, and not [`Self::size`], pixels.
    pub(crate) as_view: bool,
    pub(crate) size: [u32; 2],
    pub(crate) knob: Option<String>,
    /// Values of the knob, separated by commas.
    pub(crate) typed: String,
    /// The renderer and knob of the typed values.
    pub(super) typed_for: Option<(String, String)>,
    /// Timed frames of each picture, after a first one.
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
    /// The side whose knob is varied, of those that the view shows.
    pub(crate) fn side(&self, pane: &PaneSettings) -> usize {
        self.side.min(pane.mode.sides() - 1)
    }

    /// The typed values.
    pub(crate) fn values(&self) -> impl Iterator<Item = String> {
        let all = self.typed.split(',').map(|value| value.trim().to_owned());
        all.filter(|value| !value.is_empty())
    }
}
