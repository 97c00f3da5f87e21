//! Colours of the samples, so that no splat blends away what is painted on a surface.

use super::samples::Samples;
use surfelshop_api::columns::{COLOR, Values};
use surfelshop_api::glam::Vec3;
use surfelshop_api::params::linear_to_srgb;
use surfelshop_api::prelude::*;

/// Colours and how much those of one splat may differ.
pub(crate) struct Colors {
    /// For each sample its colour as it is shown: encoded as sRGB, 0 to 1.
    shown: Vec<Vec3>,
    /// Largest difference of a component from the mean.
    tolerance: f32,
}

/// Share of the samples that may differ by more: colours that are measured have noise, and a splat as
/// large as a part of one colour would have to end at the first that is far off.
const STRAY: usize = 50;

impl Colors {
    /// The colours of a cloud; none where it has none, or they are numbers of another type.
    pub(crate) fn of(cloud: &CloudView<'_>, samples: &Samples, tolerance: f64) -> Option<Self> {
        let column = cloud.column(COLOR).filter(|column| column.components >= 3)?;
        let component = |i: usize| match column.values {
            Values::U8(values) => Some(f32::from(values[i]) / 255.0),
            Values::U16(values) => Some(f32::from(values[i]) / 65535.0),
            Values::F32(values) => Some(linear_to_srgb(values[i].clamp(0.0, 1.0))),
            _ => None,
        };
        let n = column.components as usize;
        let shown = samples.index.iter().map(|&i| {
            let first = i as usize * n;
            let color = Vec3::new(component(first)?, component(first + 1)?, component(first + 2)?);
            // What is no number is a colour like any other.
            Some(Vec3::select(color.is_nan_mask(), Vec3::ZERO, color))
        });
        Some(Self { shown: shown.collect::<Option<_>>()?, tolerance: tolerance as f32 })
    }

    /// Whether one colour stands for those of all members but a few.
    pub(crate) fn are_alike(&self, members: &[u32]) -> bool {
        let colors = || members.iter().map(|&i| self.shown[i as usize]);
        let mean = colors().sum::<Vec3>() / members.len().max(1) as f32;
        // Rounding of the mean does not count.
        let most = self.tolerance + 1e-4;
        let differs = |color: &Vec3| (*color - mean).abs().max_element() > most;
        colors().filter(differs).count() <= members.len() / STRAY
    }
}
