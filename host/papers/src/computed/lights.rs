//! Virtual point lights on a wall that light a floor, with errata P5 to P7 of the paper on point GI.
//!
//! The wall is x = 0, 0 to 2 high and -1 to 1 wide; the floor y = 0 from the wall on, 2 deep. Radiosity of the
//! wall varies; the floor shows its irradiance.

use super::{Computed, drawn};
use anyhow::bail;
use glam::DVec3;
use std::f64::consts::PI;
use surfelshop_image::Image;

/// Area of the wall.
const AREA: f64 = 4.0;

/// Radiosity of the wall at a place of it, 0 to 1 across and up: a bright spot on a dim wall.
fn radiosity([a, b]: [f64; 2]) -> f64 {
    let square = ((a - 0.7) / 0.12).powi(2) + ((b - 0.45) / 0.12).powi(2);
    0.25 + 6.0 * (-0.5 * square).exp()
}

fn on_wall([a, b]: [f64; 2]) -> DVec3 {
    DVec3::new(0.0, 2.0 * b, 2.0 * a - 1.0)
}

/// What a pixel shows: a place of the floor.
fn on_floor(size: u32, x: u32, y: u32) -> DVec3 {
    let at = |k: u32| (f64::from(k) + 0.5) / f64::from(size);
    DVec3::new(2.0 * (1.0 - at(y)) + 1e-3, 0.0, 2.0 * at(x) - 1.0)
}

/// Irradiance of a place of the floor by a light on the wall of so much flux; `disc` is the light's area, 0 of a
/// point.
fn lit(place: DVec3, light: DVec3, flux: f64, disc: f64) -> f64 {
    let to = light - place;
    let square = to.length_squared();
    // The floor faces up, the wall along +x.
    let cosines = (to.y * -to.x).max(0.0) / square;
    flux * cosines / (PI * square + disc)
}

/// Halton's point of two dimensions.
fn halton(i: u32) -> [f64; 2] {
    [2, 3].map(|base| {
        let (mut i, mut f, mut r) = (i + 1, 1.0, 0.0);
        while i > 0 {
            f /= f64::from(base);
            r += f * f64::from(i % base);
            i /= base;
        }
        r
    })
}

fn grey(value: f64) -> Option<[f64; 3]> {
    Some([value; 3])
}

fn truth(size: u32) -> Image {
    let n = 96;
    let cell = |k: usize| (k as f64 + 0.5) / n as f64;
    let places: Vec<(DVec3, f64)> = (0..n * n)
        .map(|i| [cell(i % n), cell(i / n)])
        .map(|place| (on_wall(place), radiosity(place) * AREA / (n * n) as f64))
        .collect();
    drawn(size, |x, y| {
        let place = on_floor(size, x, y);
        // Cells as discs: near the wall they are not points.
        grey(
            places
                .iter()
                .map(|(light, flux)| lit(place, *light, *flux, AREA / (n * n) as f64))
                .sum(),
        )
    })
}

/// Lights in proportion to the radiosity: places and their probability over that of even ones.
fn warped(n: usize) -> Vec<([f64; 2], f64)> {
    let m = 64;
    let cell = |k: usize| (k as f64 + 0.5) / m as f64;
    let weights: Vec<f64> = (0..m * m).map(|i| radiosity([cell(i % m), cell(i / m)])).collect();
    let total: f64 = weights.iter().sum();
    let mut lights = Vec::with_capacity(n);
    let (mut i, mut sum) = (0, weights[0]);
    for k in 0..n {
        let wanted = (k as f64 + 0.5) / n as f64 * total;
        while sum < wanted && i + 1 < weights.len() {
            i += 1;
            sum += weights[i];
        }
        let jitter = halton(k as u32);
        let at = |k: usize, j: f64| (k as f64 + j) / m as f64;
        let place = [at(i % m, jitter[0]), at(i / m, jitter[1])];
        lights.push((place, weights[i] * (m * m) as f64 / total));
    }
    lights
}

/// An erratum.
pub(super) fn erratum(which: &str, size: u32) -> anyhow::Result<Computed> {
    let picture = |lights: &[(DVec3, f64)], disc: f64| {
        drawn(size, |x, y| {
            let place = on_floor(size, x, y);
            grey(lights.iter().map(|(light, flux)| lit(place, *light, *flux, disc)).sum())
        })
    };
    let n = 256;
    let share = AREA / n as f64;
    match which {
        "P5" => {
            let lights = warped(n);
            let flux = |weighted: bool| -> Vec<(DVec3, f64)> {
                let one = |(place, density): &([f64; 2], f64)| {
                    let flux = radiosity(*place) * share;
                    (on_wall(*place), if weighted { flux / density } else { flux })
                };
                lights.iter().map(one).collect()
            };
            Computed::pair(
                &picture(&flux(false), share),
                &picture(&flux(true), share),
                &truth(size),
            )
        }
        "P6" => {
            // Each light has so many candidates of its own; one of them carries the light of all.
            let m = 64u32;
            let chosen = |best: bool| -> Vec<(DVec3, f64)> {
                let one = |k: u32| {
                    let candidates: Vec<[f64; 2]> = (0..m).map(|i| halton(k * m + i)).collect();
                    let weights: Vec<f64> =
                        candidates.iter().map(|place| radiosity(*place)).collect();
                    let total: f64 = weights.iter().sum();
                    let at = if best {
                        (0..weights.len())
                            .fold(0, |a, b| if weights[b] > weights[a] { b } else { a })
                    } else {
                        let mut left = halton(k)[0] * total;
                        weights
                            .iter()
                            .position(|w| {
                                left -= w;
                                left < 0.0
                            })
                            .unwrap_or(0)
                    };
                    (on_wall(candidates[at]), total / f64::from(m) * share)
                };
                (0..n as u32).map(one).collect()
            };
            Computed::pair(
                &picture(&chosen(true), share),
                &picture(&chosen(false), share),
                &truth(size),
            )
        }
        "P7" => {
            let lights: Vec<(DVec3, f64)> = (0..n as u32)
                .map(halton)
                .map(|place| (on_wall(place), radiosity(place) * share))
                .collect();
            let (points, discs) = (picture(&lights, 0.0), picture(&lights, share));
            let mut all = Computed::pair(&points, &discs, &truth(size))?;
            let most =
                |image: &Image| f64::from(image.data.chunks(4).map(|p| p[0]).fold(0.0, f32::max));
            all.number("brightest pixel, points", most(&points), "");
            all.number("brightest pixel, discs", most(&discs), "");
            Ok(all)
        }
        other => bail!("there is no erratum {other} of virtual lights"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weighted_lights_have_the_flux_of_the_wall() {
        let m = 200;
        let cell = |k: usize| (k as f64 + 0.5) / m as f64;
        let flux =
            (0..m * m).map(|i| radiosity([cell(i % m), cell(i / m)])).sum::<f64>() / (m * m) as f64;
        let lights = warped(4096);
        let weighted =
            lights.iter().map(|(p, density)| radiosity(*p) / density).sum::<f64>() / 4096.0;
        let unweighted = lights.iter().map(|(p, _)| radiosity(*p)).sum::<f64>() / 4096.0;
        assert!((weighted / flux - 1.0).abs() < 0.02, "{weighted} {flux}");
        assert!(unweighted / flux > 2.0, "dense lights count twice: {unweighted}");
    }
}
