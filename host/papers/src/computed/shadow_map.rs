//! An imperfect shadow map of a plate, with erratum P2 of the paper on point GI.
//!
//! The light is at the origin and looks along -z; the plate is tilted below it. A paraboloid map has the
//! coordinates tan(theta / 2) times the direction around the axis.

use super::{Computed, drawn};
use glam::{DVec2, DVec3};
use surfelshop_image::Image;

/// Texels along a side: imperfect maps are small.
const SIDE: u32 = 64;

/// Points of the plate.
const N_POINTS: u32 = 3_000;

/// Nearest point of the plate, and its axes.
const PLATE: [DVec3; 3] =
    [DVec3::new(-0.6, -0.3, -0.35), DVec3::new(3.2, 0.0, -1.6), DVec3::new(0.0, 1.8, -0.6)];

fn normal() -> DVec3 {
    PLATE[1].cross(PLATE[2]).normalize_or_zero()
}

/// Where a direction is on the map, -1 to 1.
fn place(d: DVec3) -> DVec2 {
    let d = d.normalize_or(DVec3::NEG_Z);
    d.truncate() / (1.0 - d.z)
}

/// The direction at a place of the map.
fn direction(at: DVec2) -> DVec3 {
    let square = at.length_squared();
    DVec3::new(2.0 * at.x, 2.0 * at.y, square - 1.0) / (1.0 + square)
}

/// The distance of the plate in a direction.
fn distance(d: DVec3) -> Option<f64> {
    let normal = normal();
    let t = PLATE[0].dot(normal) / d.dot(normal);
    let hit = t * d - PLATE[0];
    let inside = |axis: DVec3| (0.0..=1.0).contains(&(hit.dot(axis) / axis.length_squared()));
    // The axes are not quite at right angles; both are within the plate's plane.
    (t > 0.0 && inside(PLATE[1]) && inside(PLATE[2])).then_some(t)
}

/// The map that points make, each a square of so many texels to each side of its middle, by its distance.
fn splatted(half: impl Fn(f64, DVec2) -> f64) -> Vec<f64> {
    let mut map = vec![f64::INFINITY; (SIDE * SIDE) as usize];
    for i in 0..N_POINTS {
        // Roberts's sequence: even, and no grid.
        let [a, b] =
            [0.754_877_666_246_692_8, 0.569_840_290_998_053_3].map(|f| (f * f64::from(i)).fract());
        let point = PLATE[0] + PLATE[1] * a + PLATE[2] * b;
        let (d, at) = (point.length(), place(point));
        let middle = (at * 0.5 + 0.5) * f64::from(SIDE);
        let half = half(d, at).max(0.5);
        let [x, y] = [middle.x, middle.y].map(|m| {
            let from = (m - half).round().max(0.0) as u32;
            from..((m + half).round().max(0.0) as u32).min(SIDE)
        });
        for y in y {
            for x in x.clone() {
                let texel = &mut map[(y * SIDE + x) as usize];
                *texel = texel.min(d);
            }
        }
    }
    map
}

/// One over the distance, as the renderer shows its maps.
fn shown(size: u32, at: impl Fn(u32, u32) -> Option<f64> + Sync) -> Image {
    drawn(size, |x, y| {
        let cell = |k: u32| k * SIDE / size;
        Some([at(cell(x), cell(y)).map_or(0.0, |d| 0.5 / d); 3])
    })
}

/// The erratum.
pub(super) fn erratum(size: u32) -> anyhow::Result<Computed> {
    let area = PLATE[1].cross(PLATE[2]).length();
    // Half the side of a square of each point's share, made wider by a half.
    let radius = 0.75 * (area / f64::from(N_POINTS)).sqrt();
    let texels = 0.5 * f64::from(SIDE);
    let right = |d: f64, at: DVec2| texels * radius / d * (1.0 + at.length_squared()) / 2.0;
    // Of the same size at the distance 1.
    let wrong = |d: f64, at: DVec2| texels * radius * d * d * (1.0 + at.length_squared()) / 2.0;
    let (printed, corrected) = (splatted(wrong), splatted(right));
    let of =
        |map: &[f64], x: u32, y: u32| Some(map[(y * SIDE + x) as usize]).filter(|d| d.is_finite());
    let exact = |x: u32, y: u32| {
        let at = |k: u32| (f64::from(k) + 0.5) / f64::from(SIDE) * 2.0 - 1.0;
        distance(direction(DVec2::new(at(x), at(y))))
    };
    let mut all = Computed::pair(
        &shown(size, |x, y| of(&printed, x, y)),
        &shown(size, |x, y| of(&corrected, x, y)),
        &shown(size, exact),
    )?;
    for (name, map) in [("printed", &printed), ("corrected", &corrected)] {
        let all_texels = || (0..SIDE * SIDE).map(|i| (i % SIDE, i / SIDE));
        let covered = all_texels().filter(|(x, y)| exact(*x, *y).is_some());
        let n = covered.clone().count().max(1);
        let holes = covered.filter(|(x, y)| of(map, *x, *y).is_none()).count();
        all.number(
            &format!("holes, as {name}"),
            100.0 * holes as f64 / n as f64,
            "% of the plate's texels",
        );
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_and_places_are_inverse() {
        for at in [DVec2::ZERO, DVec2::new(0.3, -0.5), DVec2::new(-0.9, 0.1)] {
            assert!((place(direction(at)) - at).length() < 1e-12);
        }
        assert!(direction(DVec2::ZERO).z < -0.999, "the light looks along -z");
    }
}
