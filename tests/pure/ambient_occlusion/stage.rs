//! What these tests share: shapes, and bakes that must be finite.

use glam::Vec3;
use surfelshop_tests::clouds::{self, Surfels};
use surfelshop_tests::occlusion::{bake, values};

/// Every method at its defaults.
pub(crate) const METHODS: [&str; 4] =
    ["method=hybrid", "method=rays", "method=octree", "method=brute-force"];

/// Accessibility with these settings.
pub(crate) fn baked(surfels: &Surfels, settings: &str) -> Vec<f32> {
    let baked = bake(&surfels.cloud().view(), &values(settings));
    let ao = baked.expect("the settings are good").ao;
    assert_eq!(ao.len(), surfels.positions.len());
    assert!(ao.iter().all(|ao| (0.0..=1.0).contains(ao)), "{settings}: {ao:?}");
    ao
}

/// Root mean square of a difference.
pub(crate) fn rms(a: &[f32], b: &[f32]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2));
    (squares.sum::<f64>() / a.len().max(1) as f64).sqrt()
}

/// Surfels of a sphere that a test keeps, seen from inside or outside.
pub(crate) fn part_of_sphere(n: usize, keep: impl Fn(Vec3) -> bool, outward: bool) -> Surfels {
    let mut part = Surfels::default();
    for position in clouds::sphere(n, 1.0).positions.into_iter().filter(|&p| keep(p)) {
        part.push(position, if outward { position } else { -position }, 0.01);
    }
    part
}

/// A disc of surfels at a height that faces up.
pub(crate) fn disc(rings: u32, radius: f32, height: f32) -> Surfels {
    let mut disc = Surfels::default();
    let step = radius / (rings as f32 + 0.5);
    disc.push(Vec3::Y * height, Vec3::Y, step);
    for ring in 1..=rings {
        // Rings of equal width whose surfels have equal areas.
        for i in 0..6 * ring {
            let angle = std::f32::consts::TAU * i as f32 / (6 * ring) as f32;
            let at = Vec3::new(angle.cos(), 0.0, angle.sin()) * (ring as f32 * step);
            disc.push(at + Vec3::Y * height, Vec3::Y, step);
        }
    }
    disc
}

pub(crate) fn joined(parts: &[Surfels]) -> Surfels {
    let mut all = Surfels::default();
    for part in parts {
        all.positions.extend(&part.positions);
        all.normals.extend(&part.normals);
        all.radii.extend(&part.radii);
    }
    all
}
