//! Clouds are coloured and filtered, where that takes time on a thread of its own.

use crate::document::open_clouds::OpenClouds;
use eframe::egui::Context;
use std::sync::mpsc::{Receiver, channel};
use surfelshop_cloud::display::{ColorSource, DisplaySettings};
use surfelshop_cloud::selection::Tint;
use surfelshop_session::input::displayed::{DisplayedClouds, Selected};
use surfelshop_session::options::camera::Extent;

/// Surfels that are coloured and filtered between two frames of the window: some take ten milliseconds.
const AT_ONCE: u64 = 300_000;

/// What clouds are displayed of, and how.
#[derive(Clone)]
pub(crate) struct DisplayInputs {
    pub(crate) open_clouds: OpenClouds,
    pub(super) settings: DisplaySettings,
    /// What is selected of each visible cloud, and tinted.
    pub(super) selections: Vec<Option<Selected>>,
    pub(super) tint: Tint,
    pub(super) radius_scale: f32,
}

/// Clouds as they are displayed.
pub(super) struct DisplayOutcome {
    pub(super) displayed: DisplayedClouds,
    pub(super) extent: Extent,
    /// Why they are not displayed as the settings say.
    pub(super) error: Option<String>,
}

impl DisplayInputs {
    /// Whether what is displayed of these is the same.
    pub(super) fn is_alike(&self, other: &Self) -> bool {
        // The factor on radii changes the extent alone, which follows it.
        let same = |pair: (&Option<Selected>, &Option<Selected>)| match pair {
            (Some(one), Some(other)) => one.is_same(other),
            (one, other) => one.is_none() && other.is_none(),
        };
        self.settings == other.settings
            && self.tint == other.tint
            && self.open_clouds == other.open_clouds
            && self.selections.len() == other.selections.len()
            && self.selections.iter().zip(&other.selections).all(same)
    }

    /// Whether that takes no time.
    pub(super) fn is_quick(&self) -> bool {
        let loaded = &self.open_clouds.clouds.loaded;
        let is_plain = self.settings.is_plain(loaded.iter().map(|loaded| &loaded.cloud))
            && self.selections.iter().all(Option::is_none);
        is_plain || self.open_clouds.clouds.facts.n_surfels <= AT_ONCE
    }

    /// Colours and filters the clouds. Where that fails they are shown without colours, without filters or
    /// as they are.
    pub(super) fn run(&self) -> DisplayOutcome {
        let whole = &self.open_clouds.clouds;
        let plain = ColorSource::default();
        let uncolored = DisplaySettings { color: plain, ..self.settings.clone() };
        let unfiltered = DisplaySettings { filters: Vec::new(), ..self.settings.clone() };
        let mut error = None;
        for settings in [&self.settings, &uncolored, &unfiltered] {
            let displayed =
                DisplayedClouds::new(whole, settings).map_err(|error| error.to_string());
            let tinted = |displayed: DisplayedClouds| {
                displayed.tinted(&self.selections, self.tint).map_err(|error| error.to_string())
            };
            match displayed.and_then(tinted) {
                Ok(displayed) => {
                    let extent = displayed.clouds.extent(self.radius_scale);
                    return DisplayOutcome { displayed, extent, error };
                }
                Err(failed) => error = error.or(Some(failed)),
            }
        }
        let extent = whole.extent(self.radius_scale);
        DisplayOutcome { displayed: DisplayedClouds::plain(whole), extent, error }
    }
}

/// Clouds that are being coloured and filtered.
pub(crate) struct DisplayJob {
    pub(super) inputs: DisplayInputs,
    pub(super) outcome: Receiver<DisplayOutcome>,
}

impl DisplayJob {
    pub(super) fn start(inputs: DisplayInputs, ctx: &Context) -> std::io::Result<Self> {
        let (send, outcome) = channel();
        let (work, ctx) = (inputs.clone(), ctx.clone());
        std::thread::Builder::new().name("colours".to_owned()).spawn(move || {
            // The window may be closed already.
            drop(send.send(work.run()));
            ctx.request_repaint();
        })?;
        Ok(Self { inputs, outcome })
    }
}
