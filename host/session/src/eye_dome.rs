//! Where eye-dome lighting is.
//!
//! Depth is the only cue of shape where surfels have no normal worth shading. These are the ones that are displayed as
//! round splats: those whose surroundings are no plane, and all of a cloud that is shown as points. Where they are a
//! quarter of what is shown, or more, its pictures are darkened unless somebody says otherwise. What is measured is
//! darkened only where somebody says so: errors are those of the light that renderers give.

use crate::input::clouds::Clouds;
use surfelshop_api::columns::ROUND;
use surfelshop_cloud::scene::{EyeDomeLighting, EyeDomeUse};
use surfelshop_cloud::{Buffer, Cloud, Column};
use surfelshop_image::EyeDome;

/// The share of surfels that are round splats from which on pictures are darkened.
const SHARE_OF_ROUND: f64 = 0.25;

/// How pictures of clouds, as they are displayed, are darkened; `None` where they are not.
#[must_use]
pub fn shown(lighting: &EyeDomeLighting, clouds: &Clouds) -> Option<EyeDome> {
    match lighting.when {
        EyeDomeUse::Automatic if are_round(clouds) => some(lighting),
        EyeDomeUse::Automatic => None,
        EyeDomeUse::On | EyeDomeUse::Off => measured(lighting),
    }
}

/// How pictures that are measured are darkened.
#[must_use]
pub fn measured(lighting: &EyeDomeLighting) -> Option<EyeDome> {
    if lighting.when == EyeDomeUse::On { some(lighting) } else { None }
}

fn some(lighting: &EyeDomeLighting) -> Option<EyeDome> {
    let EyeDomeLighting { strength, radius, .. } = *lighting;
    (strength > 0.0).then_some(EyeDome { strength, radius })
}

/// Whether many surfels are round splats.
fn are_round(clouds: &Clouds) -> bool {
    let clouds = || clouds.loaded.iter().map(|loaded| &loaded.cloud);
    let n_round: u64 = clouds().map(n_round).sum();
    let n: u64 = clouds().map(|cloud| cloud.len() as u64).sum();
    n_round > 0 && n_round as f64 >= SHARE_OF_ROUND * n as f64
}

/// Displayed clouds have their flags as bytes.
fn n_round(cloud: &Cloud) -> u64 {
    match cloud.column(ROUND).map(Column::values) {
        Some(Buffer::U8(flags)) => flags.iter().map(|flag| u64::from(*flag != 0)).sum(),
        _ => 0,
    }
}
