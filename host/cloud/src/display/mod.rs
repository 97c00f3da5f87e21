//! Attributes as colours, and filters by attributes: clouds as they are displayed.
//!
//! [`DisplaySettings`] say what colours surfels and which of them are shown. [`Display::new`] finds what that
//! means for the clouds that are displayed together: the same number has the same colour in all of them.
//! [`Display::of`] makes the cloud that renderers and tracers get: another column `color`, fewer surfels, and
//! what is no surface as round splats, and all else shared. What is plain is displayed as it is, down to the
//! generations of its columns.
//!
//! Invariants: equal columns and settings give columns of equal generations for as long as somebody displays
//! them (`what_is_displayed_is_found_again`); the cloud itself never changes.

mod cache;
mod colors;
mod error;
mod filter;
mod hidden;
mod histogram;
mod keys;
mod legend;
mod maps;
mod palette;
mod rows;
mod scalar;
mod settings;
mod splat_settings;
mod splats;
mod statistics;
mod tables;
#[cfg(test)]
mod tests;
mod ticks;

pub use colors::{Categories, Colors, Ramp};
pub use error::DisplayError;
pub use filter::{Filter, FilterAction, FilterTest};
pub use hidden::{HIDDEN, hidden, hiding, unhidden};
pub use histogram::{HISTOGRAM_BINS, Histogram, histogram};
pub use legend::{Legend, LegendBody, LegendEntry};
pub use maps::{ColorMap, MAP_SIZE};
pub use palette::Palette;
pub use settings::{Attribute, ColorBy, ColorSource, DisplaySettings, MapChoice, RangeEnd, Scale};
pub use splat_settings::{Look, SplatSettings};
pub use statistics::{MOST_CATEGORIES, Statistics};
pub use ticks::{Tick, ticks};

use crate::cloud::Cloud;
use crate::cloud::axis::Axis;
use colors::unknown;
use scalar::Scalar;
use std::sync::Arc;

/// What settings mean for the clouds that are displayed together.
#[derive(Clone, Debug, PartialEq)]
pub struct Display {
    colors: Colors,
    filters: Vec<Filter>,
    splats: SplatSettings,
    up: Axis,
    /// What heights are in, where all clouds say it.
    length_unit: Option<&'static str>,
}

/// A cloud as it is displayed.
#[derive(Clone, Debug)]
pub struct Displayed {
    /// The cloud.
    pub cloud: Cloud,
    /// Indices of its surfels in the cloud that it was made of, ascending; `None` where it has all.
    pub kept: Option<Arc<[u32]>>,
}

impl Displayed {
    /// The index of a surfel in the cloud that it was made of.
    #[must_use]
    pub fn source_index(&self, index: usize) -> usize {
        match &self.kept {
            Some(kept) => kept.get(index).map_or(index, |source| *source as usize),
            None => index,
        }
    }
}

impl Default for Display {
    /// Everything as it is.
    fn default() -> Self {
        let (splats, up) = (SplatSettings::default(), Axis::default());
        Self { colors: Colors::File, filters: Vec::new(), splats, up, length_unit: None }
    }
}

/// The numbers of an attribute, surfel by surfel; NaN where there is none.
pub(crate) fn numbers<'a>(
    cloud: &'a Cloud,
    attribute: &Attribute,
    up: Axis,
) -> Result<impl Fn(usize) -> f64 + Sync + Send + use<'a>, DisplayError> {
    let scalar = Scalar::of(cloud, attribute, up)?;
    let scalar = scalar.ok_or_else(|| unknown(&[cloud], attribute))?;
    Ok(move |index| if index < scalar.len() { scalar.value(index) } else { f64::NAN })
}

/// The unit of coordinates, where all clouds say the same one and it has a sign.
#[must_use]
pub fn length_unit(clouds: &[&Cloud]) -> Option<&'static str> {
    let mut all = clouds.iter().map(|cloud| cloud.source().metres());
    let first = all.next()??;
    if !all.all(|metres| metres == Some(first)) {
        return None;
    }
    // A survey foot is 1200/3937 m.
    let units = [(1.0, "m"), (0.001, "mm"), (0.01, "cm"), (0.3048, "ft"), (1200.0 / 3937.0, "ft")];
    units.into_iter().find(|(metres, _)| (first / metres - 1.0).abs() < 1e-6).map(|(_, sign)| sign)
}

impl Display {
    /// What settings mean for these clouds.
    ///
    /// # Errors
    /// Where a column is in none of them, has fewer components, or its numbers cannot be displayed as asked.
    pub fn new(settings: &DisplaySettings, clouds: &[&Cloud]) -> Result<Self, DisplayError> {
        let DisplaySettings { color, filters, splats, up } = settings;
        for Filter { attribute, .. } in filters {
            let mut has_any = clouds.is_empty();
            for cloud in clouds {
                has_any |= Scalar::of(cloud, attribute, *up)?.is_some();
            }
            if !has_any {
                return Err(unknown(clouds, attribute));
            }
        }
        let colors = Colors::of(color, clouds, *up)?;
        let (filters, length_unit) = (filters.clone(), length_unit(clouds));
        Ok(Self { colors, filters, splats: *splats, up: *up, length_unit })
    }

    /// A cloud as it is displayed. Clouds without the attribute of a filter are shown whole, and those without
    /// the attribute that colours others are neutral.
    ///
    /// # Errors
    /// Where there is no memory for it.
    pub fn of(&self, cloud: &Cloud) -> Result<Displayed, DisplayError> {
        let recolors = self.colors != Colors::File;
        let rows = rows::filtered(cloud, &self.filters, self.up)?;
        let shown = match &rows {
            Some(rows) => rows.of(cloud, recolors)?,
            None => cloud.clone(),
        };
        let shown = match self.colors.column(&shown, self.up)? {
            Some(column) => shown.recolored(column),
            None => shown,
        };
        let cloud = self.splats.applied(shown)?;
        Ok(Displayed { cloud, kept: rows.map(|rows| rows.indices) })
    }

    /// What colours the clouds.
    #[must_use]
    pub fn colors(&self) -> &Colors {
        &self.colors
    }

    /// The filters.
    #[must_use]
    pub fn filters(&self) -> &[Filter] {
        &self.filters
    }

    /// How surfels look.
    #[must_use]
    pub fn splats(&self) -> &SplatSettings {
        &self.splats
    }

    /// What the colours mean; `None` where they say nothing of numbers.
    #[must_use]
    pub fn legend(&self) -> Option<Legend> {
        let legend = Legend::of(&self.colors, &self.filters)?;
        let unit = match &self.colors {
            Colors::Ramp(ramp) if ramp.attribute == Attribute::Height => self.length_unit,
            _ => legend.unit,
        };
        Some(Legend { unit, ..legend })
    }

    /// The number of a surfel in an attribute; `None` where the cloud lacks it or the surfel.
    #[must_use]
    pub fn number(&self, cloud: &Cloud, attribute: &Attribute, index: usize) -> Option<f64> {
        let scalar = Scalar::of(cloud, attribute, self.up).ok()??;
        (index < scalar.len()).then(|| scalar.value(index))
    }
}
