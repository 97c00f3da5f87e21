//! How surfels look: discs of their radius, or round splats that face the eye.
//!
//! What is no surface (leaves, wires, single points) has no plane that a disc could lie in. Where the column
//! `planarity` says so, surfels are displayed with a column `round`, by which renderers draw them facing the eye.

use super::cache;
use super::error::DisplayError;
use super::keys::SplatKey;
use super::splat_settings::{Look, SplatSettings};
use crate::cloud::Cloud;
use crate::cloud::buffer::Buffer;
use crate::cloud::column::Column;
use crate::memory::ask;
use rayon::prelude::*;
use surfelshop_api::columns::{CLIP, NORMAL_FIELD, PLANARITY, RADIUS, ROUND, TANGENT_U, TANGENT_V};

/// The share of the diagonal of a cloud's box that the radius of points is which are as large as the low-pass: far
/// below a pixel from wherever the whole of it is seen.
const TINY: f64 = 1e-7;

impl SplatSettings {
    /// The cloud with radii and round splats as these settings say.
    ///
    /// # Errors
    /// Where there is no memory for it.
    pub(super) fn applied(&self, cloud: Cloud) -> Result<Cloud, DisplayError> {
        if self.leaves(&cloud) || cloud.is_empty() {
            return Ok(cloud);
        }
        let Look::Points { radius } = self.look else { return self.surface(cloud) };
        let facts = cloud.facts();
        let diagonal = (facts.bounds_max - facts.bounds_min).length();
        let tiny = (TINY * diagonal).max(f64::from(f32::MIN_POSITIVE)) as f32;
        let radius = radius.max(tiny);
        let n = cloud.len();
        let radii = cache::splats(SplatKey::Same(n, radius.to_bits()), || {
            ask(4 * n as u64)?;
            Ok::<_, DisplayError>(Column::new(RADIUS, 1, Buffer::F32(vec![radius; n])))
        })?;
        let round = cache::splats(SplatKey::AllRound(n), || {
            ask(n as u64)?;
            Ok::<_, DisplayError>(Column::new(ROUND, 1, Buffer::U8(vec![1; n])))
        })?;
        let shown = [TANGENT_U, TANGENT_V, NORMAL_FIELD, CLIP]
            .iter()
            .fold(cloud, |cloud, name| cloud.displayed_without(name));
        Ok(shown.displayed_with(radii).displayed_with(round))
    }

    fn surface(&self, cloud: Cloud) -> Result<Cloud, DisplayError> {
        let mut shown = cloud.clone();
        if let (Some(largest), Some(column)) = (self.largest_radius, cloud.column(RADIUS))
            && cloud.radii().iter().any(|radius| *radius > largest)
        {
            let key = SplatKey::AtMost(column.generation(), largest.to_bits());
            let radii = cache::splats(key, || {
                ask(4 * cloud.len() as u64)?;
                let radii = cloud.radii().par_iter().map(|radius| radius.min(largest));
                Ok::<_, DisplayError>(Column::new(RADIUS, 1, Buffer::F32(radii.collect())))
            })?;
            shown = shown.displayed_with(radii);
        }
        if let Some(column) = cloud.column(PLANARITY)
            && let Buffer::F32(planarity) = column.values()
            && column.components() == 1
            && planarity.iter().any(|planarity| *planarity < self.round_below)
        {
            let key = SplatKey::Round(column.generation(), self.round_below.to_bits());
            let round = cache::splats(key, || {
                ask(cloud.len() as u64)?;
                let round = planarity.par_iter().map(|p| u8::from(*p < self.round_below));
                Ok::<_, DisplayError>(Column::new(ROUND, 1, Buffer::U8(round.collect())))
            })?;
            shown = shown.displayed_with(round);
        }
        Ok(shown)
    }
}
