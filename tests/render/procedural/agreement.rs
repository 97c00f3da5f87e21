//! Noise and patterns equal their twins in f64, on every device.

use glam::DVec3;
use std::path::Path;
use surfelshop_api::ObjectFrame;
use surfelshop_api::params::Value;
use surfelshop_render::{Backend, GpuOptions};
use surfelshop_tests::procedural::noise::Place;
use surfelshop_tests::procedural::patterns::{ALL, FAINTEST, Settings};
use surfelshop_tests::procedural::places::{boxed, spots};
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
fn bound(look: &dyn Fn(&Place) -> DVec3, settings: &Settings, at: &Place, offset: DVec3) -> f64 {
    let here = look(at);
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
            most = most.max((look(&moved) - here).abs().max_element());
        }
    }
    3.0 * most + 60.0 * EPSILON * (1.0 + here.max_element()) + 1.5e-7 / 0.06
}

/// Compares spots with the twin.
pub(crate) fn compare(
    bench: &mut Bench,
    settings: &Settings,
    pattern: &str,
    spots: &[Spot],
    origin: DVec3,
    object: ObjectFrame,
) {
    let albedo =
        |settings: &Settings, at: &Place, own: DVec3| settings.look(pattern, at, own).albedo;
    let colors = bench.colors(spots, origin, object, &settings.values(pattern)).unwrap();
    compare_with(&albedo, settings, &colors, spots, origin, object);
}

/// Compares what came of spots with what a twin says.
fn compare_with(
    twin: &dyn Fn(&Settings, &Place, DVec3) -> DVec3,
    settings: &Settings,
    colors: &[DVec3],
    spots: &[Spot],
    origin: DVec3,
    object: ObjectFrame,
) {
    assert_eq!(colors.len(), spots.len());
    for (spot, &color) in spots.iter().zip(colors) {
        let at = spot.place(origin, &object, true);
        let own = spot.albedo.as_dvec3();
        let in_box = spot.offset.as_dvec3() / object.size;
        // Rounding decides whether an octave at the limit is left out.
        let either = [1.0 - 1e-4, 1.0 + 1e-4].map(|factor| {
            let settings = Settings { faintest: FAINTEST * factor, ..*settings };
            let look = |at: &Place| twin(&settings, at, own);
            let difference = (color - look(&at)).abs().max_element();
            (difference, bound(&look, &settings, &at, in_box), look(&at))
        });
        assert!(color.is_finite(), "{color} at {at:?}");
        assert!(
            either.iter().any(|(difference, bound, _)| difference <= bound),
            "{color} at {at:?}; difference, bound and what was expected: {either:?}"
        );
    }
}

fn engine(backend: Backend) -> GpuOptions {
    GpuOptions { backend: Some(backend), ..GpuOptions::default() }
}

/// Invariant: noise and every pattern are those of an f64 twin, on Vulkan and OpenGL, a million
/// metres away and a millionth of the cloud close, at all ends of their parameters
#[test]
fn every_pattern_equals_its_twin() {
    let mut benches = [Backend::Primary, Backend::Gl].map(|backend| Bench::new(&engine(backend)));
    assert_ne!(benches[0].device(), benches[1].device());
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
            for bench in &mut benches {
                compare(bench, settings, pattern, &spots, origin, object);
            }
        }
    }
}

/// The other parts of a look, through a pattern of one's own that calls one of ours and shows them as
/// its colour.
#[test]
fn highlights_and_roughness_equal_the_twins_too() {
    let folder = tempfile::tempdir().unwrap();
    let mut bench = Bench::new(&GpuOptions::default());
    let settings = Settings { seed: 3, octaves: 5, ..Settings::default() };
    for pattern in ALL {
        let file = format!("{}.wgsl", pattern.replace('-', "_"));
        let ours = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../plugins/procedural/src/patterns")
            .join(&file);
        let ours = std::fs::read_to_string(ours).unwrap();
        assert_eq!(ours.matches("fn look(").count(), 1);
        let text = ours.replace("fn look(", "fn ours(")
            + "fn look(at: Place, albedo: vec3<f32>) -> Look {\n\
               let m = ours(at, albedo);\n\
               return Look(vec3(m.specular, m.roughness, m.metallic), 0.0, 0.5, 0.0);\n}\n";
        let path = folder.path().join(&file);
        std::fs::write(&path, text).unwrap();
        let mut values = settings.values(pattern);
        values.insert("file".to_owned(), Value::Text(path.display().to_string()));
        let spots = spots(500, 1.0, 0.3, 9);
        let (origin, object) = (DVec3::ZERO, boxed(DVec3::ZERO, 1.0));
        let colors = bench.colors(&spots, origin, object, &values).unwrap();
        let twin = |settings: &Settings, at: &Place, own: DVec3| {
            let look = settings.look(pattern, at, own);
            DVec3::new(look.specular, look.roughness, look.metallic)
        };
        compare_with(&twin, &settings, &colors, &spots, origin, object);
    }
}
