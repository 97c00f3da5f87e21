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
use surfelshop_api::columns::{
    CLIP, NORMAL_FIELD, PLANARITY, RADIUS, ROUND, ROUND_UNBOUNDED, TANGENT_U, TANGENT_V,
};

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
        // Somebody asked for this radius: no bound cuts it near the eye.
        let round = cache::splats(SplatKey::AllRound(n), || {
            ask(n as u64)?;
            Ok::<_, DisplayError>(Column::new(ROUND, 1, Buffer::U8(vec![ROUND_UNBOUNDED; n])))
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
            && column.components() == 1
        {
            let below = below(column.values(), self.round_below);
            let n = cloud.len();
            if (0..n).into_par_iter().any(&below) {
                let key = SplatKey::Round(column.generation(), self.round_below.to_bits());
                let round = cache::splats(key, || {
                    ask(n as u64)?;
                    let round = (0..n).into_par_iter().map(|i| u8::from(below(i)));
                    Ok::<_, DisplayError>(Column::new(ROUND, 1, Buffer::U8(round.collect())))
                })?;
                shown = shown.displayed_with(round);
            }
        }
        Ok(shown)
    }
}

/// Whether the planarity of a surfel is below a threshold. Integers of which one is above 1 are shares of the largest
/// that their type has: 255 of eight bits means 1.
fn below(values: &Buffer, threshold: f32) -> impl Fn(usize) -> bool + Sync + '_ {
    let largest = match values {
        Buffer::I8(_) => f64::from(i8::MAX),
        Buffer::U8(_) => f64::from(u8::MAX),
        Buffer::I16(_) => f64::from(i16::MAX),
        Buffer::U16(_) => f64::from(u16::MAX),
        Buffer::I32(_) => f64::from(i32::MAX),
        Buffer::U32(_) => f64::from(u32::MAX),
        Buffer::F32(_) | Buffer::F64(_) => 1.0,
    };
    let is_share = largest > 1.0 && values.iter_f64().any(|value| value > 1.0);
    let unit = if is_share { largest } else { 1.0 };
    let threshold = f64::from(threshold);
    move |i| values.get_f64(i).is_some_and(|value| value / unit < threshold)
}
