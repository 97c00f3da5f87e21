//! # `eraser`: surfels taken away
//!
//! | parameter | type  | default | meaning                                   |
//! |-----------|-------|---------|-------------------------------------------|
//! | `least`   | float | 0.5     | surfels of at least this weight are gone  |

use surfelshop_api::prelude::*;

params! {
    /// Settings of `eraser`.
    pub struct Settings {
        /// Surfels that the stroke concerns at least so much are taken away: less takes more of its edge.
        least: f32 { default: 0.5, range: 0.0..=1.0 },
    }
}

/// The tool.
pub(crate) struct Eraser;

impl Tool for Eraser {
    const INFO: UnitInfo = UnitInfo::new("eraser", "Eraser", "Takes surfels away along a stroke.");
    const HANDLING: Handling = Handling::STROKE;
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let stays: Vec<bool> = cloud.weights().iter().map(|w| *w < params.least).collect();
        job.edit(&Edit::Keep(stays.into()))
    }
}
