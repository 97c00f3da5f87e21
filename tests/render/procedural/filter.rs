//! What filtering leaves of a pattern that is finer than its pixels.

use surfelshop_api::params::{Value, Values};
use surfelshop_tests::procedural::patterns::{ALL, Settings};
use surfelshop_tests::procedural::plane::{PERIODIC, PatternView, Plane, SUM, rmse, unlit};

/// From every octave as large as pixels to the coarsest one finer than they are: with 4 cells a
/// unit and 0.0063 units a pixel at distance 1, base cells are 40 to 0.15 pixels wide.
const DISTANCES: [f64; 5] = [1.0, 4.0, 16.0, 64.0, 256.0];

fn unfiltered(values: &Values) -> Values {
    let mut values = values.clone();
    values.insert("filter".to_owned(), Value::Bool(false));
    values
}

/// Invariant: filtered patterns are what 256 samples a pixel see, and do not flicker
#[test]
fn filtered_patterns_are_what_256_samples_see() {
    let mut plane = Plane::new();
    for pattern in ALL {
        let values = unlit(&Settings::default(), pattern, 4.0);
        for tilt in [0.0, 1.2] {
            let mut ratio = 0.0;
            for distance in DISTANCES {
                let sight = PatternView { distance, tilt, size: 64 };
                let truth = plane.truth(sight, &values).unwrap();
                let filtered = plane.picture(sight, &values).unwrap().pixels;
                let points = plane.picture(sight, &unfiltered(&values)).unwrap().pixels;
                let [filtered, points] = [filtered, points].map(|pixels| rmse(&pixels, &truth));
                ratio = filtered / points;
                // A filter that loses more than it saves would be one too many; where next to nothing
                // is finer than a pixel there is next to nothing to be saved.
                assert!(
                    filtered <= 1.05 * points + 1e-3,
                    "{pattern} at {distance}, tilt {tilt}: {filtered} filtered, {points} not"
                );
            }
            assert!(ratio <= 1.0 / 3.0, "{pattern}, tilt {tilt}: {ratio} at the farthest");
        }
    }
}

#[test]
fn zooming_makes_patterns_flicker_as_little_as_samples_do() {
    let mut plane = Plane::new();
    for pattern in ALL {
        let values = unlit(&Settings::default(), pattern, 4.0);
        let mut change = |filter: bool| -> f64 {
            let values = if filter { values.clone() } else { unfiltered(&values) };
            let mut frame = |i: i32| {
                let sight = PatternView { distance: 256.0 * 1.005f64.powi(i), tilt: 0.6, size: 64 };
                plane.picture(sight, &values).unwrap().pixels
            };
            let frames: Vec<_> = (0..6).map(&mut frame).collect();
            frames.windows(2).map(|pair| rmse(&pair[0], &pair[1])).sum::<f64>() / 5.0
        };
        let (filtered, points) = (change(true), change(false));
        assert!(filtered <= points / 3.0, "{pattern}: {filtered} filtered, {points} not");
    }
}

/// The volume's levels are means over cubes: where noise is finer than pixels they are nearer to what 256
/// samples see than one value at the pixel's centre, however well faded, and close by what interpolation
/// leaves of the noise.
#[test]
fn the_volume_is_filtered_by_its_levels() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        Value::Text(path.display().to_string())
    };
    let mut plane = Plane::new();
    let settings = Settings { octaves: 1, ..Settings::default() };
    let mut with = unlit(&settings, "simple-marble", 4.0);
    with.insert("file".to_owned(), file("sum.wgsl", SUM));
    let mut volume = with.clone();
    volume.insert("noise".to_owned(), Value::Text("volume".to_owned()));
    let mut periodic = with.clone();
    periodic.insert("file".to_owned(), file("periodic.wgsl", PERIODIC));
    let mut errors = |distance: f64| {
        let sight = PatternView { distance, tilt: 0.0, size: 64 };
        let truths = [&with, &periodic].map(|values| plane.truth(sight, values).unwrap());
        let [computed, looked_up] =
            [&with, &volume].map(|values| plane.picture(sight, values).unwrap().pixels);
        [rmse(&computed, &truths[0]), rmse(&looked_up, &truths[1])]
    };
    let [computed, looked_up] = errors(64.0);
    assert!(looked_up < 0.93 * computed, "{looked_up} {computed}");
    let [computed, looked_up] = errors(16.0);
    assert!(looked_up < 1.5 * computed, "{looked_up} {computed}");
    // 8 texels a cell: a 60th of the deviation of 0.125.
    let [_, looked_up] = errors(0.25);
    assert!((0.001..0.012).contains(&looked_up), "{looked_up}");
}
