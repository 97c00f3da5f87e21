//! Tests through the public functions, on pictures painted here.

mod files;
mod light;
mod mappings;
mod suns;

use super::*;
use glam::DVec3;

/// A shape of about this many texels along its longer side that suits the mapping.
pub(crate) fn shape(mapping: Mapping, size: u32) -> (u32, u32) {
    match mapping {
        Mapping::LatLong => (size, size / 2),
        Mapping::VerticalCross => (size / 4 * 3, size / 4 * 4),
        Mapping::HorizontalCross => (size / 4 * 4, size / 4 * 3),
        Mapping::Angular | Mapping::MirroredBall | Mapping::Octahedral => (size, size),
    }
}

/// A picture of radiance by direction, black where it shows nothing.
pub(crate) fn painted(
    mapping: Mapping,
    size: u32,
    radiance: impl Fn(DVec3) -> [f32; 3],
) -> Picture {
    let (width, height) = shape(mapping, size);
    let mut rgb = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let u = (f64::from(x) + 0.5) / f64::from(width);
            let v = (f64::from(y) + 0.5) / f64::from(height);
            rgb.push(mapping.direction(u, v).map_or([0.0; 3], &radiance));
        }
    }
    Picture { width, height, rgb }
}

/// Direction of a texel of the octahedral map, as shaders have it.
pub(crate) fn of_map(probe: &Probe, i: u32, j: u32) -> DVec3 {
    let last = f64::from(probe.facts.side - 1);
    let place = |i: u32| 2.0 * f64::from(i) / last - 1.0;
    let (x, y) = (place(i), place(j));
    let z = 1.0 - x.abs() - y.abs();
    let t = (-z).max(0.0);
    DVec3::new(x + if x >= 0.0 { -t } else { t }, y + if y >= 0.0 { -t } else { t }, z)
        .normalize_or_zero()
}

/// The probe of a picture that is right.
pub(crate) fn probe(picture: Picture, mapping: Mapping) -> Probe {
    Probe::from_picture("test", picture, Some(mapping)).unwrap_or_else(|fault| panic!("{fault}"))
}
