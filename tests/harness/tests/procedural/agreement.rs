//! Noise and patterns equal their twins in f64, on every device.

use crate::places::{boxed, spots};
use glam::DVec3;
use surfelshop_api::ObjectFrame;
use surfelshop_engine::GpuOptions;
use surfelshop_tests::procedural::noise::Place;
use surfelshop_tests::procedural::patterns::{ALL, FAINTEST, Settings};
use surfelshop_tests::procedural::{Bench, Spot};

/// Units in the last place of 1 in f32.
const EPSILON: f64 = f32::EPSILON as f64;

/// How far f32 may be off, from what the twin says of places and lattices that are moved by as much
/// as f32 rounds.
///
/// An offset is rounded once by each of the nine products and six sums that turn it into the
/// pattern: 4 units of its largest component. Sums of broken parts in a lattice, at most 3 and
/// moved by octaves of up to 16 more, are rounded to 16 units of 1. The largest change over the
/// axes, both ways, stands for the slope; three of them may add up. What bends places is noise, and as exact as the
/// rest, which is arithmetic on numbers of order 1 in
/// chains of some sixty operations, and the error function, of which the shader's is off by 1.5e-7
/// at a time, divided by ramps as narrow as 0.06.
fn bound(settings: &Settings, pattern: &str, at: &Place, offset: DVec3, albedo: DVec3) -> f64 {
    let here = settings.look(pattern, at, albedo).albedo;
    let bent = 60.0 * f64::from(settings.warp) / f64::from(settings.frequency).max(1e-3);
    let mut most: f64 = 0.0;
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        for sign in [-1.0, 1.0] {
            let by = sign * axis;
            let moved = Place {
                position: at.position + by * (offset.abs().max_element() * 4.0 + bent) * EPSILON,
                jitter: by * 16.0 * EPSILON,
                ..*at
            };
            let there = settings.look(pattern, &moved, albedo).albedo;
            most = most.max((there - here).abs().max_element());
        }
    }
    3.0 * most + 60.0 * EPSILON * (1.0 + here.max_element()) + 1.5e-7 / 0.06
}

/// Compares spots with the twin.
fn compare(
    bench: &mut Bench,
    settings: &Settings,
    pattern: &str,
    spots: &[Spot],
    origin: DVec3,
    object: ObjectFrame,
) {
    let colors = bench.colors(spots, origin, object, &settings.values(pattern)).unwrap();
    assert_eq!(colors.len(), spots.len());
    for (spot, color) in spots.iter().zip(colors) {
        let at = spot.place(origin, &object, true);
        let albedo = spot.albedo.as_dvec3();
        // Rounding decides whether an octave at the limit is left out.
        let either = [1.0 - 1e-4, 1.0 + 1e-4].map(|factor| {
            let settings = Settings { faintest: FAINTEST * factor, ..*settings };
            settings.look(pattern, &at, albedo).albedo
        });
        let nearer = |a: &&DVec3, b: &&DVec3| {
            let [a, b] = [a, b].map(|expected| (color - **expected).abs().max_element());
            a.total_cmp(&b)
        };
        let expected = *either.iter().min_by(nearer).expect("there are two");
        let difference = (color - expected).abs().max_element();
        let in_box = spot.offset.as_dvec3() / object.size;
        let bound = bound(settings, pattern, &at, in_box, albedo);
        assert!(
            difference <= bound,
            "{pattern}: {color} for {expected} at {at:?}, {difference:e} above {bound:e}"
        );
    }
}

#[test]
fn every_pattern_equals_its_twin() {
    let mut bench = Bench::new(&GpuOptions::default());
    let variants = [
        Settings::default(),
        Settings {
            frequency: 11.3,
            octaves: 9,
            lacunarity: 1.87,
            gain: 0.71,
            seed: 5,
            ..Settings::default()
        },
        Settings { frequency: 2.5, octaves: 3, warp: 0.8, seed: 60_001, ..Settings::default() },
    ];
    for pattern in ALL {
        for (i, settings) in variants.iter().enumerate() {
            let spots = spots(1000, 2.0, 0.3, i as u32);
            let origin = DVec3::new(0.3, -1.0, 20.0);
            let object = boxed(origin, 2.0);
            compare(&mut bench, settings, pattern, &spots, origin, object);
        }
    }
}
